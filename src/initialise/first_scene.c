#include "initialise/first_scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/tone.h"

// Opacity and, in distances to the neighbours, size at the start: ours, and the paper's (separate geometry). Faint
// blobs that hide each other hold the start up.
typedef struct Look {
    float opacity, size;
} Look;
static const Look our_look = {0.5f, 0.6f}, paper_look = {0.1f, 1};

#define GLASS 0.08       // reflectance of a clean pane, both surfaces
#define BRIGHT_SCENE 0.8 // the mirrored room's own light at its bright places: fixes the pane's reflectance
#define BRIGHT_SHARE 0.95
#define F0_MIN 0.04
#define F0_MAX 0.5
#define RETURN 0.2 // of the flash comes back by the mirrored room

static int cloud_from_seeds(const Seeds *seeds, const float *linear, const float *gain, Look look, Cloud *cloud,
                            FsError *err)
{
    int rc = fs_cloud_new(cloud, seeds->n, linear ? 3 : 1, gain ? 1 : 0, err);
    if (rc < 0) return rc;
    memcpy(cloud->field[CLOUD_MEANS], seeds->xyz, sizeof(float) * 3 * (size_t)seeds->n);
    for (int i = 0; i < seeds->n; i++) {
        for (int k = 0; k < 3; k++)
            cloud->field[CLOUD_SCALES][3 * (size_t)i + (size_t)k] = logf(look.size * seeds->scale[i]);
        cloud->field[CLOUD_QUATS][4 * (size_t)i] = 1;
        cloud->field[CLOUD_OPACITIES][i] = logf(look.opacity / (1 - look.opacity));
        for (int k = 0; k < 3 && linear; k++)
            cloud->field[CLOUD_COLORS][3 * (size_t)i + (size_t)k] = fs_tone_encode(linear[3 * (size_t)i + (size_t)k]);
        if (gain) cloud->field[CLOUD_GAINS][i] = gain[i];
    }
    return 0;
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// The reflectance at which the mirrored room would be about as bright as a well exposed photo.
static int guess_f0(const float *R, int n, double *f0, FsError *err)
{
    float *green = malloc(sizeof *green * ((size_t)n + 1));
    if (!green) return fs_error_memory(err);
    for (int i = 0; i < n; i++) green[i] = R[3 * (size_t)i + 1];
    qsort(green, (size_t)n, sizeof *green, compare_floats);
    *f0 = n ? fmin(fmax((double)green[(int)(BRIGHT_SHARE * (n - 1))] / BRIGHT_SCENE, F0_MIN), F0_MAX) : F0_MIN;
    free(green);
    return 0;
}

// Reflectance of the pane towards a point, seen from the middle of the cameras.
static double reflectance(const Frames *frames, const Pane *pane, const float xyz[3])
{
    double d[3], n2 = 0, dot = 0;
    for (int k = 0; k < 3; k++) {
        d[k] = xyz[k] - frames->centre[k];
        n2 += d[k] * d[k];
        dot += d[k] * pane->normal[k];
    }
    double c = n2 > 0 ? fmin(fabs(dot) / sqrt(n2), 1) : 1;
    return fs_pane_beta(pane, c);
}

static int fill_scene(const Frames *frames, ColoredSeeds *p, Scene *scene, FsError *err)
{
    int rc = 0;
    TRY(guess_f0(p->R_color, p->R.n, &scene->pane.f0, err));
    scene->pane.dimming = GLASS;
    for (int i = 0; i < p->R.n; i++) { // beta * R in the photos -> R, the room's own light
        double beta = scene->pane_beta ? reflectance(frames, &scene->pane, p->R.xyz + 3 * (size_t)i) : 0.5;
        for (int k = 0; k < 3; k++) p->R_color[3 * (size_t)i + (size_t)k] /= (float)beta;
    }
    bool shared = scene->shared_geometry;
    Look look = shared ? our_look : paper_look;
    TRY(cloud_from_seeds(&p->T, p->T_N, shared ? p->gain : NULL, look, &scene->cloud[LAYER_T_N], err));
    if (!shared) TRY(cloud_from_seeds(&p->T, p->T_F, NULL, look, &scene->cloud[LAYER_T_F], err));
    TRY(cloud_from_seeds(&p->R, p->R_color, NULL, look, &scene->cloud[LAYER_R], err));
    if (!scene->pane_beta)
        TRY(cloud_from_seeds(&p->T, NULL, NULL, look, &scene->cloud[LAYER_BETA], err)); // logit 0: 0.5
fail:
    return rc;
}

// Labels by turns, for starts that do without the flash's cues.
static int deal_points(const Material *points, unsigned char **kind, FsError *err)
{
    *kind = malloc((size_t)points->n + 1);
    if (!*kind) return fs_error_memory(err);
    for (int i = 0; i < points->n; i++) (*kind)[i] = i % 2 ? POINT_REFLECTED : POINT_TRANSMITTED;
    return 0;
}

int fs_first_scene_make(const Frames *frames, const Material *points, const FlashLight *light, const Settings *set,
                        Threads *threads, Scene *scene, FsError *err)
{
    int rc = 0;
    ColoredSeeds painted = {0};
    unsigned char *dealt = NULL;
    Material dealt_points;
    const DensePoints none = {0};
    *scene = (Scene){.shared_geometry = strcmp(set->geometry, "shared") == 0,
                     .pane_beta = strcmp(set->beta, "pane") == 0,
                     .separation = fs_scene_separation(set->separation)};
    scene->extent = 1.1 * frames->extent;
    scene->flash_distance = light->distance;
    scene->flash_return = fs_scene_lit(scene) ? RETURN : 0;
    for (int k = 0; k < 3; k++) {
        scene->pane.normal[k] = frames->forward[k];
        scene->gain_color[k] = light->color[k];
    }
    if (scene->separation != SEPARATION_FULL && !(scene->shared_geometry && scene->pane_beta)) {
        rc = fs_error_set(err, FS_ERR_USAGE, "--separation %s goes with --geometry shared and --beta pane",
                          set->separation);
        goto fail;
    }
    if (scene->separation == SEPARATION_FLASHLESS || scene->separation == SEPARATION_NONE) {
        TRY(deal_points(points, &dealt, err)); // no cue: both scenes begin at all places
        dealt_points = *points;
        dealt_points.kind = dealt;
        dealt_points.dense[0] = dealt_points.dense[1] = &none;
        points = &dealt_points;
    }
    TRY(fs_colored_seeds_make(frames, points, light, set->init_count, (uint64_t)set->seed, threads, &painted, err));
    TRY(fill_scene(frames, &painted, scene, err));
    Cloud *T = &scene->cloud[LAYER_T_N];
    if (scene->separation != SEPARATION_FULL) memset(T->field[CLOUD_GAINS], 0, sizeof(float) * (size_t)T->n);
    if (scene->separation == SEPARATION_NONE) {
        fs_cloud_free(&scene->cloud[LAYER_R]);
        scene->pane.f0 = scene->pane.dimming = 0;
    }
fail:
    fs_colored_seeds_free(&painted);
    free(dealt);
    if (rc < 0) fs_scene_free(scene);
    return rc;
}
