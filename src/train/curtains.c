// Curtains: Gaussians that hang right before a camera and cover much of what it sees. Nothing that is behind the pane
// or mirrored in it is so near. Where a scene is dark, and so lets its rays pass, they would close (the term `opaque`)
// in the place of what is behind them, draw copies of themselves, and the scene would be lost. They are made
// transparent, and relocated as what is dead.
#include <stdlib.h>

#include "base/linalg.h"
#include "base/order.h"
#include "train/cloud_edit.h"
#include "train/train_constants.h"
#include "train/trainer.h"

static void place_of(const Cloud *cloud, int i, double world[3])
{
    for (int k = 0; k < 3; k++) world[k] = (double)cloud->field[CLOUD_MEANS][3 * i + k];
}

// Depth of what is nearest of a cloud to a camera; 0: it sees none of it. scratch: (CURTAIN_ASKED)
static double nearest_of(const Cloud *cloud, const Camera *camera, double *scratch)
{
    size_t seen = 0;
    for (int i = 0; i < cloud->n; i++) {
        double world[3], pixel[2];
        if (!fs_order_is_some(i, cloud->n, CURTAIN_ASKED)) continue;
        if (fs_cloud_edit_sigmoid(cloud->field[CLOUD_OPACITIES][i]) <= OPACITY_DEAD) continue;
        place_of(cloud, i, world);
        double depth = fs_camera_sees(camera, world, pixel);
        if (depth > 0) scratch[seen++] = depth;
    }
    fs_order_doubles(scratch, seen);
    return seen ? scratch[(size_t)(CURTAIN_NEAREST * (double)seen)] : 0;
}

// Wide: by the two larger of its axes.
static bool hangs_before(const Cloud *cloud, int i, const Camera *camera, double nearest)
{
    const float *s = cloud->field[CLOUD_SCALES] + 3 * i;
    double world[3], pixel[2], eye[3];
    place_of(cloud, i, world);
    fs_camera_centre(camera, eye);
    double distance = sqrt(v3_distance2(world, eye));
    if (distance >= CURTAIN_NEAR * nearest) return false; // nearly all
    double least = fmin(fmin((double)s[0], (double)s[1]), (double)s[2]);
    double width = exp(0.5 * ((double)s[0] + (double)s[1] + (double)s[2] - least));
    return width > CURTAIN_WIDE * distance && fs_camera_project(camera, world, pixel) > -width;
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
                    scene->cloud[l].field[CLOUD_OPACITIES][i] = fs_cloud_edit_logit(OPACITY_DEAD / 2);
    }
    free(scratch);
    return 0;
}
