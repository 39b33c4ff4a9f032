// Colours for viewers: the layer's linear camera RGB, then exposure, shoulder and sRGB.
#include "export/colors.h"

#include <math.h>

#include "image/tone.h"

const Cloud *fs_colors_cloud(const Scene *scene, Layer layer)
{
    const Cloud *cloud = &scene->cloud[layer == LAYER_T_F && scene->shared_geometry ? LAYER_T_N : layer];
    return cloud->n ? cloud : NULL;
}

// The flash's gain on Gaussian i at the distance where its falloff is 1.
static float flash_gain(const Scene *scene, const Cloud *cloud, int i, int channel)
{
    return 1.0f + (float)scene->gain_color[channel] * expf(cloud->field[CLOUD_GAINS][i]);
}

// Schlick's Fresnel on the ray from the eye to the Gaussian.
static float pane_beta(const Pane *pane, const float mean[3], const Development *development)
{
    if (!development->has_eye) return (float)pane->f0;
    double dot = 0, length = 0;
    for (int k = 0; k < 3; k++) {
        double ray = (double)mean[k] - development->eye[k];
        dot += ray * pane->normal[k];
        length += ray * ray;
    }
    double cosine = length > 0 ? fmin(fabs(dot) / sqrt(length), 1) : 1;
    return (float)fs_pane_beta(pane, cosine);
}

void fs_colors_linear(const Scene *scene, Layer layer, const Development *development, float *linear)
{
    const Cloud *cloud = fs_colors_cloud(scene, layer);
    int width = cloud->width[CLOUD_COLORS];
    for (int i = 0; i < cloud->n; i++) {
        const float *color = cloud->field[CLOUD_COLORS] + (size_t)i * (size_t)width;
        for (int c = 0; c < 3; c++) {
            float *to = &linear[(size_t)i * 3 + (size_t)c];
            *to = layer == LAYER_BETA ? 1.0f / (1.0f + expf(-color[0])) : fs_tone_decode(color[width == 3 ? c : 0]);
            if (layer == LAYER_T_F && fs_scene_lit(scene)) *to *= flash_gain(scene, cloud, i, c);
            if (layer == LAYER_R && scene->pane_beta && !development->room)
                *to *= pane_beta(&scene->pane, cloud->field[CLOUD_MEANS] + (size_t)i * 3, development);
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
