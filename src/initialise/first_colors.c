// The flash's difference gives the transmitted scene, T_N = (I_F - I_N) / alpha, where I_F and I_N are averages over
// the photos of each lighting at a seed's place: what lies at another depth moves under it and averages out. That
// alpha may be of another place, where there was texture to measure it by; but as the mirrored scene only adds light,
// T_N is no brighter than the darkest photos without the flash, and mostly not much darker. Then the two scenes are
// freed from each other in turns: each scene's seeds, drawn into every photo, are taken off that photo, and what is
// left is averaged at the other scene's seeds. At last the gains are what T_F / T_N says.
#include "initialise/first_colors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/order.h"
#include "image/bilinear.h"
#include "image/fill.h"
#include "initialise/constants.h"

// One scene drawn into one photo: colour and inverse depth, (height, width, 4).
typedef struct Drawn {
    int width, height, pixel; // a pixel here is `pixel` pixels of the photo, a side
    float *px;
} Drawn;

// Seeds, and the order in which they are averaged (n).
typedef struct Ordered {
    const Seeds *seeds;
    const Ranked *order;
} Ordered;

typedef struct ColorWork {
    const SmallViews *views;
    Ordered of;               // what is drawn or averaged
    const float *color[2];    // (n, 3) without, with flash
    Drawn *drawn;             // (views->n) being drawn
    const Drawn *own, *other; // of the scene being averaged (for what hides what) and the one to take off; may be NULL
    float *sum[2];            // (n, 3) results: means over the photos without, with flash; NAN where not seen
    bool failed;              // a job ran out of memory
} ColorWork;

static bool place(const Camera *camera, const float xyz[3], double pixel[2], float *inverse)
{
    double p[3] = {xyz[0], xyz[1], xyz[2]}, z = fs_camera_sees(camera, p, pixel);
    if (z > 0) *inverse = (float)(1 / z);
    return z > 0;
}

static void draw_job(void *context, int job, int worker)
{
    (void)worker;
    ColorWork *p = context;
    const SmallView *view = &p->views->view[job];
    Drawn *out = &p->drawn[job];
    const float *color = p->color[view->flash];
    size_t n = (size_t)out->width * (size_t)out->height;
    float *weight = calloc(n, sizeof(float)), *nearest = calloc(n, sizeof(float)), inverse;
    double pixel[2];
    bool any = false;
    bool failed = !weight || !nearest;
    if (failed) goto done;
    memset(out->px, 0, sizeof(float) * 4 * n);
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < p->of.seeds->n; i++) {
            if (!place(&view->camera, p->of.seeds->xyz + 3 * (size_t)i, pixel, &inverse)) continue;
            size_t x = (size_t)(pixel[0] / out->pixel), y = (size_t)(pixel[1] / out->pixel),
                   at = y * (size_t)out->width + x;
            if (pass == 0) {
                nearest[at] = fmaxf(nearest[at], inverse);
                continue;
            }
            if (inverse < (1 - SURFACE_SAME) * nearest[at]) continue;
            for (int c = 0; c < 3; c++) out->px[4 * at + (size_t)c] += color[3 * (size_t)i + (size_t)c];
            out->px[4 * at + 3] += inverse;
            weight[at] += 1;
        }
    failed = fs_fill_holes(out->px, weight, out->width, out->height, 4, &any, NULL) < 0;
done:
    if (failed) __atomic_store_n(&p->failed, true, __ATOMIC_RELAXED);
    free(weight);
    free(nearest);
}

// Bilinear; pixel in the photo's pixels.
static void sample_drawn(const Drawn *drawn, const double pixel[2], float out[4])
{
    double x = fmin(fmax(pixel[0] / drawn->pixel - 0.5, 0), drawn->width - 1);
    double y = fmin(fmax(pixel[1] / drawn->pixel - 0.5, 0), drawn->height - 1);
    Bilinear place = fs_bilinear_at(x, y, drawn->width, drawn->height);
    for (int c = 0; c < 4; c++) out[c] = fs_bilinear_value(&place, drawn->px, 4, c);
}

