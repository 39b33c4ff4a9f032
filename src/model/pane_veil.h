// The veil of a scene: what dirt on the pane sends back of the light that falls on it, a texture on a patch of the
// pane's plane (kernels/veil.h). It is neither transmitted nor mirrored: photos show it, most of all with the flash;
// renders do not.
#pragma once

#include <stdbool.h>

#include "image/image.h"

#define FS_VEIL_MOST_SIDE 4096 // cells

typedef struct Veil {
    double origin[3];         // world: the middle of the first cell
    double right[3], down[3]; // world: along rows and columns, of length 1; right x down looks away from the cameras
    double cell;              // world units; 0: there is no veil
    double distance;          // world units, before the pane: where a flash would be that gives `light`
    double unit;              // of `light`: steps are measured by it
    double ambient[3];        // times `light`: what it sends back without the flash
    Image light;              // (rows, columns, 1) linear, at least 0
} Veil;

static inline bool fs_pane_veil_is(const Veil *veil)
{
    return veil->cell > 0;
}
// Whether it is one that a scene can have; FS_ERR_INPUT names the file at `path`.
int fs_pane_veil_check(const Veil *veil, const char *path, FsError *err);
