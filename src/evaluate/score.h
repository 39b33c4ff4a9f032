// One layer of one folder of renders against the truth: figures per view and their means.
#pragma once

#include "base/log.h"
#include "evaluate/metrics.h"
#include "evaluate/truth.h"

typedef struct Figures {
    double value[METRICS]; // NAN where not measured
} Figures;

// As it is; after the layer's gain; in the paper's convention, see fs_score_layer.
typedef enum ScoreKind { SCORE_RAW, SCORE_FITTED, SCORE_PAPER, SCORE_KINDS } ScoreKind;

typedef struct ViewScore {
    char name[256];
    bool missing;      // no file of that view
    int width, height; // that it was measured at
    Figures figures[SCORE_KINDS];
} ViewScore;

typedef struct LayerScore {
    const char *layer;         // static
    int n, missing;            // views measured and not found
    int width, height;         // that they were measured at, of the smallest; 0: none was
    double gain[3];            // least squares in linear light over all views
    Figures mean[SCORE_KINDS]; // over views
    int counted[SCORE_KINDS];  // how many
    ViewScore *view;           // (n + missing)
} LayerScore;

typedef struct LayerTask { // what to compare; borrowed
    const char *layer, *truth, *dir;
    const TruthViews *views;
    const Dataset *cameras; // of the truth, where files may be named as other programs do; NULL: they are ours
    bool paired;
    Encoding encoding; // of the estimate
} LayerTask;

// Compares <dir>/<layer>/<view>.png (others' as fs_truth_find_estimate) with the truth's views. With `paired`, also in
// the paper's convention: the reference is the paired difference gamma(I_F - I_N) of the true composites (at views that
// have none gamma(T_F - T_N)), and both it and the estimate are stretched so that their smallest value is 0 and their
// largest 1.
int fs_score_layer(LayerScore *score, const LayerTask *layer, const MetricContext *context, const Log *log,
                   FsError *err);
void fs_score_free(LayerScore *score);
