// Curtains: Gaussians that hang right before a camera and cover much of what it sees. Nothing that is behind the pane
// or mirrored in it is so near. Where a scene is dark, and so lets its rays pass, they would close (the term `opaque`)
// in the place of what is behind them, draw copies of themselves, and the scene would be lost. They are made
// transparent, and relocated as what is dead.
#include <stdlib.h>

#include "base/memory.h"
#include "base/order.h"
#include "train/cloud_edit.h"
#include "train/train_constants.h"
#include "train/trainer.h"

static void see(const Camera *camera, const float *mean, double p[3])
{
    const double *m = camera->w2c;
    for (int k = 0; k < 3; k++)
        p[k] =
            m[4 * k] * (double)mean[0] + m[4 * k + 1] * (double)mean[1] + m[4 * k + 2] * (double)mean[2] + m[4 * k + 3];
}

// Depth of what is nearest of a cloud to a camera; 0: it sees none of it. scratch: (CURTAIN_ASKED)
static double nearest_of(const Cloud *cloud, const Camera *camera, double *scratch)
{
    size_t seen = 0;
    for (int i = 0; i < cloud->n; i++) {
        double p[3];
        if (!fs_order_is_some(i, cloud->n, CURTAIN_ASKED)) continue;
        if (fs_cloud_edit_sigmoid(cloud->field[CLOUD_OPACITIES][i]) <= ENGINE_DEAD) continue;
        see(camera, cloud->field[CLOUD_MEANS] + 3 * i, p);
        double x = p[2] > 0 ? camera->fx * p[0] / p[2] + camera->cx : -1;
        double y = p[2] > 0 ? camera->fy * p[1] / p[2] + camera->cy : -1;
        if (x >= 0 && y >= 0 && x < camera->width && y < camera->height) scratch[seen++] = p[2];
    }
    fs_order_doubles(scratch, seen);
    return seen ? scratch[(size_t)(CURTAIN_NEAREST * (double)seen)] : 0;
}

// Wide: by the two larger of its axes.
static bool hangs_before(const Cloud *cloud, int i, const Camera *camera, double nearest)
{
    const float *s = cloud->field[CLOUD_SCALES] + 3 * i;
    double least = fmin(fmin((double)s[0], (double)s[1]), (double)s[2]), p[3];
    double width = exp(0.5 * ((double)s[0] + (double)s[1] + (double)s[2] - least));
    see(camera, cloud->field[CLOUD_MEANS] + 3 * i, p);
    double distance = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    return distance < CURTAIN_NEAR * nearest && p[2] > -width && width > CURTAIN_WIDE * distance;
}

int fs_curtains_open(Trainer *trainer, FsError *err)
{
    Scene *scene = &trainer->scene;
    double *scratch = malloc(sizeof *scratch * (CURTAIN_ASKED + 1));
    if (!scratch) return fs_error_memory(err);
    for (int v = 0; v < trainer->n_views; v++) {
        const Camera *camera = &trainer->views[v]->camera;
        if (!fs_order_is_some(v, trainer->n_views, CURTAIN_VIEWS)) continue;
        double nearest = nearest_of(&scene->cloud[LAYER_T_N], camera, scratch);
        for (int l = 0; l < LAYER_BETA; l++)
            for (int i = 0; i < scene->cloud[l].n; i++)
                if (hangs_before(&scene->cloud[l], i, camera, nearest))
                    scene->cloud[l].field[CLOUD_OPACITIES][i] = fs_cloud_edit_logit(ENGINE_DEAD / 2);
    }
    free(scratch);
    return 0;
}