enum { CHUNK = 512 }; // seeds that are looked up in one photo after the other: its pixels stay at hand
#define STRIPS 20.0f  // of one focal length

// Strip by strip of what the photos look at together, so that seeds of a chunk are seen beside one another by whichever
// photo; those that are not before the photos come first. The arena has failed where there is no order.
static Ordered order_of(const SmallViews *views, const Seeds *seeds, Arena *arena)
{
    Ranked *order = ARENA_NEW(arena, Ranked, (size_t)seeds->n + 1);
    for (int i = 0; order && i < seeds->n; i++) {
        float place[3] = {0};
        bool before = fs_small_views_direction(views, seeds->xyz + 3 * (size_t)i, place);
        order[i] = (Ranked){before ? floor((double)(STRIPS * place[1])) * 1e4 + (double)place[0] : -1e30, i};
    }
    if (order) fs_order_ranked(order, (size_t)seeds->n);
    return (Ordered){seeds, order};
}

static void average_job(void *context, int job, int worker)
{
    (void)worker;
    const ColorWork *p = context;
    const int first = job * CHUNK, count = p->of.seeds->n - first < CHUNK ? p->of.seeds->n - first : CHUNK;
    const Ranked *seed = p->of.order + first;
    float sum[2][CHUNK][3] = {{{0}}}, n[2][CHUNK] = {{0}};
    for (int f = 0; f < p->views->n; f++) {
        const SmallView *view = &p->views->view[f];
        for (int i = 0; i < count; i++) {
            float rgb[3], other[4] = {0}, own[4], inverse, w = 1;
            double pixel[2];
            if (!place(&view->camera, p->of.seeds->xyz + 3 * (size_t)seed[i].index, pixel, &inverse)) continue;
            if (!fs_small_views_sample(view, pixel[0], pixel[1], rgb)) continue;
            if (p->own) {
                sample_drawn(&p->own[f], pixel, own);
                if (inverse < COLORS_HIDDEN * own[3]) w = COLORS_HIDDEN_WEIGHT;
            }
            if (p->other) sample_drawn(&p->other[f], pixel, other);
            for (int c = 0; c < 3; c++) sum[view->flash][i][c] += w * (rgb[c] - other[c]);
            n[view->flash][i] += w;
        }
    }
    for (int g = 0; g < 2; g++)
        for (int i = 0; i < count; i++)
            for (int c = 0; c < 3; c++)
                p->sum[g][3 * (size_t)seed[i].index + (size_t)c] = n[g][i] > 0 ? sum[g][i][c] / n[g][i] : NAN;
}

static int draw(ColorWork *p, const Seeds *seeds, const float *without, const float *with, Drawn *drawn,
                Threads *threads, FsError *err)
{
    p->of.seeds = seeds;
    p->color[0] = without;
    p->color[1] = with;
    p->drawn = drawn;
    fs_threads_for(threads, p->views->n, draw_job, p);
    return p->failed ? fs_error_memory(err) : 0;
}

static void average(ColorWork *p, Ordered of, const Drawn *own, const Drawn *other, float *without, float *with,
                    Threads *threads)
{
    p->of = of;
    p->own = own;
    p->other = other;
    p->sum[0] = without;
    p->sum[1] = with;
    fs_threads_for(threads, (of.seeds->n + CHUNK - 1) / CHUNK, average_job, p);
}

// ---- how bright the photos let the transmitted scene be ----

enum { LEAST_MOST = 32 }; // photos of which the darkest are kept

typedef struct Least {
    float factor[LEAST_MOST]; // growing
    int n;                    // photos looked at
} Least;

static void keep_least(Least *least, float factor)
{
    int k = least->n < LEAST_MOST ? least->n : LEAST_MOST - 1;
    if (least->n++ >= LEAST_MOST && least->factor[k] <= factor) return;
    for (; k > 0 && least->factor[k - 1] > factor; k--) least->factor[k] = least->factor[k - 1];
    least->factor[k] = factor;
}

