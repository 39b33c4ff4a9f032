#include "initialise/start.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/order.h"
#include "image/tone.h"
#include "initialise/constants.h"
#include "initialise/outliers.h"
#include "initialise/rear.h"

typedef struct Blob {
    float opacity, size;
} Blob;
static const Blob our_blob = {BLOB_OPACITY, BLOB_SIZE}, paper_blob = {BLOB_PAPER_OPACITY, BLOB_PAPER_SIZE};

static int cloud_from_seeds(const Seeds *seeds, const float *linear, const float *gain, Blob blob, Cloud *cloud,
                            FsError *err)
{
    int rc = fs_cloud_new(cloud, seeds->n, linear ? 3 : 1, gain ? 1 : 0, err);
    if (rc < 0) return rc;
    memcpy(cloud->field[CLOUD_MEANS], seeds->xyz, sizeof(float) * 3 * (size_t)seeds->n);
    for (int i = 0; i < seeds->n; i++) {
        for (int k = 0; k < 3; k++)
            cloud->field[CLOUD_SCALES][3 * (size_t)i + (size_t)k] = logf(blob.size * seeds->scale[i]);
        cloud->field[CLOUD_QUATS][4 * (size_t)i] = 1;
        cloud->field[CLOUD_OPACITIES][i] = logf(blob.opacity / (1 - blob.opacity));
        for (int k = 0; k < 3 && linear; k++)
            cloud->field[CLOUD_COLORS][3 * (size_t)i + (size_t)k] = fs_tone_encode(linear[3 * (size_t)i + (size_t)k]);
        if (gain) cloud->field[CLOUD_GAINS][i] = gain[i];
    }
    return 0;
}

// The reflectance at which the mirrored room would be about as bright as a well exposed photo.
static int guess_f0(const float *R, int n, double *f0, FsError *err)
{
    float *green = malloc(sizeof *green * ((size_t)n + 1));
    if (!green) return fs_error_memory(err);
    for (int i = 0; i < n; i++) green[i] = R[3 * (size_t)i + 1];
    fs_order_floats(green, (size_t)n);
    *f0 =
        n ? fmin(fmax((double)green[(int)(PANE_BRIGHT_SHARE * (n - 1))] / PANE_BRIGHT_SCENE, PANE_F0_MIN), PANE_F0_MAX)
          : PANE_F0_MIN;
    free(green);
    return 0;
}

static int fill_scene(const SmallViews *views, ColoredSeeds *p, bool ours, Scene *scene, FsError *err)
{
    int rc = 0;
    TRY(guess_f0(p->R_color, p->R.n, &scene->pane.f0, err));
    scene->pane.dimming = PANE_GLASS;
    for (int i = 0; i < p->R.n; i++) { // beta * R in the photos -> R, the room's own light; not the paper's
        double beta = ours ? 0.5 : 1;
        if (scene->pane_beta) beta = fs_pane_beta_towards(&scene->pane, views->centre, p->R.xyz + 3 * (size_t)i);
        for (int k = 0; k < 3; k++) p->R_color[3 * (size_t)i + (size_t)k] /= (float)beta;
    }
    bool shared = scene->shared_geometry;
    Blob blob = ours ? our_blob : paper_blob;
    TRY(cloud_from_seeds(&p->T, p->T_N, shared ? p->gain : NULL, blob, &scene->cloud[LAYER_T_N], err));
    if (!shared) TRY(cloud_from_seeds(&p->T, p->T_F, NULL, blob, &scene->cloud[LAYER_T_F], err));
    TRY(cloud_from_seeds(&p->R, p->R_color, NULL, blob, &scene->cloud[LAYER_R], err));
    if (!scene->pane_beta)
        TRY(cloud_from_seeds(&p->T, NULL, NULL, blob, &scene->cloud[LAYER_BETA], err)); // logit 0: 0.5
fail:
    return rc;
}

// Labels by turns, for starts that do without the flash's cues.
static int deal_points(const SparsePoints *points, unsigned char **kind, FsError *err)
{
    *kind = malloc((size_t)points->n + 1);
    if (!*kind) return fs_error_memory(err);
    for (int i = 0; i < points->n; i++) (*kind)[i] = i % 2 ? POINT_REFLECTED : POINT_TRANSMITTED;
    return 0;
}

// Leaves out the mirrored seeds that lie before the dense points of the transmitted scene.
static int drop_before(const Start *start, ColoredSeeds *p, FsError *err)
{
    Seeds *R = &p->R;
    unsigned char *before = malloc((size_t)R->n + 1);
    int rc = 0, kept = 0;
    if (!before) return fs_error_memory(err);
    TRY(fs_outliers_before(start->views, start->dense[0], R, start->threads, before, err));
    for (int i = 0; i < R->n; i++) {
        if (before[i]) continue;
        memmove(R->xyz + 3 * (size_t)kept, R->xyz + 3 * (size_t)i, sizeof(float) * 3);
        memmove(p->R_color + 3 * (size_t)kept, p->R_color + 3 * (size_t)i, sizeof(float) * 3);
        R->scale[kept++] = R->scale[i];
    }
    R->n = kept;
fail:
    free(before);
    return rc;
}

