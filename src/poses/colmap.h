// COLMAP as a program: features of the pictures, verified matches, and poses.
#pragma once

#include "model/colmap_model.h"
#include "model/project.h"
#include "poses/capture.h"
#include "poses/database.h"

enum {
    FS_COLMAP_FEW_FEATURES = 50, // of a photo
    FS_COLMAP_FEW_MATCHES = 15,  // verified ones, that a pose is asked for
};

typedef struct Colmap {
    const FsProject *project;
    const Capture *capture;
    char *dir, *database, *log_path; // OUT/.flashsplat/colmap, its database.db and log.txt
    bool renamed_options;            // COLMAP 3.13 calls them FeatureExtraction and FeatureMatching,
    bool renamed_size;               // and the most pixels too
    Database *db;
    int *image_id; // per photo of the capture
} Colmap;

// The longer side of the pictures in which features are looked for, at most, for a working image of such a one.
int fs_colmap_feature_edge(const FsProject *project, int long_edge);
int fs_colmap_check(const FsProject *project, FsError *err); // that there is such a program, and OUT is a place for it
// Checks that, starts its folder and enters the photos.
int fs_colmap_open(Colmap *colmap, const FsProject *project, const Capture *capture, FsError *err);
void fs_colmap_close(Colmap *colmap);

// Finds the features of all pictures. features (capture->n), each to be freed with fs_database_features_free.
int fs_colmap_extract(Colmap *colmap, Features *features, FsError *err);
// Enters the matches of fs_match_all and has COLMAP keep those that two views can explain.
int fs_colmap_verify(Colmap *colmap, const MatchList *list, FsError *err);
// Incremental reconstruction of the photos of a group (-1: all; 0, 1: without, with flash): the model with most photos.
// Empty where COLMAP says that it found none; an error where it failed otherwise.
int fs_colmap_map(Colmap *colmap, int group, ColmapModel *model, FsError *err);
// Bundle adjustment of the model in folder `from` into folder `to`: poses, focal lengths and distortion.
int fs_colmap_adjust(Colmap *colmap, const char *from, const char *to, FsError *err);
