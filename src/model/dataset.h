// The posed photos of a capture: OUT/views.json.
#pragma once

#include "image/image.h"
#include "model/lens.h"

typedef struct View {
    char *name;           // without folder and extension
    bool flash;           // taken with the flash
    bool held_out;        // never trained on
    bool encoded;         // came as display values (JPEG), linearised by a guess: its camera's response is not known
    double flash_gain;    // of the flash's light in it, by its exposure; 0: not told, as in the others
    double exposure_gain; // what its values were multiplied with, to the others' exposure; 0: not told, 1
    double brightness;    // mean of its tone-mapped values; 0: not told
    double sharpness;     // its detail, of that of its neighbours; 0: not told
    bool blurred;         // so much that it is not trained on either (fs_dataset_leave_blurred)
    double lift;          // what fs_dataset_load_view multiplies its values with; 0: 1
    Camera camera;        // of the working image
    bool distorted;       // the photo is not as the pinhole camera would have taken it, but
    Lens lens;            // this lens, at the size of the working image
} View;

typedef struct Dataset {
    View *view; // sorted by name
    int n;
} Dataset;

void fs_dataset_free(Dataset *dataset);
int fs_dataset_append(Dataset *dataset, const View *view, FsError *err); // copies name
int fs_dataset_find(const Dataset *dataset, const char *name);           // by stem; -1 when missing
double fs_dataset_extent(const Dataset *dataset, double centre[3]);      // fs_camera_extent of all
// JSON: {"views": [{"name","flash","held_out","encoded","flash_gain","exposure_gain","brightness","sharpness" (the last
// five may be missing),"width","height","fx","fy","cx","cy","w2c": 4x4, and of distorted photos "lens":
// {"model","width","height","params"}}]}
int fs_dataset_write(const Dataset *dataset, const char *path, FsError *err);
int fs_dataset_read(Dataset *dataset, const char *path, FsError *err); // also truth/cameras.json ("images": [...])
// Has all photos loaded so much brighter that the mean of those to train on is at `brightness` at least (0: as they
// are): underexposed ones are fitted no worse. Returns the factor on their light, which exposure_gain then holds too.
double fs_dataset_lift(Dataset *dataset, double brightness);
// Marks the photos less sharp than `least` of their neighbours, but not where that is a quarter of a lighting or more:
// then it is how that capture is. Returns how many.
int fs_dataset_leave_blurred(Dataset *dataset, double least);
static inline bool fs_dataset_trains(const View *view)
{
    return !view->held_out && !view->blurred;
}
// What a photo's mask has where clipping has a part in a pixel that is darker than white, as along a lamp's edge. 1: the
// pixel is trusted, 0: its light is at least this, or masked by the user.
#define FS_MASK_PART 0.5f
// Photo and mask (1 channel; may be NULL) of one view out of OUT/images.
int fs_dataset_load_view(const char *out, const View *view, Image *photo, Image *mask, FsError *err);
