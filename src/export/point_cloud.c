// The middles of the Gaussians that are at least half opaque, as plain coloured points.
#include <stdlib.h>
#include <string.h>

#include "export/formats.h"

int fs_point_cloud_write(const Splats *splats, const char *path, FsError *err)
{
    size_t size = (size_t)splats->n + 1;
    float *xyz = malloc(sizeof(float) * 3 * size);
    unsigned char *rgb = malloc(3 * size);
    int n = 0, rc = 0;
    if (!xyz || !rgb) TRY(fs_error_memory(err));
    for (size_t i = 0; i < (size_t)splats->n; i++) {
        if (splats->opacity[i] < 0) continue;
        memcpy(xyz + 3 * n, splats->mean + 3 * i, 12);
        for (size_t c = 0; c < 3; c++)
            rgb[3 * (size_t)n + c] = (unsigned char)fs_splats_level(255 * (double)splats->srgb[3 * i + c], 255);
        n++;
    }
    TRY(fs_cloud_points_write(path, n, xyz, rgb, NULL, err));
fail:
    free(xyz);
    free(rgb);
    return rc;
}
