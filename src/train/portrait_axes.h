// The directions in which a portrait (photographer.c) is drawn, and which of its cells a photo shows.
#ifndef FS_TRAIN_PORTRAIT_AXES_H
#define FS_TRAIN_PORTRAIT_AXES_H

#include "model/dataset.h"
#include "train/region.h"

enum { PORTRAIT_CELLS = REGION_SIDE * REGION_SIDE };

// Of which things it is.
typedef enum PortraitKind {
    PORTRAIT_LEVEL,  // they move with the camera: seen in the same directions from all places
    PORTRAIT_TURNED, // and turn with it: in the same as seen along the way the photo looks
    PORTRAIT_STILL,  // they stand still, so near that they move in the photos as most of a room does, or more
} PortraitKind;

typedef struct PortraitAxes {
    double ahead[3], right[3], up[3]; // world: how a photo looks, on average; tangents of PORTRAIT_REACH to the sides
    double shift[3];                  // of what is ahead by 1, as seen from the mean of the cameras; STILL alone
} PortraitAxes;

// axes: (n), each for its photo.
void fs_portrait_axes_direct(PortraitAxes *axes, PortraitKind kind, const View *const *views, int n);
// The cell of the portrait that a cell of the photo's (OCCLUSION_HEIGHT, OCCLUSION_WIDTH) shows; -1: it looks past it.
int fs_portrait_axes_cell(const PortraitAxes *axes, const Camera *camera, int cell);
// How far photos look down or up, on the mean: the sine.
double fs_portrait_axes_tilt(const View *const *views, int n);

#endif
