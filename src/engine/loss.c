#include "engine/loss.h"

#include <math.h>

#include "engine/engine.h"
#include "engine/view_loss.h"

// ---- terms on images ----

static void photo_rows(const ViewLoss *v, int y0, int y1, double *sum)
{
    double weight = v->weight[LOSS_L1] + v->weight[LOSS_DSSIM] + v->weight[LOSS_CONTRAST], whole = fmax(weight, 1e-30);
    PhotometricArgs args = {.I = &v->images->P,
                            .Y = v->photo,
                            .mu_Y = v->mu,
                            .var_Y = v->var,
                            .mask = v->mask,
                            .lambda = (float)(v->weight[LOSS_DSSIM] / whole),
                            .kappa = (float)(v->weight[LOSS_CONTRAST] / whole),
                            .weight = (float)weight,
                            .d_I = &v->images->d_P,
                            .scratch = v->scratch};
    PhotometricSums s = v->kernels->photometric->loss(&args, y0, y1);
    sum[LOSS_L1] += s.l1;
    if (v->weight[LOSS_DSSIM] > 0) sum[LOSS_DSSIM] += s.dssim;
    if (v->weight[LOSS_CONTRAST] > 0) sum[LOSS_CONTRAST] += s.contrast;
}

// Minus Pearson's correlation of T_N and T_F; its value is known from the whole image alone (kernels/pearson.h).
static void linearity_rows(const ViewLoss *v, int y0, int y1, double *sum)
{
    (void)sum;
    if (!v->other) return;
    Planes x = fs_view_images_rgb(&v->images->T->feature), y = fs_view_images_rgb(&v->other->feature);
    Planes d_x = fs_view_images_rgb(&v->images->T->d_feature), d_y = fs_view_images_rgb(&v->other->d_feature);
    PearsonArgs args = {.X = &x,
                        .Y = &y,
                        .X_linear = v->T_linear,
                        .Y_linear = v->other_linear,
                        .d_X = &d_x,
                        .d_Y = v->other->train ? &d_y : NULL,
                        .weight = (float)v->weight[LOSS_LINEARITY]};
    v->kernels->pearson->gradient(&args, v->pearson, y0, y1);
}

#define SMOOTH_G 2.0f // the code's g for depth on every scene, and for beta on most (method of the paper's authors)

static void depth_rows(const ViewLoss *v, int y0, int y1, double *sum)
{
    for (int l = 0; l < LAYERS; l++) {
        RasterTask *task = v->task[l];
        if (!task || !(fs_loss_terms[LOSS_DEPTH_SMOOTH].layers >> l & 1)) continue;
        Planes depth = fs_view_images_last(task, &task->feature), d_depth = fs_view_images_last(task, &task->d_feature);
        SmoothArgs args = {
            .map = &depth, .g = SMOOTH_G, .weight = (float)v->weight[LOSS_DEPTH_SMOOTH], .d_map = &d_depth};
        sum[LOSS_DEPTH_SMOOTH] += v->kernels->smooth->loss(&args, y0, y1);
    }
}

static void beta_rows(const ViewLoss *v, int y0, int y1, double *sum)
{
    SmoothArgs args = {.map = &v->images->beta_map,
                       .g = SMOOTH_G,
                       .weight = (float)v->weight[LOSS_BETA_SMOOTH],
                       .d_map = &v->images->d_beta};
    sum[LOSS_BETA_SMOOTH] += v->kernels->smooth->loss(&args, y0, y1);
}

static void opaque_rows(const ViewLoss *v, int y0, int y1, double *sum)
{
    for (int l = 0; l < LAYERS; l++) {
        RasterTask *task = v->task[l];
        if (!task || !task->use_d_transmittance) continue;
        sum[LOSS_OPAQUE] += v->kernels->pixelwise->opaque(&task->transmittance, (float)v->weight[LOSS_OPAQUE],
                                                          &task->d_transmittance, y0, y1);
    }
}

static void unseen_rows(const ViewLoss *v, int y0, int y1, double *sum)
{
    if (!v->around) return;
    Planes R = fs_view_images_rgb(&v->images->R->feature), d_R = fs_view_images_rgb(&v->images->R->d_feature);
    OcclusionAroundArgs args = {v->images->occlusion, &R, &d_R, v->around, (float)v->weight[LOSS_UNSEEN]};
    sum[LOSS_UNSEEN] += v->kernels->occlusion->apart(&args, y0, y1);
}

// ---- terms on the samples of rays through radiance fields ----

