// Lamps that the start found behind the pane (initialise/lamp_depth.h), in the photos: others are held for mirrored at
// first.
#include <stdlib.h>

#include "base/file.h"
#include "model/points_ply.h"
#include "train/trainer.h"

// The cell that shows a place, and those around it, for the lamp's edge.
static void mark(const Camera *camera, const float xyz[3], unsigned char *cells)
{
    double pixel[2];
    if (!(fs_camera_sees(camera, (const double[3]){xyz[0], xyz[1], xyz[2]}, pixel) > 0)) return;
    int x = (int)(pixel[0] * OCCLUSION_WIDTH / camera->width), y = (int)(pixel[1] * OCCLUSION_HEIGHT / camera->height);
    for (int v = y - 1; v <= y + 1; v++)
        for (int u = x - 1; u <= x + 1; u++)
            if (u >= 0 && u < OCCLUSION_WIDTH && v >= 0 && v < OCCLUSION_HEIGHT) cells[v * OCCLUSION_WIDTH + u] = 1;
}

int fs_lamps_behind_read(Trainer *trainer, FsError *err)
{
    FilePath path = fs_file_at("%s/start/lamps.ply", trainer->project->out);
    float *xyz = NULL;
    int rc = 0, n = 0;
    trainer->lamps = calloc((size_t)trainer->n_views, OCCLUSION_CELLS);
    if (!trainer->lamps) TRY(fs_error_memory(err));
    if (!fs_file_exists(path.text)) return 0; // radiance fields have none
    TRY(fs_points_ply_read(path.text, &xyz, &n, err));
    for (int v = 0; v < trainer->n_views; v++)
        for (int i = 0; i < n; i++)
            mark(&trainer->views[v]->camera, xyz + 3 * (size_t)i, trainer->lamps + (size_t)OCCLUSION_CELLS * (size_t)v);
fail:
    free(xyz);
    return rc;
}
