#include "engine/view_images.h"

#include <string.h>

#include "engine/scratch.h"

static void copy_rows(const Planes *from, const Planes *to, int y0, int y1)
{
    for (int y = y0; y < y1; y++)
        memcpy(fs_planes_row(to, 0, y), fs_planes_row(from, 0, y), sizeof(float) * (size_t)from->width);
}

void fs_view_images_set_up(ViewImages *v, const Kernels *kernels, Arena *arena, const Camera *camera, bool train)
{
    v->kernels = kernels;
    Planes *const one[] = {&v->beta_map, &v->tau, &v->d_beta, &v->d_tau};
    Planes *const three[] = {&v->T_linear, &v->R_linear, &v->I_linear, &v->I, &v->d_I};
    for (int i = 0; i < (train ? 4 : 2); i++) *one[i] = fs_scratch_planes(arena, camera, 1);
    for (int i = 0; i < (train ? 5 : 4); i++) *three[i] = fs_scratch_planes(arena, camera, 3);
    v->P = train && v->plan.calibrated ? fs_scratch_planes(arena, camera, 3) : v->I;
    v->d_P = train && v->plan.calibrated ? fs_scratch_planes(arena, camera, 3) : v->d_I;
    v->beta_clear = v->occlusion ? fs_scratch_planes(arena, camera, 1) : v->beta_map;
    v->beta_open = v->cover ? fs_scratch_planes(arena, camera, 1) : v->beta_clear;
    if (v->texture) v->veil = fs_scratch_planes(arena, camera, 3);
    if (v->texture && train) v->d_veil = fs_scratch_planes(arena, camera, 3);
    if (!v->R) v->black = fs_scratch_planes(arena, camera, 3);
    if (!v->R && train) v->d_black = fs_scratch_planes(arena, camera, 3);
}

typedef struct Wiring {
    Planes T, R, d_T, d_R;
    ComposeArgs args;
} Wiring;

static const ComposeArgs *wire(const ViewImages *v, Wiring *w)
{
    w->T = fs_view_images_rgb(&v->T->feature);
    w->R = v->R ? fs_view_images_rgb(&v->R->feature) : v->black;
    w->d_T = fs_view_images_rgb(&v->T->d_feature);
    w->d_R = v->R ? fs_view_images_rgb(&v->R->d_feature) : v->d_black;
    bool pane = v->plan.pane_beta;
    w->args = (ComposeArgs){.T = &w->T,
                            .R = &w->R,
                            .beta = &v->beta_map,
                            .tau = pane ? &v->tau : NULL,
                            .T_linear = &v->T_linear,
                            .R_linear = &v->R_linear,
                            .I_linear = &v->I_linear,
                            .I = &v->I,
                            .d_I = &v->d_I,
                            .d_T = &w->d_T,
                            .d_R = &w->d_R,
                            .d_beta = &v->d_beta,
                            .d_tau = pane ? &v->d_tau : NULL,
                            .veil = v->texture ? &v->veil : NULL,
                            .d_veil = v->texture ? &v->d_veil : NULL,
                            .slope_floor = v->slope_floor};
    return &w->args;
}

void fs_view_images_forward(const ViewImages *v, int y0, int y1)
{
    Wiring w;
    if (v->plan.pane_beta)
        v->kernels->pane->forward(&v->plan.pane, &v->beta_open, &v->tau, y0, y1);
    else if (v->beta && v->plan.plain_beta)
        copy_rows(&v->beta->feature, &v->beta_map, y0, y1);
    else if (v->beta)
        v->kernels->pixelwise->sigmoid(&v->beta->feature, &v->beta_map, y0, y1);
    else
        fs_planes_zero(&v->beta_map, y0, y1);
    if (v->cover) {
        Planes cover = fs_view_images_last(v->cover, &v->cover->feature);
        v->kernels->pixelwise->cover(&cover, &v->beta_open, &v->beta_clear, y0, y1);
    }
    if (v->occlusion) v->kernels->occlusion->forward(v->occlusion, &v->beta_clear, &v->beta_map, y0, y1);
    if (!v->R) fs_planes_zero(&v->black, y0, y1);
    if (v->texture) v->kernels->veil->forward(&v->veil_view, v->texture, &v->veil, y0, y1);
    v->kernels->compose->forward(wire(v, &w), y0, y1);
    if (v->plan.calibrated) v->kernels->calibration->forward(&v->plan.calibration, &v->I, &v->P, y0, y1);
}

void fs_view_images_zero(const ViewImages *v, int y0, int y1)
{
    fs_planes_zero(&v->d_beta, y0, y1);
    fs_planes_zero(&v->d_tau, y0, y1);
    if (!v->R) fs_planes_zero(&v->d_black, y0, y1);
}

void fs_view_images_backward(const ViewImages *v, int y0, int y1, CalibrationGradient *gradient)
{
    Wiring w;
    if (v->plan.calibrated)
        v->kernels->calibration->backward(&v->plan.calibration, &v->I, &v->d_P, &v->d_I, y0, y1, gradient);
    v->kernels->compose->backward(wire(v, &w), y0, y1);
}

PaneGradient fs_view_images_backward_beta(const ViewImages *v, int y0, int y1, float *d_q)
{
    if (v->occlusion)
        v->kernels->occlusion->backward(v->occlusion, &v->beta_clear, &v->d_beta, &v->d_beta, y0, y1, d_q);
    if (v->cover) {
        Planes cover = fs_view_images_last(v->cover, &v->cover->feature),
               d_cover = fs_view_images_last(v->cover, &v->cover->d_feature);
        v->kernels->pixelwise->cover_backward(&cover, &v->beta_open, &v->d_beta, &d_cover, y0, y1);
    }
    if (v->plan.pane_beta) return v->kernels->pane->backward(&v->plan.pane, &v->d_beta, &v->d_tau, y0, y1);
    if (v->beta && v->plan.plain_beta)
        copy_rows(&v->d_beta, &v->beta->d_feature, y0, y1);
    else if (v->beta)
        v->kernels->pixelwise->sigmoid_backward(&v->beta_map, &v->d_beta, &v->beta->d_feature, y0, y1);
    return (PaneGradient){0};
}
