// The parts of a convolutional network: convolution with bias and max(x, 0), and max pooling.
#pragma once

#include "base/error.h"
#include "base/threads.h"

// Feature maps, (channels, height, width).
typedef struct Maps {
    int channels, height, width;
    float *px;
} Maps;

int fs_conv_maps_new(Maps *maps, int channels, int height, int width, FsError *err); // zeroed
void fs_conv_maps_free(Maps *maps);

typedef struct ConvShape {
    int in, out, kernel, stride, pad;
} ConvShape;

// Size of the output along one side; 0: the input is too small.
int fs_conv_side(const ConvShape *shape, int side);
// weight (out, in, kernel, kernel), bias (out). The same bits for any number of threads.
int fs_conv_relu(const ConvShape *shape, const float *weight, const float *bias, const Maps *in, Maps *out,
                 Threads *threads, FsError *err);
// Windows of size x size, 2 apart, inside the input.
int fs_conv_max_pool(const Maps *in, int size, Maps *out, FsError *err);
