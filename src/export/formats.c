#include "export/formats.h"

#include <limits.h>

// clang-format off
const Format fs_formats[FORMATS] = {
    {"ply", "ply", "as the INRIA program writes it, for editors and viewers of Gaussian splats",
     SPLATS_AS_TRAINED, false, INT_MAX, fs_inria_write},
    {"splat", "splat", "for older viewers in a browser",
     SPLATS_BY_VISIBILITY, false, INT_MAX, fs_splat_write},
    {"spz", "spz", "SPZ version 3: a quarter of the size, for phones and viewers in a browser",
     SPLATS_BY_PLACE, true, 10000000, fs_spz_write}, // Niantic's own reader took no more for long
    {"spz2", "v2.spz", "SPZ version 2, for older programs",
     SPLATS_BY_PLACE, true, 10000000, fs_spz_write_old},
    {"sog", "sog", "SOG version 2: the smallest, for PlayCanvas and SuperSplat",
     SPLATS_BY_PLACE, false, 100000000, fs_sog_write}, // of a ZIP's 4 GiB
    {"compressed", "compressed.ply", "PlayCanvas's compressed PLY",
     SPLATS_BY_PLACE, false, INT_MAX, fs_compressed_ply_write},
    {"glb", "glb", "glTF with KHR_gaussian_splatting; R's has the pane",
     SPLATS_AS_TRAINED, true, 70000000, fs_glb_write}, // of 4 GiB
    {"points", "points.ply", "plain coloured points, for MeshLab and CloudCompare",
     SPLATS_AS_TRAINED, false, INT_MAX, fs_point_cloud_write},
    {"mesh", "mesh.ply", "the surface of T as triangles, for Blender and MeshLab",
     SPLATS_AS_TRAINED, false, 0, NULL},
};
// clang-format on