static Planes way_of(const Planes *way, int channel)
{
    Planes p = *way;
    p.px = fs_planes_row(way, channel, 0);
    p.channels = 1;
    return p;
}

// Each volume once: a layer's task stands for it.
static void spread_rows(const ViewLoss *v, int y0, int y1, double *sum)
{
    const RasterTask *const task[2] = {v->images->T, v->images->R};
    for (int k = 0; k < 2; k++) {
        if (!task[k]) continue;
        Planes spread = way_of(&task[k]->way, 2), d_spread = way_of(&task[k]->d_way, 2);
        sum[LOSS_SPREAD] += v->kernels->pixelwise->opaque(&spread, (float)v->weight[LOSS_SPREAD], &d_spread, y0, y1);
    }
}

#define WAY_G 0.1f // of NeRFReN's authors: how much photos differ at an edge

static void way_smooth_rows(const ViewLoss *v, int y0, int y1, double *sum)
{
    Planes depth = way_of(&v->images->T->way, 0), d_depth = way_of(&v->images->T->d_way, 0);
    SmoothArgs args = {
        .map = &depth, .guide = v->photo, .g = WAY_G, .weight = (float)v->weight[LOSS_WAY_SMOOTH], .d_map = &d_depth};
    sum[LOSS_WAY_SMOOTH] += v->kernels->smooth->guided(&args, y0, y1);
}

static void way_both_rows(const ViewLoss *v, int y0, int y1, double *sum)
{
    if (!v->images->R) return;
    const RasterTask *R = v->images->R;
    Planes a = way_of(&R->way, 0), b = way_of(&R->way, 1), d_a = way_of(&R->d_way, 0), d_b = way_of(&R->d_way, 1);
    ApartArgs args = {&a, &b, &d_a, &d_b, (float)v->weight[LOSS_WAY_BOTH]};
    sum[LOSS_WAY_BOTH] += v->kernels->pixelwise->apart(&args, y0, y1);
}

// ---- terms on parameters ----

static void gain_smooth_range(const CloudLoss *c, double *sum)
{
    if (!c->graph) return;
    sum[LOSS_GAIN_SMOOTH] += c->kernels->gain->smooth(c->graph, c->cloud->field[CLOUD_GAINS], c->begin, c->end,
                                                      (float)c->weight[LOSS_GAIN_SMOOTH], c->d_field[CLOUD_GAINS]);
}

static void gain_push_range(const CloudLoss *c, double *sum)
{
    sum[LOSS_GAIN_PUSH] +=
        c->kernels->gain->push(c->cloud->field[CLOUD_GAINS], c->begin, c->end,
                               (float)(c->weight[LOSS_GAIN_PUSH] / c->cloud->n), c->d_field[CLOUD_GAINS]) /
        c->cloud->n;
}

// Mean opacity and mean scale (3DGS-MCMC, Kheradmand et al. 2024, eq. 8); of those not seen too: Adam passes them over.
static void opacity_range(const CloudLoss *c, double *sum)
{
    float weight = (float)(c->weight[LOSS_OPACITY_REG] / c->cloud->n);
    sum[LOSS_OPACITY_REG] +=
        c->kernels->regularise->sigmoid(c->cloud->field[CLOUD_OPACITIES] + c->begin, (size_t)(c->end - c->begin),
                                        weight, c->d_field[CLOUD_OPACITIES] + c->begin) /
        c->cloud->n;
}

static void scale_range(const CloudLoss *c, double *sum)
{
    double n = 3.0 * c->cloud->n;
    float weight = (float)(c->weight[LOSS_SCALE_REG] / n) / (float)c->scene->extent;
    sum[LOSS_SCALE_REG] +=
        c->kernels->regularise->exp(c->cloud->field[CLOUD_SCALES] + 3 * c->begin, 3 * (size_t)(c->end - c->begin),
                                    weight, c->d_field[CLOUD_SCALES] + 3 * c->begin) /
        (n * c->scene->extent);
}

// Mean colour of the mirrored scene, tone-mapped: what little is mirrored must not be brighter than the photos ask.
static void mirrored_light_range(const CloudLoss *c, double *sum)
{
    double n = 3.0 * c->cloud->n, colors = 0;
    float gradient = (float)(c->weight[LOSS_MIRRORED_LIGHT] / n);
    for (int i = 3 * c->begin; i < 3 * c->end; i++) {
        c->d_field[CLOUD_COLORS][i] += gradient;
        colors += (double)c->cloud->field[CLOUD_COLORS][i];
    }
    sum[LOSS_MIRRORED_LIGHT] += colors / n;
}

// ---- terms on what is learned of the camera ----

