// The photos of a capture, from file names to what is known of each.
#ifndef FS_INGEST_PHOTOS_H
#define FS_INGEST_PHOTOS_H

#include "base/threads.h"
#include "image/exif.h"
#include "model/project.h"

typedef enum ShotKind { SHOT_RAW, SHOT_JPEG, SHOT_PNG, SHOT_TIFF, SHOT_KINDS } ShotKind;

typedef struct Shot {
    char *file; // name in the photos' folder
    char *name; // the view's: without extension
    ShotKind kind;
    ExifInfo exif;
    int flash;               // 1 fired, 0 not, -1 unknown
    double white_balance[3]; // as shot, green 1; 0 unknown (RAW only)
    double gain;             // brings the photo to the capture's exposure

    // known after development
    FsError failure;                            // code 0: the photo is good
    bool encoded;                               // came as display values: reduced quality
    int width, height, orig_width, orig_height; // upright
    double clipped;                             // fraction of the working image
    double mean;                                // of the working image's linear values
} Shot;

typedef struct Shots {
    char *folder;
    Shot *shot; // sorted by name
    int n;
    double white_balance[3]; // of the whole capture
} Shots;

void fs_shots_free(Shots *shots);
// The photos in `folder`: a RAW file is taken where a JPEG has the same name; other equal names are an error.
int fs_shots_scan(Shots *shots, const char *folder, const Log *log, FsError *err);
// Of the names and contents of the photos and of the list of flash photos (may be NULL): tells whether anything changed
// since the last time.
void fs_shots_fingerprint(const Shots *shots, const char *flash_list, char text[17]);
// Headers of all photos; those that cannot be read get a failure.
void fs_shots_read_headers(Shots *shots, Threads *threads);
// Drops the photos that failed, each with a warning; an error when that leaves fewer than two thirds.
int fs_shots_drop_failed(Shots *shots, const Log *log, FsError *err);

// Flash or not: by EXIF, or by the settings flash-glob and flash-list. An error unless both kinds are there.
int fs_shots_find_flash(Shots *shots, const Settings *set, const Log *log, FsError *err);
int fs_shots_check_groups(const Shots *shots, FsError *err);
// One white balance and one exposure for the whole capture, by medians; warns where the photos differ.
void fs_shots_level(Shots *shots, const Log *log);

#endif
