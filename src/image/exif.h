// What a photo says about how it was taken.
#pragma once

#include "image/tags.h"

typedef struct ExifInfo {
    int flash;                                               // the EXIF field, -1: not there
    int orientation;                                         // 1..8
    double exposure_s, iso, f_number;                        // 0: unknown
    double focal_mm, focal_35mm;                             // focal length, and its 35 mm equivalent; 0: unknown
    double focus_m;                                          // to what is sharp; more than 1e6: infinity; 0: unknown
    enum { WHITE_UNKNOWN, WHITE_AUTO, WHITE_BY_HAND } white; // how its white balance was set
    double pixels_per_mm;                                    // of the sensor, at exif_width; 0: unknown
    int exif_width, exif_height; // size the camera made the photo, before any editing; 0: unknown
    int width, height;           // of the picture in the file, as stored; 0: unknown
    double neutral[3];           // camera RGB of a grey thing, green 1 (DNG's AsShotNeutral); 0: unknown
    bool adobe_rgb, srgb;        // its values are of Adobe RGB, of sRGB, where no profile says more
    char make[64], model[64], lens[64];
    char taken[64]; // when, to the second; "": unknown
    Tags *tags;     // where all that is worth keeping goes; NULL: nowhere
} ExifInfo;

// JPEG, PNG, TIFF, HEIF, and RAW files that are TIFF (DNG, NEF, CR2, ARW...), CR3, RAF or MRW. Fields stay unknown
// where the file does not tell them, or is of another kind; only a file that cannot be opened is an error.
int fs_exif_read(const char *path, ExifInfo *info, FsError *err);
// The tags themselves, for another file: of the shot, the camera, the place, who took it. Free them.
int fs_exif_read_tags(const char *path, Tags *tags, FsError *err);
// The flash went off: 1, it did not: 0, the photo does not tell: -1. Bit 0 alone says so: 16 and 24 mean "did not
// fire".
int fs_exif_flash_fired(const ExifInfo *info);
// "1/60 s", "2.5 s"
void fs_exif_shutter_text(double exposure_s, char text[24]);
void fs_exif_exposure_text(const ExifInfo *info, char text[120]); // "1/60 s, ISO 200, f/8"
// How much light of the scene one unit of a photo stands for, up to a constant; 0 unknown. Fields that are missing in
// all photos do not matter: they cancel.
double fs_exif_exposure(const ExifInfo *info);
// Focal length in pixels of the photo at width x height (whole frame); 0 when unknown.
double fs_exif_focal_px(const ExifInfo *info, int width, int height);
