// Arrays as NumPy saves them (.npy, versions 1 to 3): integers of 8, 16 and 32 bits and floats of 16, 32 and 64, of
// either byte order, in C or Fortran order. As photos: a camera's values, demosaiced, (height, width, 3).
#pragma once

#include "image/sizes.h"

enum { NPY_DIMS = 4 };

typedef struct NpyArray {
    int n_dims;
    size_t dim[NPY_DIMS];    // none is 0
    size_t stride[NPY_DIMS]; // bytes from one to the next
    char kind;               // 'i', 'u', 'f'
    int size;                // bytes of a value
    bool swapped;            // of the other byte order
    char *file;
    const char *data;
} NpyArray;

int fs_npy_read(const char *path, NpyArray *array, FsError *err); // the caller's (fs_npy_free)
void fs_npy_free(NpyArray *array);
double fs_npy_value(const NpyArray *array, const char *at); // at: data and so many strides

// What a photo's values mean: (value - black) / (white - black) is the share of full, which white balance multiplies by
// the channel's gain. RAW files tell black and white by themselves.
typedef struct SensorLevels {
    double gain[3], black, white;
} SensorLevels;
// From the header. memory: bytes that reading it takes; may be NULL.
int fs_npy_photo_size(const char *path, int *width, int *height, double *memory, FsError *err);
int fs_npy_read_photo(const char *path, const SensorLevels *levels, PhotoSizes *sizes, FsError *err);
