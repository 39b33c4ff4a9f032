// The surface of the transmitted scene, as a mesh: depth of T as the photos' cameras see it, fused in a grid.
#pragma once

#include "export/colors.h"

// Writes export/T_N.<ending> and export/T_F.<ending>, which are alike where the flash does not light T: one geometry,
// two colours.
int fs_surface_run(const ExportArgs *args, const char *ending, FsError *err);
