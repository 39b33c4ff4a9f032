// What the files of the training stage share: the loop's view of a training. The scene and the photos live in the
// engine; what is here of the scene is what was last brought down.
#ifndef FS_TRAIN_TRAINER_H
#define FS_TRAIN_TRAINER_H

#include "base/threads.h"
#include "engine/engine.h"
#include "model/cost.h"
#include "model/dataset.h"
#include "model/project.h"

typedef struct Trainer {
    FsProject *project;
    const Settings *set;
    Engine *engine;
    Threads *threads; // for what train does itself
    Dataset dataset;
    const View **views; // (n_views) of dataset, those to train on; numbered as the engine has them
    int n_views;
    unsigned learn;    // of the camera: StepArgs.learn
    int long_edge;     // pixels, the longest of all views
    int budget;        // most Gaussians per cloud
    int halvings;      // of the photos that the engine has; -1: it has none
    int *order, epoch; // (n_views) of the present epoch
    Scene scene;
    TrainState state;          // as last brought down, for checkpoints
    PhotoState *photo;         // (n_views) of the photos, as last brought down
    OcclusionState *occlusion; // (n_views) by the photographer, as last brought down; NULL: not looked for, or nobody
    float *residual;           // (n_views, OCCLUSION_CELLS, 3) as last seen before the full size; NULL: not yet
    unsigned char *passers;    // (n_views, OCCLUSION_CELLS) 1: left out of the photo; NULL: nobody walks by
    unsigned char *lamps;      // (n_views, OCCLUSION_CELLS) 1: a lamp there is behind the pane
    int *neighbour;            // (N, ENGINE_NEIGHBOURS) of T_N, as the engine has them, or NULL
    int step;                  // steps done
    int first_step;            // at which this run began (a checkpoint's)
    double lift;               // of the photos' light, and so of the scene's
    double begin;              // of this run, seconds on the monotonic clock
    double seconds;            // that the steps before it took
    StepResult last;
    float smoothed[LOSS_TERMS]; // running means, for people
} Trainer;

// train.c: the engine gets the scene as it stands, as at the first step
int fs_train_begin(Trainer *trainer, FsError *err);

// views.c
int fs_views_load(Trainer *trainer, FsError *err);
void fs_views_free(Trainer *trainer);
int fs_views_load_halved(Trainer *trainer, int halvings, FsError *err); // the same, of a size
int fs_views_halvings(int long_edge, int side);                         // until photos are no longer than `side`
// A photo of training as the engine has it at that size.
int fs_views_photo(const Trainer *trainer, int number, int halvings, Camera *camera, Image *photo, Image *mask,
                   FsError *err);
int fs_views_at_step(Trainer *trainer, int step);                // every view once per epoch, shuffled by the seed
int fs_views_for_step(Trainer *trainer, int step, FsError *err); // the engine gets the photos of the size of that step

// schedule.c: everything that changes with the step
void fs_schedule_step(const Settings *set, const Scene *scene, int step, StepArgs *args);
unsigned fs_schedule_learns(const Settings *set, bool encoded);         // encoded: the photos' response is not known
bool fs_schedule_relocates(const Settings *set, int step);              // after that many steps; densify.c
int fs_schedule_halvings(const Settings *set, int long_edge, int step); // of the photos' size
int fs_schedule_budget(const Settings *set, double pixels);             // Gaussians of a cloud, for photos of that size
// StepArgs.stride, for photos of so many pixels, halved so often, and clouds that may have `budget` Gaussians.
void fs_schedule_stride(const Settings *set, int halvings, double pixels, int budget, int stride[2]);
int fs_schedule_grown(const Settings *set, int budget, int n, int step); // relocation: a cloud of n after a round
bool fs_schedule_fsgs(int step);                                         // fsgs.c

// train_cost.c
RunSize fs_trainer_size(const Trainer *trainer);
bool fs_train_cost_mirrors(const Settings *set); // a cloud R, and beta of a pane

// densify.c: relocation, growth, pruning, as the setting "densify" says; called after every step
int fs_densify_step(Trainer *trainer, FsError *err);
int fs_densify_neighbours(Trainer *trainer, FsError *err); // finds and sends up whose gains are compared

// curtains.c: what hangs right before a camera of the scene, as it was brought down, is made transparent
int fs_curtains_open(Trainer *trainer, FsError *err);

// pane_look.c: what is on the pane and before it, where the settings bars and dirt look for it
int fs_pane_look_steps(const Settings *set);      // that a look takes; 0: none is had
int fs_pane_look_halvings(int long_edge);         // of the photos that it looks at
int fs_pane_look(Trainer *trainer, FsError *err); // completes the scene; the engine is to have it again
// The arguments of a step of any look, also the photographer's; an error where it is cancelled.
int fs_pane_look_step(Trainer *trainer, int step, StepArgs *args, FsError *err);
// bars.c, for the look. By what covers were learned to be, T keeps some or none: 1 or 0. least: share of T, of what is
// surely a bar in each group of Gaussians.
int fs_bars_decide(Trainer *trainer, const Cloud *learned, double least, FsError *err);
// bars_loan.c. Where more of them may be among what R begins with: T has what is near of R, as its last rows. How many,
// or 0.
typedef struct BarsLoan {
    Cloud R;            // as it was
    unsigned char *far; // (its n) 0: lent
    int n;              // of T, as it was
    float *covers;      // (n) of T, as they were; NULL: it had none
} BarsLoan;
int fs_bars_loan_make(Trainer *trainer, BarsLoan *loan, FsError *err);
int fs_bars_loan_settle(Trainer *trainer, BarsLoan *loan, FsError *err); // R has back what T has no covers for
void fs_bars_loan_free(BarsLoan *loan);

// photographer.c: who is mirrored too, where the setting of that name looks for them
int fs_photographer_steps(const Settings *set, int photos); // of a look where nobody is there, mostly; 0: none is had
int fs_photographer_find(Trainer *trainer, FsError *err);   // the engine has the scene; it is to have it again
int fs_photographer_up(Trainer *trainer, FsError *err);     // to all photos that the engine has
int fs_photographer_down(Trainer *trainer, FsError *err);

// passers_by.c, where the setting of that name looks for them: before the photos get their full size
void fs_passers_by_announce(const Trainer *trainer); // says where they are not looked for
int fs_passers_by_watch(Trainer *trainer, StepArgs *args, FsError *err);
int fs_passers_by_find(Trainer *trainer, FsError *err);
void fs_passers_by_mask(const Trainer *trainer, int view, Image *photo, Image *mask);

// lamps_behind.c: fills in Trainer.lamps, by what the start found; the views are loaded
int fs_lamps_behind_read(Trainer *trainer, FsError *err);

// checkpoint.c
int fs_checkpoint_write(Trainer *trainer, FsError *err); // of what the engine holds
int fs_checkpoint_read(Trainer *trainer, FsError *err);  // 1: read, 0: there is none

// progress.c
int fs_progress_sheet(Trainer *trainer, FsError *err);          // OUT/progress/NNNNN.png
int fs_progress_log(Trainer *trainer, bool last, FsError *err); // OUT/log.jsonl and the progress callback
int fs_progress_log_rewind(Trainer *trainer, FsError *err);     // the log loses what comes after the present step

#endif