// Begins transmitted Gaussians on the scene's rear, too.
static int add_rear(const Start *start, ColoredSeeds *p, FsError *err)
{
    Rear rear;
    int rc = fs_rear_find(start->views, start->dense[0], start->seed, &rear, err);
    if (rc < 0 || !rear.n) return rc;
    return fs_rear_add(start->views, &rear, p, err);
}

static double mean_light(const float *color, int n)
{
    double sum = 0;
    for (int i = 0; i < 3 * n; i++) sum += (double)color[i];
    return n ? sum / (3.0 * n) : 0;
}

// Share of the photos without the flash that is clipped: mostly mirrored lamps.
static double share_clipped(const SmallViews *views)
{
    double clipped = 0, all = 0;
    for (int v = 0; v < views->n; v++) {
        const SmallView *view = &views->view[v];
        int n = view->camera.width * view->camera.height;
        for (int i = 0; i < n && !view->flash; i++) clipped += view->clipped[i];
        all += view->flash ? 0 : n;
    }
    return all > 0 ? clipped / all : 0;
}

// Also where the mirrored points look mirrored enough, but are few, and the first colours, and no lamps, leave them a
// small part of the light. Either alone is so of ordinary captures: smooth rooms have few points, dim ones little
// light.
static bool little_is_mirrored(const Start *start, const ColoredSeeds *p)
{
    int told = 0, mirrored = 0;
    if (share_clipped(start->views) > LITTLE_LAMPS) return false;
    double T = mean_light(p->T_N, p->T.n), R = mean_light(p->R_color, p->R.n);
    for (int i = 0; i < start->points->n; i++) {
        told += start->points->cue[i].ok;
        mirrored += start->points->cue[i].ok && start->points->kind[i] == POINT_REFLECTED;
    }
    bool little = mirrored < LITTLE_POINTS * told && R < LITTLE_LIGHT * (T + R);
    if (little)
        fs_log_info(start->log, "initialise: little is mirrored: %.1f %% of the points, %.0f %% of the light",
                    100.0 * mirrored / told, 100 * R / (T + R));
    return little;
}

int fs_first_scene_make(const Start *start, const Settings *set, Scene *scene, FsError *err)
{
    int rc = 0;
    Start dealt_start = *start;
    SparsePoints dealt_points = *start->points;
    ColoredSeeds colored = {0};
    unsigned char *dealt = NULL;
    const PointList none = {0};
    bool ours = strcmp(set->geometry, "shared") == 0; // else the paper's, or its ablations
    *scene = (Scene){.extent = 1.1 * start->views->extent,
                     .flash_distance = start->light->distance,
                     .rare = (double)start->odds->rare};
    fs_scene_set_kind(scene, set);
    scene->flash_return = fs_scene_lit(scene) && scene->pane_beta ? PANE_RETURN : 0;
    for (int k = 0; k < 3; k++) {
        scene->pane.normal[k] = start->views->forward[k];
        scene->gain_color[k] = start->light->color[k];
    }
    bool cue = strcmp(set->flash_cue, "none") != 0;
    if (!cue || scene->separation == SEPARATION_FLASHLESS || scene->separation == SEPARATION_NONE) {
        TRY(deal_points(start->points, &dealt, err)); // both scenes begin at all places
        dealt_points.kind = dealt;
        dealt_start.points = &dealt_points;
        dealt_start.dense[0] = dealt_start.dense[1] = &none;
    }
    TRY(fs_colored_seeds_make(&dealt_start, set->init_count, ours, &colored, err));
    if (ours) {
        TRY(drop_before(&dealt_start, &colored, err));
        TRY(add_rear(&dealt_start, &colored, err));
    }
    if (ours && !dealt && scene->rare <= 0 && little_is_mirrored(start, &colored)) scene->rare = CLASSIFY_RARE_STEP;
    TRY(fill_scene(start->views, &colored, ours, scene, err));
    Cloud *T = &scene->cloud[LAYER_T_N];
    if (scene->separation != SEPARATION_FULL) memset(T->field[CLOUD_GAINS], 0, sizeof(float) * (size_t)T->n);
    if (scene->separation == SEPARATION_NONE) {
        fs_cloud_free(&scene->cloud[LAYER_R]);
        scene->pane.f0 = scene->pane.dimming = 0;
    }
fail:
    fs_colored_seeds_free(&colored);
    free(dealt);
    if (rc < 0) fs_scene_free(scene);
    return rc;
}
