// What a step does to the parameters, once it has their gradients: the loss terms on parameters alone, Adam, and the
// limits within which parameters stay.
#ifndef FS_ENGINE_UPDATE_H
#define FS_ENGINE_UPDATE_H

#include "engine/host_engine.h"

typedef struct Update {
    HostEngine *engine;
    const StepArgs *args;
    HostView *photo;          // whose state is stepped too
    const ViewPlan *plan;     // of it
    RasterTask *task[LAYERS]; // that hold the gradients of the clouds to step; NULL: not stepped
    PaneGradient pane;
    CalibrationGradient calibration;
    double veil_ambient[3]; // dL/d of Veil.ambient
} Update;

void fs_update_numbers_run(const Update *update, StepResult *result);    // update_numbers.c
void fs_update_photo_run(const Update *update, StepResult *result);      // update_photo.c
void fs_update_photo_middle(const HostEngine *engine, double middle[3]); // of the photos' cameras
int fs_update_run(const Update *update, StepResult *result, FsError *err);
int fs_update_volumes_run(const Update *update,
                          FsError *err); // update_volumes.c: radiance fields, after a backward pass

#endif
