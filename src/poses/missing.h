// Photos that have no pose: said by name, and why.
#pragma once

#include "poses/sparse.h"

// "a, b, c and 4 more".
void fs_missing_names(const Sparse *sparse, const Capture *capture, char *text, size_t size);
// A warning for each, by what COLMAP found in it and in common with the others.
void fs_missing_explain(const Colmap *colmap, const Features *features, const Sparse *sparse);