// Squares of what the light of a photo and its exposure differ by, and of what of that goes along with the photo's place
// (a projection, so that its gradient over all photos is twice itself). White balance photos tell well.
static double photo_reg(const PhotoState *photo, const PhotoGuess *guess, double weight, double gradient[])
{
    const float *white = photo->x + PHOTO_WHITE;
    const double x[4] = {(double)photo->x[PHOTO_T], (double)photo->x[PHOTO_R], (double)photo->x[PHOTO_FLASH],
                         (double)(white[0] + white[1] + white[2]) / 3};
    double sum = 0;
    for (int k = 0; k < 4; k++) {
        double along = guess->along[k], d = 2 * (guess->held[k] * x[k] + guess->held_along[k] * along);
        sum += guess->held[k] * x[k] * x[k] + guess->held_along[k] * along * along;
        for (int c = 0; c < 3 && k == PHOTO_WHITE; c++) gradient[PHOTO_WHITE + c] += weight * d / 3;
        if (k < PHOTO_WHITE) gradient[k] += weight * d;
    }
    return sum;
}

// Where cameras' own curves bend, as second differences at the inner knots: the shadows are deepened below a straight
// middle (the toe), and lights roll off (the shoulder). How much each is, is the camera's.
enum { BENDS = FS_OPTICS_KNOTS - 2, USUAL = 2 };
static const double usual_bends[USUAL][BENDS] = {
    {0, 0, 0.7, 1, 0, 0, 0, 0, 0},
    {0, 0, 0, 0, -0.3, -0.8, -1, -1.3, -1.5},
};

// A camera's curve bends little but where curves do. The two are at right angles: each takes its part off by itself.
static double response_smooth(const double response[], double weight, double gradient[])
{
    double bend[BENDS], sum = 0;
    for (int k = 0; k < BENDS; k++) bend[k] = response[k] - 2 * response[k + 1] + response[k + 2];
    for (int u = 0; u < USUAL; u++) {
        double own = 0, along = 0;
        for (int k = 0; k < BENDS; k++) {
            own += usual_bends[u][k] * usual_bends[u][k];
            along += usual_bends[u][k] * bend[k];
        }
        for (int k = 0; k < BENDS; k++) bend[k] -= fmax(along, 0) / own * usual_bends[u][k];
    }
    for (int k = 0; k < BENDS; k++) {
        sum += bend[k] * bend[k];
        for (int i = 0; i < 3; i++) gradient[k + i] += weight * 2 * bend[k] * (i == 1 ? -2 : 1);
    }
    return sum;
}

// ---- the table ----

#define T (1u << LAYER_T_N | 1u << LAYER_T_F)
#define R (1u << LAYER_R)
#define BETA (1u << LAYER_BETA)

