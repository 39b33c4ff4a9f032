#include "export/tsdf.h"

#include <math.h>
#include <stdlib.h>

#define REACH 4 // steps: the noise of depth, and enough for a surface to lie between known voxels

int fs_tsdf_new(Tsdf *tsdf, const double box[2][3], double step, double most, FsError *err)
{
    *tsdf = (Tsdf){0};
    double n[3];
    bool bounded = step > 0 && isfinite(step);
    for (int a = 0; a < 3; a++) bounded &= isfinite(box[1][a] - box[0][a]);
    if (!bounded)
        return fs_error_set(err, FS_ERR_NUMERIC, "export: no mesh: the depth of the transmitted scene has no bounds");
    for (;; step *= 1.05) {
        for (int a = 0; a < 3; a++) n[a] = fmax(ceil((box[1][a] - box[0][a]) / step), 1) + 1;
        if (n[0] * n[1] * n[2] <= most) break;
    }
    tsdf->step = step;
    tsdf->reach = REACH * step;
    for (int a = 0; a < 3; a++) tsdf->size[a] = (int)n[a], tsdf->origin[a] = box[0][a];
    size_t total = (size_t)(n[0] * n[1] * n[2]);
    tsdf->distance = calloc(total, sizeof(float));
    tsdf->weight = calloc(total, sizeof(float));
    if (tsdf->distance && tsdf->weight) return 0;
    fs_tsdf_free(tsdf);
    return fs_error_memory(err);
}

void fs_tsdf_free(Tsdf *tsdf)
{
    free(tsdf->distance);
    free(tsdf->weight);
    *tsdf = (Tsdf){0};
}

typedef struct FuseJobs {
    Tsdf *tsdf;
    const Camera *camera;
    const Image *depth;
} FuseJobs;

static void fuse_voxel(const FuseJobs *jobs, const double in_camera[3], size_t at)
{
    const Camera *camera = jobs->camera;
    double z = in_camera[2];
    if (!(z > 0)) return;
    double px = camera->fx * in_camera[0] / z + camera->cx, py = camera->fy * in_camera[1] / z + camera->cy;
    if (!(px >= 0 && py >= 0 && px < jobs->depth->width && py < jobs->depth->height)) return;
    double seen = (double)*fs_image_at(jobs->depth, (int)px, (int)py);
    double distance = (seen - z) / jobs->tsdf->reach;
    if (!(seen > 0) || distance < -1) return;
    float *mean = &jobs->tsdf->distance[at], *weight = &jobs->tsdf->weight[at];
    *mean += ((float)fmin(distance, 1) - *mean) / (*weight + 1);
    *weight += 1;
}

static void fuse_slice(void *context, int job, int worker)
{
    (void)worker;
    const FuseJobs *jobs = context;
    const Tsdf *tsdf = jobs->tsdf;
    const double *m = jobs->camera->w2c, z = tsdf->origin[2] + job * tsdf->step;
    for (int j = 0; j < tsdf->size[1]; j++) {
        double y = tsdf->origin[1] + j * tsdf->step;
        for (int i = 0; i < tsdf->size[0]; i++) {
            double x = tsdf->origin[0] + i * tsdf->step, in_camera[3];
            for (int a = 0; a < 3; a++)
                in_camera[a] = m[4 * a] * x + m[4 * a + 1] * y + m[4 * a + 2] * z + m[4 * a + 3];
            fuse_voxel(jobs, in_camera, fs_tsdf_at(tsdf, i, j, job));
        }
    }
}

void fs_tsdf_fuse(Tsdf *tsdf, const Camera *camera, const Image *depth, Threads *threads)
{
    FuseJobs jobs = {tsdf, camera, depth};
    fs_threads_for(threads, tsdf->size[2], fuse_slice, &jobs);
}
