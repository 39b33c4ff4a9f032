// The photos of a capture, from file names to what is known of each.
#pragma once

#include "base/file.h"
#include "base/threads.h"
#include "image/photo.h"
#include "model/look.h"
#include "model/project.h"

typedef struct PhotoFile {
    char *path;    // on disk, below the photos' folder
    char *file;    // the same as people read it: UTF-8
    char *name;    // the view's: without folder and extension
    char *instead; // path of the same shot as JPEG or HEIF, which was left out for this one; NULL: none
    PhotoKind kind;
    ExifInfo exif;
    int folder_says;         // flash, by the name of its folder: 1 with, 0 without, -1 nothing
    int name_says;           // the same by its own name
    int flash;               // 1 fired, 0 not, -1 unknown
    double white_balance[3]; // as shot; 0 unknown (RAW and .npy only)
    double memory;           // bytes that reading it takes
    double gain;             // brings the photo to the capture's exposure
    double flash_gain;       // then its flash is so many times the other flash photos'

    // known after development
    FsError failure;                            // code 0: the photo is good
    bool encoded;                               // came as display values: reduced quality
    bool untold;                                // nothing says whether its values are linear; taken to be
    bool unread;                                // its colour profile cannot be read; taken for sRGB
    int width, height, orig_width, orig_height; // upright
    double clipped;                             // fraction of the working image
    double mean;                                // of the working image's linear values
    double brightness;                          // mean of its tone-mapped values

    // for findings.h
    Look look;
    double look_gain; // that the look's light was multiplied by
    double sharpness; // detail as a share of its neighbours', in the worst direction
    bool odd_light;   // as bright as photos of the other lighting
    int beside;       // the nearest photo of the other lighting, -1: none
    int twin_of;      // an earlier photo that shows the same (alike.h), -1: none
    bool stranger;    // shows another place than the others
} PhotoFile;

typedef struct Photos {
    char *folder;
    PhotoFile *photo; // sorted by name, numbers in it as such
    int n;
    double white_balance[3]; // of the whole capture
    SensorLevels npy;        // of the .npy files
    const char *masks;       // folder of masks, the settings'; NULL or "": none
    int left_out;            // photos that were dropped as failed
    char left_out_names[200];
    FsError left_out_why; // of the first
    int copies;           // photos that were dropped as copies
    char copies_names[200];
} Photos;

void fs_photos_free(Photos *photos);
// The photos in `folder`, and where it has none those in its subfolders: a RAW file is taken where a JPEG is of
// the same name and shot, copies ("IMG_1 (1).JPG") are left out; other equal names get their folder's before them, or
// are an error.
int fs_photos_scan(Photos *photos, const char *folder, const Log *log, FsError *err);
int fs_photos_list(Photos *photos, const Log *log, FsError *err); // for scan: every file of photos->folder
// UTF-8, not too long for a file name, without what breaks lines of text files (COLMAP's) or means a folder, here or
// elsewhere. NULL: out of memory.
char *fs_photos_view_name(const char *path);
// What is not UTF-8 is taken for Latin-1, as old cards and archives have it. NULL: out of memory.
char *fs_photos_utf8(const char *text);
bool fs_photos_same_folder(const PhotoFile *a, const PhotoFile *b);
void fs_photos_drop(PhotoFile *photo);     // frees it; it has no path then
void fs_photos_close_gaps(Photos *photos); // where photos were dropped
// Shots that are there twice are left with one file, RAW before others. Any order before and after.
void fs_photos_drop_twice(Photos *photos, const Log *log);
// The name of what "IMG_1 (1)", "IMG_1 copy 2", "IMG_1 - Copy" or "Copy of IMG_1" is a copy of; NULL: it is none.
char *fs_photos_copied_name(const char *name);
int fs_photos_take_instead(PhotoFile *photo); // there must be one; what was read of the other file is to be read again
// Where too many photos failed whose shots are there as JPEG too, takes these for all that have one: true, and then
// they are to be read from the header on.
bool fs_photos_take_jpegs(Photos *photos, const Log *log);
FilePath fs_photos_path(const Photos *photos, const PhotoFile *photo);
// Of the names and contents of the photos, their masks and of the list of flash photos (may be NULL): tells whether
// anything changed since the last time.
void fs_photos_fingerprint(const Photos *photos, const char *flash_list, char text[17]);
// The mask of a photo in photos->masks, as COLMAP names it: PHOTO.png, of the photo's whole name, of the one without
// extension or of its JPEG's, in any case of letters; in the subfolder that the photo is in, or without it where no other
// photo could be meant. False where there is none.
bool fs_photos_mask(const Photos *photos, const PhotoFile *photo, FilePath *path);
FilePath fs_photos_mask_folder(const Photos *photos, const PhotoFile *photo); // in photos->masks
// What the settings say of .npy files.
int fs_photos_levels(SensorLevels *npy, const Settings *set, FsError *err);
SensorLevels fs_photos_developed(const Photos *photos); // what all photos are read with
// Bytes that the photos which are read at the same time may take; one may take more.
#define FS_PHOTOS_AT_ONCE 2e9
// Of the n values that are above 0; the lower one of two in the middle, so that it is some photo's own. 0: none.
double fs_photos_median(const double *value, int n);
// exposure: (n) of EXIF (exif.h). What a photo does not tell is taken to be as with the others; 0: its shutter time is
// not known.
void fs_photos_exposures(const Photos *photos, double *exposure);
// Headers of all photos; those that cannot be read get a failure.
void fs_photos_read_headers(Photos *photos, Threads *threads);
// Drops the photos that failed, each with a warning; an error when they are more than one in three.
#define FS_PHOTOS_MOST_FAILED 3
int fs_photos_drop_failed(Photos *photos, const Log *log, FsError *err);

// A photo before it of the same lighting has the same pixels. Looks and flash states must be there.
bool fs_photos_is_copy(const Photos *photos, const PhotoFile *photo);
void fs_photos_drop_copies(Photos *photos);

// By EXIF, the name of the folder, the photo's own name where EXIF is silent, or the settings flash-glob and
// flash-list, which add up; photos that do not tell get a failure, but where none needs to.
int fs_photos_mark_flash(Photos *photos, const Settings *set, const Log *log, FsError *err);
// Flash or not, as fs_photos_mark_flash; then drops the photos that failed. An error unless both kinds are there.
int fs_photos_find_flash(Photos *photos, const FsProject *project, FsError *err);
int fs_photos_check_groups(const Photos *photos, const FsProject *project, FsError *err);
// How many photos without and with flash the settings ask for at least.
enum { FS_PHOTOS_FOR_COLMAP = 5 };
void fs_photos_fewest(const Settings *set, bool by_colmap, int fewest[2]);
