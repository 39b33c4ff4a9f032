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

// What the values of an estimate's pictures are: ours (linear^0.22), sRGB's, or linear light.
typedef enum Encoding { ENCODING_GAMMA, ENCODING_SRGB, ENCODING_LINEAR } Encoding;
Encoding fs_truth_encoding(const char *name); // as the setting method-encoding names them

#define FS_TRUTH_PICTURES "png|jpg|jpeg|tif|tiff"
// Path of <dir>/<layer>/<view>.<ext> for the first extension of "png|jpg|..." that exists; false when none does.
bool fs_truth_find(const char *dir, const char *layer, const char *view, const char *extensions, FilePath *path);
// The same of other programs: of any picture's extension, named as the view, or where none is <view>_ and more, which
// no longer name of `cameras` begins. How many there are; path: of one of them.
int fs_truth_find_estimate(const char *dir, const char *layer, const Dataset *cameras, const char *view,
                           FilePath *path);
// Of nearly the same proportions (programs round sides to multiples of 16 and more). name: of b, for the error.
int fs_truth_same_shape(const Image *a, const Image *b, const char *name, FsError *err);
// Both are averaged down in linear light to the smaller width and height of the two, which must be of one shape.
int fs_truth_same_size(Image *a, Image *b, const char *name, FsError *err);
// Pictures, both as tone-mapped RGB of one size; what the estimate's values are, `encoding` says.
int fs_truth_read_pair(const char *truth, const char *estimate, Encoding encoding, Image *a, Image *b, FsError *err);
