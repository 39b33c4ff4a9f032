// What a camera writes into its files beside the picture, and the files.
#pragma once

#include "synth/sensor.h"

typedef struct Exposure {
    int shutter; // 1 / seconds
    int iso;
    double f_number;
    float balance[3]; // the white balance that the camera chose, of the true one
    bool automatic;   // it chose
} Exposure;
// What all photos of a capture share unless it has faults.
#define SHOT_SHUTTER 40
#define SHOT_ISO 200
#define SHOT_EXPOSURE ((Exposure){SHOT_SHUTTER, SHOT_ISO, 5.6, {1, 1, 1}, false})

typedef struct ShotInfo {
    bool flash;
    int number; // of the photo; also its time
    int width, height;
    double focal_mm; // true length
    int focal_35mm;  // in 35 mm film's terms
    Exposure exposure;
} ShotInfo;

#define SHOT_MAKE "FlashSplat"
#define SHOT_MODEL "Synth 1"
#define SHOT_SOFTWARE "flashsplat synth"
void fs_photo_file_time(const ShotInfo *info, char text[20]); // "2024:03:16 10:00:06"

// A mosaic as a DNG; a picture, display-coded, as a JPEG.
int fs_dng_write(const char *path, const Mosaic *mosaic, const ShotInfo *info, FsError *err);
int fs_photo_file_write_jpeg(const char *path, const Image *picture, const ShotInfo *info, FsError *err);
