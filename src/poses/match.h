// Matches between the features of two pictures by their descriptors alone, for pictures whose poses are not known yet.
#pragma once

#include "base/error.h"
#include "base/log.h"
#include "base/threads.h"
#include "poses/features.h"

// Scalar product of two descriptors; 262144 (512^2) for equal ones.
int fs_match_dot(const int16_t *a, const int16_t *b);
// Distance (of the descriptors as unit vectors, 0 .. 1.41) from a scalar product.
float fs_match_distance(int dot);

typedef struct MatchBest {
    int at, first, second; // nearest, its scalar product, the second nearest's
} MatchBest;
static inline void fs_match_keep(MatchBest *best, int at, int dot)
{
    if (dot > best->first)
        *best = (MatchBest){at, dot, best->first};
    else if (dot > best->second)
        best->second = dot;
}

typedef struct MatchOptions {
    int max_features; // those of largest scale of each picture take part
    float max_ratio;  // of a match's distance and the second nearest's
    const bool *pair; // (n (n - 1) / 2) those to match; NULL: all
} MatchOptions;

// Mutual nearest neighbours for every pair of pictures. list: (n (n - 1) / 2), pair (i, j), i < j, at
// fs_match_pair. Same result for any number of threads.
int fs_match_all(const Features *features, int n, MatchOptions options, Threads *threads, const Log *log,
                 MatchList *list, FsError *err);
int fs_match_pair(int i, int j);            // i < j
size_t fs_match_pairs(int n);               // how many n pictures have
void fs_match_free(MatchList *list, int n); // those of n pictures, and what they are in
// Of many pictures: which pairs are worth matching, by a first look at few features of each. For every picture those
// that have most in common with it, and those next to it.
int fs_match_choose(const Features *features, int n, Threads *threads, const Log *log, bool *pair, FsError *err);
