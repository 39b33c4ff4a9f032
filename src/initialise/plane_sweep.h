// Plane sweep: how well each depth along each ray of a view explains the photos, apart for the scene behind the pane
// and the mirrored one. The measure is that of cue.h, dense. The mirrored scene is one room seen whole, and the more
// places it is seen from, the more the other scene averages out. What is behind the pane hides itself: from elsewhere
// a bright edge covers what lies in the shade behind it, and the window around it takes its depth. So there fewer
// photos count, the nearest, and every pixel of the window as much, however strong its contrast is. Once the mirrored
// scene is subtracted from the photos, windows that end at edges find it best (edge_windows.h).
#ifndef FS_INITIALISE_PLANE_SWEEP_H
#define FS_INITIALISE_PLANE_SWEEP_H

#include "base/threads.h"
#include "initialise/classify.h"
#include "initialise/edge_windows.h"
#include "initialise/small_views.h"

typedef enum SweepAim {
    AIM_TRANSMITTED,
    AIM_REFLECTED,
    AIM_EDGES, // the transmitted scene, by windows that end at edges
} SweepAim;

// The photos without their slow parts: (height, width, 4), r g b and 1 where trusted.
typedef struct SweepPhotos {
    const SmallViews *views; // borrowed
    SweepAim aim;            // what is looked for
    Image *fine;             // (views->n)
} SweepPhotos;

// Makes `fine`; views is borrowed. Fails for want of memory alone.
int fs_plane_sweep_prepare(const SmallViews *views, SweepAim aim, SweepPhotos *photos, Threads *threads, FsError *err);
void fs_plane_sweep_photos_free(SweepPhotos *photos);

typedef struct DepthRange {
    float min, max; // inverse depths
    int steps;      // from the one to the other
} DepthRange;

typedef struct PlaneSweep {
    Camera camera; // of the grid
    int steps;
    float inverse_min, inverse_step; // inverse depth of step 0, and between two
    float *score[2];                 // (height, width, steps), 0..1, of what is found: transmitted, reflected
} PlaneSweep;

// view: the number of the one whose rays are swept.
int fs_plane_sweep_run(const SweepPhotos *photos, int view, const DepthRange *range, const DepthOdds *odds,
                       Threads *threads, PlaneSweep *sweep, FsError *err);
void fs_plane_sweep_free(PlaneSweep *sweep);

#endif
