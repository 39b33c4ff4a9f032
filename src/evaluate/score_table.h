// What evaluation says: lines of a table through the log, and the same figures with those of each view as JSON.
#pragma once

#include "evaluate/depth.h"
#include "evaluate/score.h"

enum { FS_EVALUATE_LAYERS = 5, FS_EVALUATE_DEPTHS = 2 };

typedef struct MethodScore {
    char *name;
    FilePath dir;
    LayerScore layer[FS_EVALUATE_LAYERS]; // layer NULL where the truth has none
    DepthScore depth[FS_EVALUATE_DEPTHS];
} MethodScore;

void fs_score_table_log(const MethodScore *methods, int n, const Log *log);
int fs_score_table_write(const MethodScore *methods, int n, const char *truth, const char *views, const char *path,
                         FsError *err);
