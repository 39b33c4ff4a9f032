// The surface of the transmitted scene, as a mesh: depth of T as the photos' cameras see it, fused in a grid.
#pragma once

#include "export/colors.h"
#include "export/mesh.h"
#include "model/dataset.h"
#include "model/project.h"

typedef struct SurfaceArgs {
    const FsProject *project;
    const Scene *scene;
    const Dataset *photos;
    const Development *development;
} SurfaceArgs;

// Writes export/T_N.<ending> and export/T_F.<ending>, which are alike where the flash does not light T: one geometry,
// two colours.
int fs_surface_run(const SurfaceArgs *args, const char *ending, FsError *err);
