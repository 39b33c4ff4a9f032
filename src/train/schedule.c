// Everything that changes with the step, and when what is done between steps.
#include <math.h>
#include <string.h>

#include "train/trainer.h"

// Learning rates of 3DGS per step; the setting rate-scale multiplies all but the opacities'. Means: the setting
// means-rate times the scene's extent.
static const double rates[CLOUD_FIELDS] = {
    [CLOUD_SCALES] = 5e-3,   [CLOUD_QUATS] = 1e-3, [CLOUD_OPACITIES] = 5e-2,
    [CLOUD_COLORS] = 2.5e-3, [CLOUD_GAINS] = 5e-3,
};

#define MEANS_FALL 0.01        // of the means' rate, over the run (3DGS)
#define SETTLE_FALL 0.1        // of the other rates, over the share `settle` of the steps
#define PAPER_MEANS_OVER 10000 // steps over which the means' rate falls in the paper's schedule
#define EXPLORE 5e5            // times the means' rate: size of the noise (3DGS-MCMC)
enum { RELOCATE_EVERY = 100, RELOCATE_FROM = 500, FSGS_FROM = 500, FSGS_UNTIL = 10000, FSGS_EVERY = 100 };
#define RELOCATE_UNTIL 0.85 // of the steps: what was moved last settles

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

// step: steps done with this one.
static double means_rate(const Settings *set, const Scene *scene, int step)
{
    double t = (double)step / (is_fsgs(set) ? PAPER_MEANS_OVER : set->steps);
    return set->means_rate * scene->extent * pow(MEANS_FALL, t < 1 ? t : 1);
}

static double settle(const Settings *set, int step)
{
    double begin = (1 - set->settle) * set->steps;
    return step > begin ? pow(SETTLE_FALL, (step - begin) / (set->settle * set->steps)) : 1;
}

void fs_schedule_step(const Settings *set, const Scene *scene, int step, StepArgs *args)
{
    *args = (StepArgs){
        .step = step, .slope_floor = set->slope_floor, .statistics = is_fsgs(set), .seed = (uint64_t)set->seed};
    fs_loss_weights(set, scene, (double)step / set->steps, args->weight);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        args->rate[f] = rates[f] * (f == CLOUD_OPACITIES ? 1 : set->rate_scale) * settle(set, step + 1);
    args->rate[CLOUD_MEANS] = means_rate(set, scene, step + 1);
    if (scene->separation != SEPARATION_FULL) args->rate[CLOUD_GAINS] = 0;
    if (strcmp(set->densify, "relocate") == 0) args->explore = EXPLORE * args->rate[CLOUD_MEANS];
    for (int l = 0; l < LAYERS; l++) args->darkest[l] = l == LAYER_R ? set->darkest : set->darkest / 2;
}
