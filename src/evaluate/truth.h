// A truth folder: cameras.json and one folder of pictures per layer; and pictures read so that two can be compared.
#pragma once

#include "base/file.h"
#include "image/image.h"
#include "model/dataset.h"

typedef struct TruthView {
    char name[256]; // without folder and extension
    FilePath path;
} TruthView;

typedef struct TruthViews {
    TruthView *view; // sorted by name
    int n;
} TruthViews;

// The views of one layer, as the setting "views" asks (held_out, capture or all); none when there is no such folder.
// A picture of no view in cameras.json counts as a capture view.
int fs_truth_list(const char *truth, const char *layer, const Dataset *cameras, const char *which, TruthViews *views,
                  FsError *err);
void fs_truth_free(TruthViews *views);

// Path of <dir>/<layer>/<view>.<ext> for the first extension of "png|jpg|..." that exists; false when none does.
bool fs_truth_find(const char *dir, const char *layer, const char *view, const char *extensions, FilePath *path);
// The wider of the two is averaged down in linear light to the other's size. name: of b, for the error.
int fs_truth_same_size(Image *a, Image *b, const char *name, FsError *err);
// PNG or JPEG, both as tone-mapped RGB of one size.
int fs_truth_read_pair(const char *truth, const char *estimate, Image *a, Image *b, FsError *err);
