// The photos of a capture, from file names to what is known of each.
#pragma once

#include "base/threads.h"
#include "image/photo.h"
#include "model/project.h"

typedef struct PhotoFile {
    char *file; // name in the photos' folder
    char *name; // the view's: without extension
    PhotoKind kind;
    ExifInfo exif;
    int flash;               // 1 fired, 0 not, -1 unknown
    double white_balance[3]; // as shot, green 1; 0 unknown (RAW only)
    double memory;           // bytes that reading it takes
    double gain;             // brings the photo to the capture's exposure

    // known after development
    FsError failure;                            // code 0: the photo is good
    bool encoded;                               // came as display values: reduced quality
    int width, height, orig_width, orig_height; // upright
    double clipped;                             // fraction of the working image
    double mean;                                // of the working image's linear values
} PhotoFile;

typedef struct Photos {
    char *folder;
    PhotoFile *photo; // sorted by name
    int n;
    double white_balance[3]; // of the whole capture
} Photos;

void fs_photos_free(Photos *photos);
// The photos in `folder`: a RAW file is taken where a JPEG has the same name; other equal names are an error.
int fs_photos_scan(Photos *photos, const char *folder, const Log *log, FsError *err);
// Of the names and contents of the photos and of the list of flash photos (may be NULL): tells whether anything changed
// since the last time.
void fs_photos_fingerprint(const Photos *photos, const char *flash_list, char text[17]);
// Headers of all photos; those that cannot be read get a failure.
void fs_photos_read_headers(Photos *photos, Threads *threads);
// Drops the photos that failed, each with a warning; an error when that leaves fewer than two thirds.
int fs_photos_drop_failed(Photos *photos, const Log *log, FsError *err);

// Flash or not: by EXIF, or by the settings flash-glob and flash-list. An error unless both kinds are there.
int fs_photos_find_flash(Photos *photos, const Settings *set, const Log *log, FsError *err);
int fs_photos_check_groups(const Photos *photos, FsError *err);
