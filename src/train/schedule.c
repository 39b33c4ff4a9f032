// Everything that changes with the step, and when what is done between steps.
#include <math.h>
#include <string.h>

#include "train/train_constants.h"
#include "train/trainer.h"

// Those of the colours, the scales and, times the scene's extent, of the means are settings.
static const double rates[CLOUD_FIELDS] = {
    [CLOUD_QUATS] = RATE_QUATS,
    [CLOUD_OPACITIES] = RATE_OPACITIES,
    [CLOUD_GAINS] = RATE_GAINS,
};

static bool is_fsgs(const Settings *set)
{
    return strcmp(set->densify, "fsgs") == 0;
}

bool fs_schedule_relocates(const Settings *set, int step)
{
    int from = set->steps / 20 < RELOCATE_FROM ? set->steps / 20 : RELOCATE_FROM;
    return step >= from && step <= (int)(RELOCATE_UNTIL * set->steps) && step % RELOCATE_EVERY == 0;
}

bool fs_schedule_fsgs(int step)
{
    return step >= FSGS_FROM && step <= FSGS_UNTIL && step % FSGS_EVERY == 0;
}

int fs_schedule_halvings(const Settings *set, int long_edge, int step)
{
    double begin = COARSE_UNTIL * set->steps / (set->levels > 1 ? set->levels - 1 : 1);
    int halvings = set->levels - 1 - (int)((step + 1) / begin);
    while (halvings > 0 && long_edge >> halvings < COARSEST) halvings--;
    return halvings > 0 ? halvings : 0;
}

int fs_schedule_budget(const Settings *set, double pixels)
{
    return set->max_splats ? set->max_splats : (int)(SPLATS_PER_SIDE * sqrt(pixels));
}

void fs_schedule_stride(const Settings *set, int halvings, double pixels, int budget, int stride[2])
{
    double least = halvings ? 0 : set->pixels_per_splat * budget, all = least > 0 ? pixels / least : 1;
    stride[1] = all >= STRIDE ? STRIDE : 1; // rows first
    stride[0] = all >= STRIDE * STRIDE ? STRIDE : 1;
}

int fs_schedule_grown(const Settings *set, int budget, int n, int step)
{
    double rounds = (GROWN_BY * set->steps - step) / RELOCATE_EVERY + 1;
    double growth = n < budget ? pow((double)budget / n, 1 / fmax(rounds, 1)) : 1;
    return (int)(n * fmin(growth, GROWTH) + 0.5);
}

// step: steps done with this one.
static double means_rate(const Settings *set, const Scene *scene, int step)
{
    double t = (double)step / (is_fsgs(set) ? FSGS_MEANS_OVER : set->steps);
    return set->means_rate * scene->extent * pow(MEANS_FALL, t < 1 ? t : 1);
}

static double settle(const Settings *set, int step)
{
    double begin = (1 - set->settle) * set->steps;
    return step > begin ? pow(SETTLE_FALL, (step - begin) / (set->settle * set->steps)) : 1;
}

// Of radiance fields: rises from nothing, then falls (Mueller et al. 2022, section 4).
static double field_rate(const Settings *set, int step)
{
    double t = (double)step / set->steps;
    return RATE_FIELD * fmin(1, (step + 1.0) / FIELD_WARM_UP) *
           pow(FIELD_FALL, fmax(t - FIELD_FALLS_FROM, 0) / (1 - FIELD_FALLS_FROM));
}

unsigned fs_schedule_learns(const Settings *set, bool encoded)
{
    unsigned learn = 0;
    if (set->photo_light) learn |= LEARN_LIGHT;
    if (set->vignetting) learn |= LEARN_VIGNETTING;
    if (strcmp(set->response, "learned") == 0 || (strcmp(set->response, "auto") == 0 && encoded))
        learn |= LEARN_WHITE | LEARN_RESPONSE;
    return learn;
}

void fs_schedule_step(const Settings *set, const Scene *scene, int step, StepArgs *args)
{
    *args = (StepArgs){.step = step,
                       .slope_floor = set->slope_floor,
                       .statistics = strcmp(set->densify, "none") != 0,
                       .settle = settle(set, step + 1),
                       .seed = (uint64_t)set->seed};
    fs_loss_weights(set, scene, (double)step / set->steps, args->weight);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        args->rate[f] = rates[f] * (f == CLOUD_OPACITIES ? 1 : set->rate_scale) * settle(set, step + 1);
    args->rate[CLOUD_COLORS] = set->colors_rate * settle(set, step + 1);
    args->rate[CLOUD_SCALES] = set->scales_rate * settle(set, step + 1);
    args->rate[CLOUD_MEANS] = means_rate(set, scene, step + 1);
    if (scene->separation != SEPARATION_FULL) args->rate[CLOUD_GAINS] = 0;
    args->veil_rate = RATE_VEIL * settle(set, step + 1);
    args->veil_ambient = step >= VEIL_AMBIENT_FROM * set->steps;
    args->lamps_mirrored = scene->rare <= 0 && step < LAMPS_UNTIL * set->steps;
    args->field_rate = field_rate(set, step);
    bool two = scene->separation != SEPARATION_NONE;
    double coarse = (two ? FIELDS_COARSE : FIELD_COARSE) * set->steps;
    args->blind = two || step < FIELD_BLIND * set->steps;
    args->every = step < coarse ? 4 : step < 2 * coarse ? 2 : 1;
    for (int l = 0; l < LAYERS; l++) args->darkest[l] = l == LAYER_R ? set->darkest : set->darkest / 2;
    args->darkest[LAYER_BETA] = set->least_beta;
}
