// The samples of a ray through a radiance field: as many steps of equal disparity, of which those are taken whose cell
// of the volume's grid is not known to be empty.
#ifndef FS_ENGINE_VOLUME_MARCH_H
#define FS_ENGINE_VOLUME_MARCH_H

#include "model/radiance.h"

typedef struct VolumeMarch {
    float origin[3], dx[3], dy[3],
        base[3];            // the ray of pixel (x, y) in the frame, z of the camera 1: base + x dx + y dy
    float low[2], scale[2]; // of the frame
    float near, closing;    // 1 - near / far
    int samples, grid;
    const uint32_t *occupied; // bits by cell
    int every;                // one of so many samples is taken, and stands for all of them
    uint64_t jitter;          // of a training step; 0: samples lie in the middle of their steps
} VolumeMarch;

// Places of samples: in the field's cube; depth and disparity along the camera's axis.
typedef struct VolumePlaces {
    float *at[3], *z, *s;
} VolumePlaces;

// occupied: bits as fs_volume_march_occupied makes them, borrowed; jitter, every: as in VolumeMarch.
VolumeMarch fs_volume_march(const Radiance *field, const Camera *camera, const uint32_t *occupied, uint64_t jitter,
                            int every);
// The samples of the ray of a pixel; returns how many. places NULL: only that.
int fs_volume_march_ray(const VolumeMarch *march, int x, int y, const VolumePlaces *places);
// Spherical harmonics up to degree 3 of the ray's direction.
void fs_volume_march_direction(const VolumeMarch *march, int x, int y, float out[RADIANCE_DIRECTION]);

// Which cells are not known to be empty; bits: (grid^3 + 31) / 32 words.
void fs_volume_march_occupied(const Radiance *field, Volume volume, uint32_t *bits);

#endif
