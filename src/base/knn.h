// Nearest neighbours of 3D points, by a k-d tree.
#pragma once

#include "base/threads.h"

typedef struct KnnTree KnnTree;

// The tree keeps its own copy of the points. NULL when out of memory or when a coordinate is not finite.
KnnTree *fs_knn_new(const float *xyz, int n); // xyz (n, 3)
void fs_knn_free(KnnTree *tree);
// The k points nearest to query, except point number `skip` (-1: none), nearest first, ties by lower index.
// index (k), dist2 (k, squared distances); where fewer than k points exist the rest is -1 and INFINITY.
void fs_knn_query(const KnnTree *tree, const float query[3], int skip, int k, int *index, float *dist2);

// All points' k nearest other points: index (n, k), dist2 (n, k) or NULL. Negative FsStatus on failure, as fs_knn_new.
int fs_knn(const float *xyz, int n, int k, int *index, float *dist2, Threads *threads);
