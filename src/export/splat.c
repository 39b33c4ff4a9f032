// .splat: position and scale as floats, colour, opacity and rotation as bytes, no header.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/order.h"
#include "export/viewers.h"

static double opacity_of(const Cloud *cloud, size_t i)
{
    return 1.0 / (1.0 + exp(-(double)cloud->field[CLOUD_OPACITIES][i]));
}

static unsigned char to_byte(double v) // rounded, clamped
{
    return v <= 0 ? 0 : v >= 255 ? 255 : (unsigned char)(v + 0.5);
}

int fs_splat_write(const Cloud *cloud, const float *srgb, const char *path, FsError *err)
{
    int rc;
    AtomicFile file = {0};
    Ranked *rank = malloc(sizeof *rank * ((size_t)cloud->n + 1)); // by volume times opacity, falling
    if (!rank) return fs_error_memory(err);
    for (int i = 0; i < cloud->n; i++) {
        const float *s = cloud->field[CLOUD_SCALES] + (size_t)i * 3;
        rank[i] = (Ranked){-exp((double)s[0] + (double)s[1] + (double)s[2]) * opacity_of(cloud, (size_t)i), i};
    }
    fs_order_ranked(rank, (size_t)cloud->n);
    TRY(fs_file_begin(&file, path, err));
    for (int k = 0; k < cloud->n; k++) {
        size_t i = (size_t)rank[k].index;
        unsigned char row[32];
        float scale[3], rotation[4];
        for (size_t a = 0; a < 3; a++) scale[a] = expf(cloud->field[CLOUD_SCALES][3 * i + a]);
        fs_rotation_unit(cloud->field[CLOUD_QUATS] + 4 * i, rotation);
        memcpy(row, cloud->field[CLOUD_MEANS] + 3 * i, 12);
        memcpy(row + 12, scale, 12);
        for (size_t c = 0; c < 3; c++) row[24 + c] = to_byte(255.0 * (double)srgb[3 * i + c]);
        row[27] = to_byte(255.0 * opacity_of(cloud, i));
        for (size_t a = 0; a < 4; a++) row[28 + a] = to_byte(128.0 * (double)rotation[a] + 128.0);
        fwrite(row, sizeof row, 1, file.f);
    }
    TRY(fs_file_commit(&file, err));
fail:
    fs_file_abort(&file);
    free(rank);
    return rc;
}
