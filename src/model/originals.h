// Where the photos of a project are: OUT/originals.json has their folder, as ingest found it.
#pragma once

#include "model/dataset.h"
#include "model/photos.h"

// Writes the folder down, unless that is what stands there.
int fs_originals_remember(const FsProject *project, const char *folder, FsError *err);
// An error where there is no such folder, and it is not the name of the one that stands there: that may be gone.
int fs_originals_check(const FsProject *project, const char *folder, FsError *err);
int fs_originals_folder(const FsProject *project, FilePath *folder, FsError *err); // or as the setting "originals" says

// The photos of all views, as ingest levelled them: Photos.white_balance, PhotoFile.gain. From the setting "originals",
// or where they were. An error where one is not there.
typedef struct Originals {
    Photos photos;
    int *of_view; // (views) index in photos
} Originals;
int fs_originals_open(Originals *originals, const FsProject *project, const Dataset *views, FsError *err);
void fs_originals_free(Originals *originals);
