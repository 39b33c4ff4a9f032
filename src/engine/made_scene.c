#include "engine/made_scene.h"

#include <math.h>

#include "base/rng.h"

Scene fs_made_scene(void)
{
    return (Scene){.shared_geometry = true,
                   .pane_beta = true,
                   .pane = {{0.5, 0, -0.866}, 0.1, 0.1},
                   .gain_color = {1.5, 1.4, 1.3},
                   .flash_distance = 3,
                   .extent = 0.5,
                   .flash_return = 0.1};
}

Camera fs_made_scene_camera(int width, int height)
{
    return (Camera){width, height, width, width, 0.5 * width, 0.5 * height, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
}

void fs_made_scene_fill(Cloud *cloud, double size)
{
    Rng rng = fs_rng_new(3);
    for (int i = 0; i < cloud->n; i++) {
        float *mean = cloud->field[CLOUD_MEANS] + 3 * i, z = 2 + 4 * fs_rng_uniform(&rng);
        mean[0] = (fs_rng_uniform(&rng) - 0.5f) * z * 1.05f;
        mean[1] = (fs_rng_uniform(&rng) - 0.5f) * z * 0.75f;
        mean[2] = z;
        float scale = (float)log(size) + 0.5f * fs_rng_normal(&rng);
        for (int k = 0; k < 3; k++) cloud->field[CLOUD_SCALES][3 * i + k] = scale + 0.5f * fs_rng_normal(&rng);
        for (int k = 0; k < 4; k++) cloud->field[CLOUD_QUATS][4 * i + k] = fs_rng_normal(&rng);
        cloud->field[CLOUD_OPACITIES][i] = -2.5f + fs_rng_normal(&rng);
        for (int k = 0, c = cloud->width[CLOUD_COLORS]; k < c; k++)
            cloud->field[CLOUD_COLORS][c * i + k] = fs_rng_uniform(&rng);
    }
}

int fs_made_scene_load(Engine *engine, const Camera *camera, FsError *err)
{
    Image photo = {0}, mask = {0};
    int rc;
    TRY(fs_image_new(&photo, camera->width, camera->height, 3, err));
    TRY(fs_image_new(&mask, camera->width, camera->height, 1, err));
    for (size_t i = 0; i < fs_image_pixels(&mask); i++) mask.px[i] = 1;
    for (size_t i = 0; i < fs_image_values(&photo); i++) photo.px[i] = 0.2f + 0.15f * sinf(0.05f * (float)i);
    for (int flash = 0; flash < 2; flash++)
        TRY(fs_engine_load_view(engine, &(EngineView){camera, flash, &photo, &mask}, err));
fail:
    fs_image_free(&photo);
    fs_image_free(&mask);
    return rc;
}
