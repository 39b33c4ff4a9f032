// Camera RAW through LibRaw: linear camera RGB, white-balanced, 1.0 = sensor white in the green channel.
#pragma once

#include "image/sizes.h"

typedef struct RawInfo {
    int width, height; // as stored, of the visible area
    int orientation;   // EXIF 1..8
    int flash;         // as in EXIF; -1: unknown
    char make[64], model[64];
    double white_balance[3];                    // as shot: multipliers of camera RGB, green 1; 0: unknown
    double daylight[3];                         // LibRaw's guess where the file has none
    double exposure_s, iso, f_number, focal_mm; // 0: unknown
    double srgb_from_camera[9];                 // (3, 3) linear sRGB of white-balanced camera RGB; all 0: unknown
    double camera_from_xyz[9];                  // (3, 3) not white-balanced, D65; all 0: unknown
    double baseline_exposure;                   // stops, as a DNG says
    double memory;                              // bytes that reading the picture takes
} RawInfo;

// What the headers say; the picture is not unpacked.
int fs_raw_read_info(const char *path, RawInfo *info, FsError *err);
// The picture in the sizes wanted: black subtracted, divided by sensor white, times white_balance; not clipped,
// negative noise kept where the sensor is a Bayer one. Clipped is where a sensor pixel near enough to matter was
// saturated. As stored: orientation not applied. plain: LibRaw's own processing even for a Bayer sensor.
int fs_raw_read(const char *path, const double white_balance[3], bool plain, PhotoSizes *sizes, FsError *err);
