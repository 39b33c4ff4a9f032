// COLMAP's database: cameras and photos into it, features out of it, matches into it.
#pragma once

#include "base/error.h"
#include "model/lens.h"
#include "poses/features.h"

typedef struct Database Database;

int fs_database_open(Database **database, const char *path, FsError *err); // COLMAP made it
void fs_database_close(Database *database);
// Databases of COLMAP 3.12 and later know rigs and frames; photos must then be entered by COLMAP itself. 1 or 0.
int fs_database_has_frames(Database *database, FsError *err);

// focal_known: COLMAP's prior_focal_length.
int fs_database_add_camera(Database *database, int id, const Lens *lens, bool focal_known, FsError *err);
int fs_database_add_image(Database *database, int id, const char *name, int camera_id, FsError *err);
// Number of a photo by its file name; 0 when missing.
int fs_database_image(Database *database, const char *name, FsError *err);
int fs_database_features(Database *database, int image_id, Features *features, FsError *err);
void fs_database_features_free(Features *features);
// The pair must not be there yet. a of a match is a feature of image_id1.
int fs_database_add_matches(Database *database, int image_id1, int image_id2, const MatchList *matches, FsError *err);
// How many matches of two photos COLMAP kept; 0 where there are none.
int fs_database_verified(Database *database, int image_id1, int image_id2, FsError *err);
// All writes between begin and end are one transaction.
int fs_database_begin(Database *database, FsError *err);
int fs_database_end(Database *database, FsError *err);
