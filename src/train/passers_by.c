// Who walks by is seen by one photo at a place, and by none of the others there: what the scenes have learned by then
// does not explain them. So the last steps before the photos get their full size look at what each photo has beyond its
// render; where that hangs together, is large and stands out, it is left out of that photo from then on, and what the
// others show there takes its place. Where a scene is merely not learned yet, little is lost by it: it is left out of
// single photos.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "train/region.h"
#include "train/train_constants.h"
#include "train/trainer.h"

// In few steps much else is not explained either.
static bool can_look(const Trainer *trainer)
{
    return trainer->set->steps >= PASSERS_STEPS && fs_schedule_halvings(trainer->set, trainer->long_edge, 0) > 0;
}

void fs_passers_by_announce(const Trainer *trainer)
{
    if (trainer->set->passers_by && !can_look(trainer))
        fs_log_info(&trainer->project->log,
                    "train: does not look for who walks by: that wants %d steps, and photos that begin smaller "
                    "(--levels)",
                    PASSERS_STEPS);
}

int fs_passers_by_watch(Trainer *trainer, StepArgs *args, FsError *err)
{
    const Settings *set = trainer->set;
    int soon = trainer->step + PASSERS_VISITS * trainer->n_views;
    bool early = trainer->step < set->steps / 4;
    if (!set->passers_by || !can_look(trainer) || trainer->halvings == 0 || early) return 0;
    if (fs_schedule_halvings(set, trainer->long_edge, soon) > 0) return 0;
    if (!trainer->residual) trainer->residual = calloc((size_t)trainer->n_views, 3 * sizeof(float) * OCCLUSION_CELLS);
    if (!trainer->residual) return fs_error_memory(err);
    args->residual = trainer->residual + 3 * (size_t)OCCLUSION_CELLS * (size_t)args->view;
    return 0;
}

// The largest channel of a cell's residual, on average with its neighbours, where noise and edges cancel.
static float unexplained(const float *residual, int x, int y)
{
    float most = 0;
    for (int c = 0; c < 3; c++) {
        float sum = 0;
        for (int j = y - 1; j <= y + 1; j++)
            for (int i = x - 1; i <= x + 1; i++) {
                int u = i < 0 ? 0 : i < OCCLUSION_WIDTH ? i : OCCLUSION_WIDTH - 1;
                int v = j < 0 ? 0 : j < OCCLUSION_HEIGHT ? j : OCCLUSION_HEIGHT - 1;
                sum += residual[3 * (v * OCCLUSION_WIDTH + u) + c] / 9;
            }
        most = fmaxf(most, fabsf(sum));
    }
    return most;
}

// The cells of a photo that are left out; how many they are.
static int decide(const float *residual, Region *region, unsigned char *passers)
{
    static const RegionRule rule = {PASSERS_OUTLINE, PASSERS_STANDS_OUT, PASSERS_GAP, PASSERS_LEAST, false};
    float cells[OCCLUSION_CELLS];
    int n = 0;
    for (int i = 0; i < OCCLUSION_CELLS; i++)
        cells[i] = unexplained(residual, i % OCCLUSION_WIDTH, i / OCCLUSION_WIDTH);
    region->width = OCCLUSION_WIDTH;
    region->height = OCCLUSION_HEIGHT;
    fs_region_find(region, cells, &rule);
    fs_region_spread(region, 1, PASSERS_NEAR);
    for (int i = 0; i < OCCLUSION_CELLS; i++) n += region->in[i];
    if (n > PASSERS_MOST * OCCLUSION_CELLS) n = 0;
    for (int i = 0; i < OCCLUSION_CELLS; i++) passers[i] = n ? region->in[i] : 0;
    return n;
}

// Of photos without the flash (with it, where there are no others), since the flash's own mirror image is in all that
// it lit. What nearly all of them have is no passer-by, but something of the scenes that is not as it should be just
// then.
static bool nearly_all(const Trainer *trainer, const int found[2])
{
    int n[2] = {0, 0};
    for (int v = 0; v < trainer->n_views; v++) n[trainer->views[v]->flash]++;
    int kind = n[0] == 0;
    return found[kind] > PASSERS_PHOTOS * n[kind];
}

int fs_passers_by_find(Trainer *trainer, FsError *err)
{
    if (!trainer->residual) return 0;
    Region *region = malloc(sizeof *region);
    int found[2] = {0, 0}, most = 0;
    trainer->passers = calloc((size_t)trainer->n_views, OCCLUSION_CELLS);
    if (!region || !trainer->passers) {
        free(region);
        return fs_error_memory(err);
    }
    for (int v = 0; v < trainer->n_views; v++) {
        size_t at = (size_t)OCCLUSION_CELLS * (size_t)v;
        int n = decide(trainer->residual + 3 * at, region, trainer->passers + at);
        found[trainer->views[v]->flash] += n > 0;
        most = n > most ? n : most;
    }
    free(region);
    free(trainer->residual);
    trainer->residual = NULL;
    bool none = nearly_all(trainer, found);
    if (none) memset(trainer->passers, 0, (size_t)trainer->n_views * OCCLUSION_CELLS);
    if (!none && found[0] + found[1])
        fs_log_info(&trainer->project->log,
                    "train: leaves out of %d photos what the others do not show, %.1f %% of one at most",
                    found[0] + found[1], 100.0 * most / OCCLUSION_CELLS);
    return 0;
}

// A pixel that is not to be trusted has no say where it is black (kernels/pixelwise.h: clipped).
void fs_passers_by_mask(const Trainer *trainer, int view, Image *photo, Image *mask)
{
    if (!trainer->passers) return;
    const unsigned char *out = trainer->passers + (size_t)OCCLUSION_CELLS * (size_t)view;
    for (int y = 0; y < photo->height; y++)
        for (int x = 0; x < photo->width; x++) {
            int row = y * OCCLUSION_HEIGHT / photo->height, column = x * OCCLUSION_WIDTH / photo->width;
            if (!out[row * OCCLUSION_WIDTH + column]) continue;
            memset(photo->px + 3 * ((size_t)y * (size_t)photo->width + (size_t)x), 0, 3 * sizeof(float));
            mask->px[(size_t)y * (size_t)photo->width + (size_t)x] = 0;
        }
}
