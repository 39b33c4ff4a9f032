#include "export/formats.h"

#include <limits.h>

// clang-format off
#define SPZ_SIZES {-10, 255 / 16.0f - 10}

// docs/export.md says who opens which.
const Format fs_formats[FORMATS] = {
    {"ply", "ply", SPLATS_AS_TRAINED, false, INT_MAX, fs_inria_write},
    {"splat", "splat", SPLATS_BY_VISIBILITY, false, INT_MAX, fs_splat_write},
    {"spz", "spz", SPLATS_BY_PLACE, true, 10000000, fs_spz_write, SPZ_SIZES}, // Niantic's own reader took no more for long
    {"spz2", "v2.spz", SPLATS_BY_PLACE, true, 10000000, fs_spz_write_old, SPZ_SIZES},
    {"sog", "sog", SPLATS_BY_PLACE, false, 100000000, fs_sog_write}, // of a ZIP's 4 GiB
    {"compressed", "compressed.ply", SPLATS_BY_PLACE, false, INT_MAX, fs_compressed_ply_write},
    {"glb", "glb", SPLATS_AS_TRAINED, true, 70000000, fs_glb_write}, // of 4 GiB
    {"points", "points.ply", SPLATS_AS_TRAINED, false, INT_MAX, fs_point_cloud_write},
    {"mesh", "mesh.ply", SPLATS_AS_TRAINED, false, 0, NULL},
};
// clang-format on
