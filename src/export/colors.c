// Colours for viewers: the layer's linear camera RGB, then exposure, shoulder and sRGB.
#include "export/colors.h"

#include <math.h>

#include "image/tone.h"

const Cloud *fs_colors_cloud(const Scene *scene, Layer layer)
{
    bool of_T_N = layer == LAYER_T_F && scene->shared_geometry;
    const Cloud *cloud = &scene->cloud[of_T_N ? LAYER_T_N : layer];
    return cloud->n && !(of_T_N && !fs_scene_lit(scene)) ? cloud : NULL;
}

static double eye_distance2(const Development *development, const float mean[3])
{
    double length = 0;
    for (int k = 0; k < 3; k++) {
        double ray = (double)mean[k] - development->eye[k];
        length += ray * ray;
    }
    return length;
}

// What the flash makes of Gaussian i, from the middle of the photos' cameras: near things are brighter by it, as
// in photos (kernels/shade_body.h). Without that the falloff is 1.
static double flash_falloff(const Scene *scene, const float mean[3], const Development *development)
{
    if (!development->has_eye || scene->separation == SEPARATION_LINEAR) return 1;
    double unit = scene->flash_distance * scene->flash_distance;
    return unit / fmax(eye_distance2(development, mean), 1e-4 * unit);
}

// Schlick's Fresnel on the ray from the eye to the Gaussian.
static float pane_beta(const Pane *pane, const float mean[3], const Development *development)
{
    if (!development->has_eye) return (float)pane->f0;
    double dot = 0, length = eye_distance2(development, mean);
    for (int k = 0; k < 3; k++) dot += ((double)mean[k] - development->eye[k]) * pane->normal[k];
    double cosine = length > 0 ? fmin(fabs(dot) / sqrt(length), 1) : 1;
    return (float)fs_pane_beta(pane, cosine);
}

void fs_colors_linear(const Scene *scene, Layer layer, const Development *development, float *linear)
{
    const Cloud *cloud = fs_colors_cloud(scene, layer);
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
                *to *= pane_beta(&scene->pane, mean, development);
        }
    }
}

void fs_colors_develop(const Development *development, float color[3])
{
    const float camera[3] = {color[0], color[1], color[2]};
    for (int c = 0; c < 3; c++) {
        const double *m = development->srgb_from_camera + 3 * c;
        double v = development->has_matrix ? m[0] * camera[0] + m[1] * camera[1] + m[2] * camera[2] : camera[c];
        color[c] = fs_tone_pleasant((float)v, development->exposure);
    }
}

void fs_colors_display(const Scene *scene, Layer layer, const Development *development, float *srgb)
{
    const Cloud *cloud = fs_colors_cloud(scene, layer);
    fs_colors_linear(scene, layer, development, srgb);
    if (layer == LAYER_BETA) return; // a map, not light
    for (int i = 0; i < cloud->n; i++) fs_colors_develop(development, srgb + (size_t)i * 3);
}
