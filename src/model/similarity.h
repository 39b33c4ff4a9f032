// Similarities (scale, rotation, shift) between two frames that show the same scene.
#pragma once

#include "base/error.h"
#include "model/camera.h"

typedef struct Similarity {
    double scale, r[9], t[3]; // y = scale R x + t
} Similarity;

// Least-squares similarity that takes from[i] to to[i] (Umeyama 1991). Error when n < 3 or the points are on a line.
int fs_similarity_fit(const double (*from)[3], const double (*to)[3], int n, Similarity *similarity, FsError *err);
// The same out of the same views posed in both frames; also uses where they look, so that views on a line are enough.
int fs_similarity_fit_cameras(const Camera *from, const Camera *to, int n, Similarity *similarity, FsError *err);
// Many pairs with wrong ones among them: random samples, the one with most pairs within `tolerance` (units of `to`),
// then least squares on those. *inliers gets their number.
int fs_similarity_fit_robust(const double (*from)[3], const double (*to)[3], int n, double tolerance,
                             Similarity *similarity, int *inliers, FsError *err);

void fs_similarity_apply(const Similarity *similarity, const double x[3], double y[3]); // y = scale R x + t
// The camera after its world moved by the similarity: sees y where it saw x.
Camera fs_similarity_camera(const Similarity *similarity, const Camera *camera);
