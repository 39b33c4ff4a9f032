// What an engine keeps for a scene of radiance fields: which cells of the grids are empty, gradients, and the samples
// of the pass under way. fs_raster_volumes is the rasteriser of such scenes: it fills the same planes as those of
// clouds.
#ifndef FS_ENGINE_RASTER_VOLUMES_H
#define FS_ENGINE_RASTER_VOLUMES_H

#include "engine/raster_pass.h"
#include "engine/volume_net.h"

typedef struct VolumesWork {
    Radiance *field;
    uint32_t *occupied[VOLUMES];
    // between backward and update
    float *grad;                     // (n) like field->x; 0 between steps
    unsigned char *touched[VOLUMES]; // rows of the tables that have gradients
    long samples[VOLUMES], rays;     // of the last forward that trains
    // of a pass
    Arena arena;
    struct VolumePass *pass[VOLUMES];
} VolumesWork;

int fs_raster_volumes_open(VolumesWork *work, Radiance *field, FsError *err); // field: stays the caller's
void fs_raster_volumes_close(VolumesWork *work);
int fs_raster_volumes_need_gradients(VolumesWork *work, FsError *err); // before the first pass that trains
extern const Rasteriser fs_raster_volumes;

#endif
