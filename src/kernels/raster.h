// The splat rasteriser, one tile at a time: forward (alpha blending, front to back) and backward.
//
//   t       = A dx^2 + B dx dy + C dy^2 + L        log2 of a splat's alpha at a pixel, (dx, dy) = pixel - mean
//   alpha   = min(0.99, 2^t), skipped where t < t_min
//   T_1 = 1, T_{i+1} = T_i (1 - alpha_i), stops when T < transmittance_min      (3DGS, Kerbl et al. 2023, eq. 3)
//   feature = sum_i f_i alpha_i T_i                                              black background
//
// or, of the last feature where `median` says so, f_i of the splat at which T falls under a half: of depths the place
// where half of the light is stopped, not drawn away from it by what else is on the ray. It has no gradient.
//
// Backward goes front to back too, from the finished sums: with g_i = sum_c d_c f_ic and S_i the part of
// sum_c d_c feature_c that lies behind splat i,
//   d alpha_i = T_i g_i - (S_i + d_T T_end) / (1 - alpha_i),       d t_i = ln 2 alpha_i d alpha_i (0 where clamped)
//   d f_ic    = sum over pixels of alpha_i T_i d_c
// and a splat's geometry needs the moments of d t over its pixels: 1, dx, dy, dx^2, dx dy, dy^2.
//
// A tile is 8 pixels wide and 32 high; its pixels are numbered row by row. A tile's entries are splats in depth order,
// each with a mask of the rows that its ellipse touches.
#ifndef FS_KERNELS_RASTER_H
#define FS_KERNELS_RASTER_H

#include <stdbool.h>
#include <stdint.h>

#define FS_TILE_W 8
#define FS_TILE_H 32
#define FS_TILE_PIXELS (FS_TILE_W * FS_TILE_H)
#define FS_FEATURES_MAX 4               // colour and depth
#define FS_RECORD (6 + FS_FEATURES_MAX) // floats of one gradient record
#define FS_ALPHA_MAX 0.99f
#define FS_T_MIN (-7.99435343686f) // log2(1/255)
#define FS_TRANSMITTANCE_MIN 1e-4f

// A projected splat, one cache line.
typedef struct Splat {
    float x, y;       // mean, pixels
    float a, b, c, l; // A, B, C, L above
    float feature[FS_FEATURES_MAX];
    float depth;      // z, world units
    uint16_t tile[4]; // tiles touched by the bounding box: x0, y0, x1, y1 (exclusive); x0 = x1 when invisible
    float pad[3];
} Splat;
_Static_assert(sizeof(Splat) == 64, "a splat is one cache line");

typedef struct TileEntry {
    uint32_t splat; // index into the splats
    uint32_t mask;  // bit y: row y may have pixels with t >= t_min
    uint32_t slot;  // where backward puts the gradient record
} TileEntry;

// Gradient record: moments of d t (1, dx, dy, dx^2, dx dy, dy^2), then d feature.
typedef struct RasterTile {
    int x0, y0; // pixel of the tile's corner
    int n;      // entries
    const TileEntry *entry;
    const Splat *splats;
    int features;            // 1 .. FS_FEATURES_MAX
    float t_min;             // FS_T_MIN
    float transmittance_min; // FS_TRANSMITTANCE_MIN
    bool count;              // whether forward counts pairs
    bool median;             // whether the last feature is the median, 0 where T stays above a half; not for backward
} RasterTile;

typedef struct RasterKernels {
    // mask[i]: rows that the splat's ellipse t >= t_min touches in tile i of a row of `tiles`, of which the first is
    // at (x0, y0) (may say yes a hair too often).
    void (*cover)(const Splat *splat, int x0, int y0, int tiles, float t_min, uint32_t *mask);
    // feature (features, 256), transmittance (256). Returns the pairs that contributed if
    // asked to count, else 0.
    long (*forward)(const RasterTile *tile, float *feature, float *transmittance);
    // Takes forward's results and their gradients d_feature (features, 256), d_transmittance (256, or NULL: then
    // transmittance is not read); writes records[entry.slot] (FS_RECORD floats each).
    void (*backward)(const RasterTile *tile, const float *feature, const float *transmittance, const float *d_feature,
                     const float *d_transmittance, float *records);
} RasterKernels;

extern const RasterKernels fs_raster_scalar, fs_raster_avx2, fs_raster_avx512, fs_raster_neon;

#endif
