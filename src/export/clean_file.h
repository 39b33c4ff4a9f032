// A cleaned photo as files: in display values with its colour profile, or linear as its camera saw it.
#pragma once

#include "export/clean.h"

typedef struct CleanPicture {
    const char *name;            // of the view
    PhotoFile photo;             // it was made of: a copy, into which its header is read again
    FilePath path;               // of that
    bool encoded;                // it was a picture for eyes already
    const double *white_balance; // that it was developed with
    Image rgb;                   // linear, white-balanced, in the photo's exposure, upright
} CleanPicture;

// In each format wanted. The picture's values are used up.
int fs_clean_file_write(const CleanArgs *args, CleanPicture *picture, Threads *threads, FsError *err);
