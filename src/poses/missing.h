// Photos that have no pose: said by name, and why.
#pragma once

#include "poses/sparse.h"

// "a, b, c and 4 more".
void fs_missing_names(const Sparse *sparse, const Capture *capture, char *text, size_t size);
// A warning for each, by what COLMAP found in common with the others; not where it found few features: that is said
// then.
int fs_missing_explain(const Colmap *colmap, const Features *features, const Sparse *sparse, FsError *err);