// Of the transmitted seeds: the factor by which color[0] becomes as bright as the darkest photos without the flash, but
// for a share of them, in the channel where there is least room. 1 where none sees it.
static void room_job(void *context, int job, int worker)
{
    (void)worker;
    const ColorWork *p = context;
    const int first = job * CHUNK, count = p->of.seeds->n - first < CHUNK ? p->of.seeds->n - first : CHUNK;
    const Ranked *seed = p->of.order + first;
    Least least[CHUNK];
    for (int i = 0; i < count; i++) least[i].n = 0;
    for (int f = 0; f < p->views->n; f++) {
        const SmallView *view = &p->views->view[f];
        for (int i = 0; i < count && !view->flash; i++) {
            const float *color = p->color[0] + 3 * (size_t)seed[i].index;
            float rgb[3], own[4], inverse, factor = INFINITY;
            double pixel[2];
            if (!place(&view->camera, p->of.seeds->xyz + 3 * (size_t)seed[i].index, pixel, &inverse)) continue;
            if (!fs_small_views_sample(view, pixel[0], pixel[1], rgb)) continue;
            sample_drawn(&p->own[f], pixel, own);
            if (inverse < COLORS_HIDDEN * own[3]) continue;
            for (int c = 0; c < 3; c++) factor = fminf(factor, rgb[c] / fmaxf(color[c], COLORS_BLACK));
            keep_least(&least[i], factor);
        }
    }
    for (int i = 0; i < count; i++) {
        int rank = (int)(COLORS_DARK_PHOTOS * (float)least[i].n);
        rank = rank < LEAST_MOST ? rank : LEAST_MOST - 1;
        p->sum[0][seed[i].index] = least[i].n ? least[i].factor[rank] : 1;
    }
}

static float either(float a, float b, float otherwise)
{
    return isfinite(a) ? a : isfinite(b) ? b : otherwise;
}

static float clamp_share(float x, float whole)
{
    whole = fmaxf(whole, 1e-4f);
    return fminf(fmaxf(x, COLORS_DARKEST * whole), whole);
}

static void first_split(int n, const float *alpha, const float *I_N, const float *I_F, float *T_N, float *T_F)
{
    for (size_t i = 0; i < 3 * (size_t)n; i++) {
        float a = alpha[i], w = a * a / (a * a + COLORS_ALPHA_NOISE * COLORS_ALPHA_NOISE);
        float t = w * fmaxf(I_F[i] - I_N[i], 0) / fmaxf(a, 1e-3f) + (1 - w) * COLORS_USUAL_SHARE * I_N[i];
        T_N[i] = clamp_share(t, I_N[i]);
        T_F[i] = clamp_share(T_N[i] * (1 + a), I_F[i]);
    }
}

static Drawn *drawn_new(const SmallViews *views, int n_seeds, Arena *arena)
{
    Drawn *drawn = ARENA_NEW(arena, Drawn, (size_t)views->n + 1);
    for (int i = 0; i < views->n && drawn; i++) {
        const Camera *camera = &views->view[i].camera;
        Drawn *d = &drawn[i];
        d->pixel = n_seeds > COLORS_ENOUGH_SEEDS * (float)camera->width * (float)camera->height ? 1 : 2;
        d->width = (camera->width + d->pixel - 1) / d->pixel;
        d->height = (camera->height + d->pixel - 1) / d->pixel;
        d->px = ARENA_NEW(arena, float, 4 * (size_t)d->width * (size_t)d->height);
    }
    return drawn;
}