// What lies behind a surface by mistake of the start must fade before scenes are closed, so `opaque` sets in late.
// What the push has moved to R stays there without it, and gains that are truly low recover; so does R that was held
// dark, where the photos ask for its light.
const LossInfo fs_loss_terms[LOSS_TERMS] = {
    [LOSS_L1] = {.name = "l1", .setting = "rgb-weight", .layers = T | R | BETA, .rows = photo_rows},
    [LOSS_DSSIM] = {.name = "dssim", .setting = "dssim", .layers = T | R | BETA},
    [LOSS_CONTRAST] = {.name = "contrast", .setting = "contrast", .layers = T | R | BETA},
    [LOSS_LINEARITY] =
        {.name = "linearity", .setting = "linearity", .needs = LOSS_NEEDS_TWO_T, .layers = T, .rows = linearity_rows},
    [LOSS_DEPTH_SMOOTH] =
        {.name = "depth_smooth", .setting = "depth-smooth", .layers = T | R, .depth = true, .rows = depth_rows},
    [LOSS_BETA_SMOOTH] =
        {.name = "beta_smooth", .setting = "beta-smooth", .needs = LOSS_NEEDS_BETA, .layers = BETA, .rows = beta_rows},
    [LOSS_OPAQUE] = {.name = "opaque",
                     .setting = "opaque",
                     .begin = 0.4,
                     .full = 0.6,
                     .layers = T | R,
                     .transmittance = true,
                     .rows = opaque_rows},
    [LOSS_UNSEEN] = {.name = "unseen", .setting = "unseen", .layers = R, .rows = unseen_rows},
    [LOSS_GAIN_SMOOTH] = {.name = "gain_smooth",
                          .setting = "gain-smooth",
                          .needs = LOSS_NEEDS_GAINS,
                          .layers = 1u << LAYER_T_N,
                          .gaussians = gain_smooth_range},
    [LOSS_GAIN_PUSH] = {.name = "gain_push",
                        .setting = "gain-push",
                        .needs = LOSS_NEEDS_GAINS | LOSS_NEEDS_MUCH,
                        .until = 0.75,
                        .layers = 1u << LAYER_T_N,
                        .gaussians = gain_push_range},
    [LOSS_OPACITY_REG] = {.name = "opacity_reg",
                          .setting = "opacity-reg",
                          .layers = T | R | BETA,
                          .gaussians = opacity_range},
    [LOSS_SCALE_REG] = {.name = "scale_reg", .setting = "scale-reg", .layers = T | R | BETA, .gaussians = scale_range},
    [LOSS_MIRRORED_LIGHT] = {.name = "mirrored_light",
                             .setting = "mirrored-light",
                             .needs = LOSS_NEEDS_LITTLE,
                             .until = 0.3,
                             .after = 0.02,
                             .layers = R,
                             .gaussians = mirrored_light_range},
    [LOSS_SPREAD] =
        {.name = "spread", .setting = "spread", .needs = LOSS_NEEDS_FIELD, .layers = T | R, .rows = spread_rows},
    [LOSS_WAY_SMOOTH] = {.name = "way_smooth",
                         .setting = "way-smooth",
                         .needs = LOSS_NEEDS_FIELD,
                         .full = 0.03,
                         .until = 0.2,
                         .after = 0.1,
                         .layers = T,
                         .rows = way_smooth_rows},
    [LOSS_WAY_BOTH] = {.name = "way_both",
                       .setting = "way-both",
                       .needs = LOSS_NEEDS_FIELD | LOSS_NEEDS_BETA,
                       .begin = 0.1,
                       .full = 0.17,
                       .until = 0.4,
                       .layers = R,
                       .rows = way_both_rows},
    [LOSS_PHOTO_REG] = {.name = "photo_reg", .setting = "photo-reg", .photo = photo_reg},
    [LOSS_RESPONSE_SMOOTH] = {.name = "response_smooth", .setting = "response-smooth", .response = response_smooth},
};

LossLooks fs_loss_looks(const double weight[LOSS_TERMS], Layer layer)
{
    LossLooks looks = {false, false};
    for (int k = 0; k < LOSS_TERMS; k++) {
        if (!(weight[k] > 0) || !(fs_loss_terms[k].layers >> layer & 1)) continue;
        looks.depth |= fs_loss_terms[k].depth;
        looks.transmittance |= fs_loss_terms[k].transmittance;
    }
    return looks;
}

static bool has_needs(const Scene *scene, const LossInfo *term)
{
    const unsigned needs = term->needs;
    if (fs_radiance_is(&scene->field)) {
        if (needs & LOSS_NEEDS_TWO_T && scene->separation != SEPARATION_FULL) return false;
        return !term->gaussians && !(needs & LOSS_NEEDS_BETA && scene->separation == SEPARATION_NONE);
    }
    if (needs & LOSS_NEEDS_FIELD || needs & (scene->rare > 0 ? LOSS_NEEDS_MUCH : LOSS_NEEDS_LITTLE)) return false;
    if (needs & LOSS_NEEDS_TWO_T && scene->shared_geometry) return false;
    if (needs & LOSS_NEEDS_BETA && (scene->pane_beta || !scene->cloud[LAYER_BETA].n)) return false;
    return !(needs & LOSS_NEEDS_GAINS) || (scene->shared_geometry && scene->separation == SEPARATION_FULL);
}

void fs_loss_weights(const Settings *set, const Scene *scene, double progress, double weight[LOSS_TERMS])
{
    for (int k = 0; k < LOSS_TERMS; k++) {
        const LossInfo *term = &fs_loss_terms[k];
        double ramp = term->full > 0 ? (progress - term->begin) / (term->full - term->begin) : 1;
        double share = term->until > 0 && progress > term->until ? term->after : fmin(fmax(ramp, 0), 1);
        weight[k] = has_needs(scene, term) ? fs_settings_number(set, term->setting) * share : 0;
    }
    bool windows = !fs_radiance_is(&scene->field); // of neighbours, which the pixels of fields are not
    double dssim = windows ? set->dssim : 0, contrast = windows ? set->contrast : 0;
    weight[LOSS_L1] = set->rgb_weight * fmax(1 - dssim - contrast, 0); // both are shares of the photo term
    weight[LOSS_DSSIM] = set->rgb_weight * dssim;
    weight[LOSS_CONTRAST] = set->rgb_weight * contrast;
}
