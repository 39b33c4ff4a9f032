// Multiresolution hash encoding of places (Mueller, Evans, Schied and Keller 2022, section 3): each level is a grid
// over the unit cube whose vertices have two features, interpolated trilinearly. Vertices of a coarse level have a row
// of the table each; those of a fine one share rows by a hash of their coordinates.
#ifndef FS_KERNELS_HASHGRID_H
#define FS_KERNELS_HASHGRID_H

#include <stddef.h>
#include <stdint.h>

enum { FS_HASHGRID_FEATURES = 2 };

typedef struct HashLevel {
    int resolution; // cells along each axis
    uint32_t rows;  // of the table: (resolution + 1)^3, or a power of two where that is less
    int hashed;     // the latter
} HashLevel;

typedef struct HashPlaces {
    const float *at[3]; // (n) each, 0..1
    int n;
} HashPlaces;

typedef struct HashgridKernels {
    // table (rows, 2); out (2, stride): the level's features at each place.
    void (*encode)(const HashLevel *level, const float *table, const HashPlaces *places, float *out, size_t stride);
    // d_table (rows, 2): added to; touched (rows): 1 where it was.
    void (*scatter)(const HashLevel *level, const HashPlaces *places, const float *d_out, size_t stride, float *d_table,
                    unsigned char *touched);
} HashgridKernels;

extern const HashgridKernels fs_hashgrid_scalar, fs_hashgrid_avx2, fs_hashgrid_avx512, fs_hashgrid_neon;

#endif