// T_N no brighter than the photos let it be, and not much darker. T: T_N and T_F drawn.
static void use_room(ColorWork *p, Ordered of, const Drawn *T, const float *I_N, float *T_N, float *room,
                     Threads *threads)
{
    p->of = of;
    p->own = T;
    p->color[0] = T_N;
    p->sum[0] = room;
    fs_threads_for(threads, (of.seeds->n + CHUNK - 1) / CHUNK, room_job, p);
    for (size_t i = 0; i < 3 * (size_t)of.seeds->n; i++) {
        float factor = fminf(fmaxf(room[i / 3], 1 / COLORS_ROOM_MOST), COLORS_ROOM_MOST);
        T_N[i] = clamp_share(T_N[i] * fminf(factor, fmaxf(1, COLORS_ROOM_TAKEN * factor)), I_N[i]);
    }
}

// Gains that agree with T_N and T_F, where these are not far from what was measured.
static void fit_gains(ColoredSeeds *seeds)
{
    for (size_t i = 0; i < (size_t)seeds->T.n; i++) {
        const float *N = seeds->T_N + 3 * i, *F = seeds->T_F + 3 * i, *alpha = seeds->alpha + 3 * i;
        float added = 0, meant = 0;
        for (int c = 0; c < 3; c++) {
            added += fmaxf(F[c] - N[c], 0);
            meant += N[c] * alpha[c];
        }
        if (meant > 0)
            seeds->gain[i] +=
                fminf(fmaxf(logf(fmaxf(added, COLORS_BLACK) / meant), -COLORS_GAIN_MOST), COLORS_GAIN_MOST);
    }
}

typedef struct Buffers {
    Drawn *T, *R;
    Ordered of_T, of_R;
    float *I_N, *I_F, *J_N, *J_F, *left_N, *left_F; // photos at T's seeds, at R's seeds, what is left
} Buffers;

static int buffers_new(Buffers *b, const SmallViews *views, const Seeds *T, const Seeds *R, Arena *arena, FsError *err)
{
    size_t n = (size_t)(T->n > R->n ? T->n : R->n) + 1;
    float **const field[] = {&b->I_N, &b->I_F, &b->J_N, &b->J_F, &b->left_N, &b->left_F};
    for (size_t i = 0; i < sizeof field / sizeof *field; i++) *field[i] = ARENA_NEW(arena, float, 3 * n);
    b->T = drawn_new(views, T->n, arena);
    b->R = drawn_new(views, R->n, arena);
    b->of_T = order_of(views, T, arena);
    b->of_R = order_of(views, R, arena);
    return arena->failed ? fs_error_memory(err) : 0;
}

int fs_first_colors_find(const SmallViews *views, ColoredSeeds *seeds, Threads *threads, FsError *err)
{
    const Seeds *T = &seeds->T, *R = &seeds->R;
    const float *alpha = seeds->alpha;
    float *T_N = seeds->T_N, *T_F = seeds->T_F, *R_color = seeds->R_color;
    int rc = 0;
    Arena arena = {0};
    Buffers b;
    ColorWork p = {.views = views};
    TRY(buffers_new(&b, views, T, R, &arena, err));
    average(&p, b.of_T, NULL, NULL, b.I_N, b.I_F, threads);
    average(&p, b.of_R, NULL, NULL, b.J_N, b.J_F, threads);
    for (size_t i = 0; i < 3 * (size_t)T->n; i++) {
        b.I_N[i] = fmaxf(either(b.I_N[i], b.I_F[i] / (1 + alpha[i]), COLORS_UNSEEN), 0);
        b.I_F[i] = fmaxf(either(b.I_F[i], b.I_N[i], COLORS_UNSEEN), 0);
    }
    first_split(T->n, alpha, b.I_N, b.I_F, T_N, T_F);
    TRY(draw(&p, T, T_N, T_F, b.T, threads, err));
    use_room(&p, b.of_T, b.T, b.I_N, T_N, b.left_N, threads);
    for (int turn = 0; turn < COLORS_TURNS; turn++) {
        TRY(draw(&p, T, T_N, T_F, b.T, threads, err));
        average(&p, b.of_R, turn ? b.R : NULL, b.T, b.left_N, b.left_F, threads);
        for (size_t i = 0; i < 3 * (size_t)R->n; i++) {
            float whole = either(b.J_N[i], b.J_F[i], COLORS_UNSEEN),
                  left = either(b.left_N[i], b.left_F[i], COLORS_UNSEEN_LEFT * whole);
            if (isfinite(b.left_N[i]) && isfinite(b.left_F[i])) left = 0.5f * (b.left_N[i] + b.left_F[i]);
            R_color[i] = clamp_share(left, whole);
        }
        if (turn == COLORS_TURNS - 1) break;
        TRY(draw(&p, R, R_color, R_color, b.R, threads, err));
        average(&p, b.of_T, b.T, b.R, b.left_N, b.left_F, threads);
        for (size_t i = 0; i < 3 * (size_t)T->n; i++) {
            if (isfinite(b.left_N[i])) T_N[i] = clamp_share(b.left_N[i], b.I_N[i]);
            if (isfinite(b.left_F[i])) T_F[i] = clamp_share(b.left_F[i], b.I_F[i]);
        }
    }
    fit_gains(seeds);
fail:
    fs_arena_free(&arena);
    return rc;
}

