// INRIA's PLY: positions, unused normals, degree-0 colour, opacity logit, log scales, unit quaternions.
#include "base/file.h"
#include "export/formats.h"

static const char *const properties[] = {
    "x",       "y",       "z",       "nx",      "ny",    "nz",    "f_dc_0", "f_dc_1", "f_dc_2",
    "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2",  "rot_3",
};
#define N_PROPERTIES (sizeof properties / sizeof *properties)

int fs_inria_write(const Splats *splats, const char *path, FsError *err)
{
    AtomicFile file;
    MUST(fs_file_begin(&file, path, err));
    fprintf(file.f, "ply\nformat binary_little_endian 1.0\nelement vertex %d\n", splats->n);
    for (size_t p = 0; p < N_PROPERTIES; p++) fprintf(file.f, "property float %s\n", properties[p]);
    fprintf(file.f, "end_header\n");
    for (size_t i = 0; i < (size_t)splats->n; i++) {
        const float *mean = splats->mean + 3 * i, *scale = splats->scale + 3 * i, *rotation = splats->rotation + 4 * i;
        float dc[3];
        for (int c = 0; c < 3; c++) dc[c] = (float)(((double)splats->srgb[3 * i + (size_t)c] - 0.5) / FS_SPLATS_SH0);
        const float row[N_PROPERTIES] = {
            mean[0],     mean[1],     mean[2],  0,           0,
            0,           dc[0],       dc[1],    dc[2],       splats->opacity[i],
            scale[0],    scale[1],    scale[2], rotation[0], rotation[1],
            rotation[2], rotation[3],
        };
        fwrite(row, sizeof row, 1, file.f);
    }
    return fs_file_commit(&file, err);
}
