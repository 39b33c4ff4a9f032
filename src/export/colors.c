// Colours for viewers: the layer's linear camera RGB, then exposure, shoulder and sRGB.
#include "export/colors.h"

#include <math.h>

#include "base/linalg.h"
#include "image/tone.h"

const Cloud *fs_colors_cloud(const Scene *scene, Layer layer)
{
    bool of_T_N = layer == LAYER_T_F && scene->shared_geometry;
    const Cloud *cloud = &scene->cloud[of_T_N ? LAYER_T_N : layer];
    return cloud->n && !(of_T_N && !fs_scene_lit(scene)) ? cloud : NULL;
}

// What the flash makes of Gaussian i, from the middle of the photos' cameras: near things are brighter by it, as
// in photos (kernels/shade_body.h). Without that the falloff is 1.
static double flash_falloff(const Scene *scene, const float mean[3], const Development *development)
{
    if (!development->has_eye || scene->separation == SEPARATION_LINEAR) return 1;
    double unit = scene->flash_distance * scene->flash_distance;
    double d2 = v3_distance2((const double[3]){mean[0], mean[1], mean[2]}, development->eye);
    return unit / fmax(d2, 1e-4 * unit);
}

void fs_colors_linear(const Scene *scene, Layer layer, const Development *development, float *linear)
{
    const Cloud *cloud = fs_colors_cloud(scene, layer);
    const double *eye = development->has_eye ? development->eye : NULL;
    int width = cloud->width[CLOUD_COLORS];
    for (int i = 0; i < cloud->n; i++) {
        const float *color = cloud->field[CLOUD_COLORS] + (size_t)i * (size_t)width;
        const float *mean = cloud->field[CLOUD_MEANS] + (size_t)i * 3;
        bool lit = layer == LAYER_T_F && fs_scene_lit(scene);
        double flash = lit ? flash_falloff(scene, mean, development) * exp((double)cloud->field[CLOUD_GAINS][i]) : 0;
        for (int c = 0; c < 3; c++) {
            float *to = &linear[(size_t)i * 3 + (size_t)c];
            *to = layer == LAYER_BETA ? 1.0f / (1.0f + expf(-color[0])) : fs_tone_decode(color[width == 3 ? c : 0]);
            if (lit) *to *= (float)(1 + scene->gain_color[c] * flash);
            if (layer == LAYER_R && scene->pane_beta && !development->room)
                *to *= (float)(eye ? fs_pane_beta_towards(&scene->pane, eye, mean) : scene->pane.f0);
        }
    }
}

void fs_colors_display(const Scene *scene, Layer layer, const Development *development, float *srgb)
{
    const Cloud *cloud = fs_colors_cloud(scene, layer);
    fs_colors_linear(scene, layer, development, srgb);
    if (layer == LAYER_BETA) return; // a map, not light
    for (int i = 0; i < cloud->n; i++) fs_preview_develop(&development->light, srgb + (size_t)i * 3);
}