int fs_first_colors_of_photos(const SmallViews *views, ColoredSeeds *seeds, Threads *threads, FsError *err)
{
    size_t most = 3 * (size_t)(seeds->T.n > seeds->R.n ? seeds->T.n : seeds->R.n) + 1;
    float *without = malloc(sizeof(float) * most), *with = malloc(sizeof(float) * most);
    ColorWork p = {.views = views};
    Arena arena = {0};
    int rc = without && with ? 0 : fs_error_memory(err);
    for (int k = 0; k < 2 && rc == 0; k++) {
        const Seeds *own = k ? &seeds->R : &seeds->T;
        const Ordered of = order_of(views, own, &arena);
        if (arena.failed) TRY(fs_error_memory(err));
        average(&p, of, NULL, NULL, without, with, threads);
        for (size_t i = 0; i < 3 * (size_t)own->n; i++) {
            bool both = isfinite(without[i]) && isfinite(with[i]);
            float color = both ? 0.5f * (without[i] + with[i]) : either(without[i], with[i], COLORS_UNSEEN);
            if (k)
                seeds->R_color[i] = fmaxf(color, 0);
            else
                seeds->T_N[i] = seeds->T_F[i] = fmaxf(color, 0);
        }
    }
fail:
    fs_arena_free(&arena);
    free(without);
    free(with);
    return rc;
}

static void subtract(const Drawn *drawn, Image *photo)
{
    for (int y = 0; y < photo->height; y++)
        for (int x = 0; x < photo->width; x++) {
            float *p = photo->px + 3 * ((size_t)y * (size_t)photo->width + (size_t)x), layer[4];
            double pixel[2] = {x + 0.5, y + 0.5};
            sample_drawn(drawn, pixel, layer);
            for (int c = 0; c < 3; c++) p[c] -= layer[c];
        }
}

int fs_first_colors_subtract(const SmallViews *views, const Seeds *seeds, const float *without, const float *with,
                             SmallViews *residual, Threads *threads, FsError *err)
{
    int rc = 0;
    Arena arena = {0};
    Drawn *drawn = drawn_new(views, seeds->n, &arena);
    ColorWork p = {.views = views};
    *residual = *views;
    residual->view = calloc((size_t)views->n + 1, sizeof *residual->view);
    if (!residual->view) residual->n = 0;
    if (!residual->view || arena.failed) TRY(fs_error_memory(err));
    for (int i = 0; i < views->n; i++) {
        residual->view[i] = views->view[i];
        residual->view[i].photo = (Image){0};
        residual->view[i].clipped = NULL;
    }
    for (int i = 0; i < views->n; i++) TRY(fs_image_copy(&residual->view[i].photo, &views->view[i].photo, err));
    TRY(draw(&p, seeds, without, with, drawn, threads, err));
    for (int i = 0; i < views->n; i++) subtract(&drawn[i], &residual->view[i].photo);
fail:
    fs_arena_free(&arena);
    if (rc < 0) fs_small_views_free(residual);
    return rc;
}
