// What the files of the training stage share: the views, the clouds with their optimiser state, the loss terms.
#ifndef FS_TRAIN_TRAINER_H
#define FS_TRAIN_TRAINER_H

#include "engine/internal.h"
#include "model/dataset.h"
#include "model/project.h"

typedef struct TrainView {
    const View *view;
    Planes photo;   // (3, h, w) tone-mapped
    Planes mask;    // (1, h, w)
    Planes mu, var; // of photo, for SSIM
} TrainView;

typedef enum LossTerm {
    LOSS_L1,
    LOSS_DSSIM,
    LOSS_LINEARITY,
    LOSS_BETA_SMOOTH,
    LOSS_DEPTH_SMOOTH,
    LOSS_GAIN_SMOOTH,
    LOSS_HOLES,
    LOSS_TERMS
} LossTerm;
extern const char *const fs_loss_names[LOSS_TERMS];

// The optimiser's side of one cloud.
typedef struct CloudState {
    Cloud m, v;        // Adam's moments, fields like the cloud's
    float *screen_sum; // (capacity) sum of screen-space gradients since the last densification
    int *screen_count; // (capacity) steps in which it was seen
    int *neighbour;    // (n, TRAIN_NEIGHBOURS) of Gaussians with gains, or NULL
    int stats_capacity;
} CloudState;
#define TRAIN_NEIGHBOURS 8

// Adam's moments of the numbers that belong to the whole scene: pane normal, dimming, tint of the gain, flash return.
enum { TRAIN_GLOBALS = 8 };
typedef struct GlobalState {
    double m[TRAIN_GLOBALS], v[TRAIN_GLOBALS];
} GlobalState;

typedef struct Trainer {
    FsProject *project;
    const Settings *set;
    Engine *engine;
    Dataset dataset;
    TrainView *views; // those to train on
    int n_views;
    Scene scene;
    CloudState state[LAYERS];
    GlobalState globals;
    int step;                    // steps done
    int first_step;              // at which this run began (a checkpoint's)
    bool last_flash;             // the last step was at a flash photo
    double loss[LOSS_TERMS];     // of the last step
    double smoothed[LOSS_TERMS]; // running means, for people
    double *strip_sum;           // (strips, LOSS_TERMS) parts of sums, added in strip order
    void **photometric_scratch;  // one per thread
    int longest_width, tallest;  // of all views
} Trainer;

// views.c
int fs_views_load(Trainer *trainer, FsError *err);
void fs_views_free(Trainer *trainer);
const TrainView *fs_views_at_step(const Trainer *trainer, int step); // every view once per epoch, shuffled by the seed

// step.c: one step of training at one view; fills trainer->loss
void fs_step_run(Trainer *trainer, const TrainView *view);
// optimise.c
int fs_optimise_init(Trainer *trainer, FsError *err);
void fs_optimise_step(Trainer *trainer); // Adam over what the engine's tasks hold after a step
double fs_optimise_means_rate(const Trainer *trainer);
void fs_optimise_free(Trainer *trainer);
// densify.c: relocation, growth, pruning, as the setting "densify" says; called after every step
int fs_densify_step(Trainer *trainer, FsError *err);
int fs_fsgs_step(Trainer *trainer, FsError *err); // fsgs.c: the variant of the paper
// gains.c
int fs_gains_find_neighbours(Trainer *trainer, FsError *err);
double fs_gains_smooth(Trainer *trainer, float *d_gains); // adds its gradient, returns the loss
// checkpoint.c
int fs_checkpoint_write(const Trainer *trainer, FsError *err);
int fs_checkpoint_read(Trainer *trainer, FsError *err); // 1: read, 0: there is none
// progress.c
int fs_progress_sheet(Trainer *trainer, FsError *err); // OUT/progress/NNNNN.png
int fs_progress_log(Trainer *trainer, double seconds, bool last,
                    FsError *err); // OUT/log.jsonl and the progress callback

#endif
