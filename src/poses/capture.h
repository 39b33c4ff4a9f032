// What ingest left, as poses needs it: the photos, their sizes and the pictures to look for features in.
#pragma once

#include "base/error.h"

typedef struct Photo {
    char *name; // without folder and extension; first, see order.h
    bool flash;
    double flash_gain;           // of the flash's light, by the photo's exposure; 1: as in the others
    double exposure_gain;        // what its values were multiplied with
    double brightness;           // mean of its tone-mapped values; 0: not told
    double sharpness;            // its detail, of that of its neighbours; 0: not told
    bool encoded;                // came as display values, linearised by a guess
    int width, height;           // working image
    char *file;                  // as ingest read it, below the photos' folder
    int orientation;             // EXIF's, by which it was turned; 1: it is stored upright
    int orig_width, orig_height; // of the file, upright; 0: not told
    double focal_px;             // of the working image; 0 when not known
    double focal_mm;             // the same on the sensor, whose size need not be known
    char *picture;               // file name of the picture for feature detection, in Capture.pictures
    int picture_width, picture_height;
} Photo;

typedef struct Capture {
    Photo *photo; // sorted by name
    int n;
    char *pictures; // folder of the pictures
} Capture;

// Reads OUT/ingest.json. Pictures: OUT/linear/features/<view>.png.
int fs_capture_read(const char *out, Capture *capture, FsError *err);
void fs_capture_free(Capture *capture);
int fs_capture_find(const Capture *capture, const char *name); // -1 when missing
