// The veil: light that dirt on the pane sends back, of the flash and of what lights the rooms. A texture on a patch of
// the pane's plane, added to a photo's light:
//
//   V_c(x, y) = (ambient_c + light_c (ray_2 / |ray|)^2) texture(u, v),
//   u = at_0 + per ray_0 / ray_2,   v = at_1 + per ray_1 / ray_2
//
// ray: of the pixel, along the patch's columns, along its rows, and away from the camera at right angles to it; u, v
// count columns and rows from the middle of the first ones. The flash's light falls off with the squared distance from
// it, and it sits at the camera: `light` is what is left of it straight before the camera. Linear between the middles
// of the texture's cells, nothing beyond. All in linear light; dirt is grey.
#ifndef FS_KERNELS_VEIL_H
#define FS_KERNELS_VEIL_H

#include "kernels/planes.h"

typedef struct VeilView {
    float base[3], dx[3], dy[3]; // ray = base + x dx + y dy, of any length
    float at[2], per;            // cells
    float light[3], ambient[3];
    int width, height; // of the texture, cells
} VeilView;

typedef struct VeilKernels {
    // texture (height, width); veil: 3 planes of the photo's size, rows [y0, y1) are written.
    void (*forward)(const VeilView *view, const float *texture, const Planes *veil, int y0, int y1);
    // From dL/dveil: the part of the rows is added to dL/dtexture and dL/dambient (NULL: not wanted, nor the texture).
    void (*backward)(const VeilView *view, const float *texture, const Planes *d_veil, float *d_texture,
                     double d_ambient[3], int y0, int y1);
} VeilKernels;

extern const VeilKernels fs_veil_scalar, fs_veil_avx2, fs_veil_avx512, fs_veil_neon;

#endif
