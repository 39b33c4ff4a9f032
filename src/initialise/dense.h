// Dense surfaces of both scenes: plane sweeps from views spread over the capture, two depths per ray, and of those the
// points on which views agree.
#ifndef FS_INITIALISE_DENSE_H
#define FS_INITIALISE_DENSE_H

#include "base/log.h"
#include "initialise/classify.h"

typedef struct DensePoints {
    int n, capacity;
    float *xyz; // (n, 3)
} DensePoints;

void fs_dense_free(DensePoints *points);
// From the classified points (n) and what their depths tell: the two clouds. They may come out empty.
int fs_dense_find(const Frames *frames, const float *xyz, const unsigned char *kind, int n, const DepthOdds *odds,
                  const Log *log, Threads *threads, DensePoints *transmitted, DensePoints *reflected, FsError *err);

#endif
