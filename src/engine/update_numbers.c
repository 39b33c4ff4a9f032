// The numbers beside the clouds that a step moves: those of the whole scene, and those of the photo (update_photo.c).
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "engine/update.h"

enum {
    GREY_KNOT = 6,                         // of the response, which stays
    FIRST_KNOT = 8 + FS_OPTICS_VIGNETTING, // among the numbers
};

// ---- the numbers of the whole scene ----

// Which are learned, how fast, and within what; logarithmic ones are stepped as their logarithm.
static const struct Number {
    size_t offset; // in Scene
    int n;
    double rate;
    enum Whose { OF_PANE, OF_FLASH, OF_VEIL, OF_VIGNETTING, OF_RESPONSE } whose;
    bool logarithmic;
    double min, max;
} numbers[] = {
    {offsetof(Scene, pane.normal), 3, 5e-3, OF_PANE, false, -INFINITY, INFINITY},
    {offsetof(Scene, pane.dimming), 1, 1e-3, OF_PANE, false, 0.02, 0.5},
    {offsetof(Scene, gain_color), 3, 1e-3, OF_FLASH, true, 0, INFINITY},
    {offsetof(Scene, flash_return), 1, 5e-3, OF_FLASH, true, 0.01, 1},
    {offsetof(Scene, vignetting), FS_OPTICS_VIGNETTING, 1e-3, OF_VIGNETTING, false, -1, 1},
    {offsetof(Scene, response), FS_OPTICS_KNOTS, 1e-3, OF_RESPONSE, false, -0.5, 0.5},
    {offsetof(Scene, veil.ambient), 3, 5e-3, OF_VEIL, false, 0, INFINITY},
};

// Gradients in the order of the table.
static void number_gradients(const Update *u, double g[ENGINE_NUMBERS])
{
    const Scene *scene = &u->engine->scene;
    const RasterTask *T = u->task[LAYER_T_N], *R = u->task[LAYER_R];
    const double flash[2] = {(double)fs_host_engine_flash(u->photo, PHOTO_T),
                             (double)fs_host_engine_flash(u->photo, PHOTO_R)};
    for (int k = 0; k < 3; k++) {
        g[k] = u->pane.normal[k];
        g[4 + k] = (T ? T->d_tint[k] * flash[0] : 0) + (R ? R->d_tint[k] * scene->flash_return * flash[1] : 0);
    }
    g[3] = u->pane.dimming;
    g[7] = 0;
    for (int k = 0; k < 3; k++) g[7] += R ? R->d_tint[k] * scene->gain_color[k] * flash[1] : 0;
    memcpy(g + 8, u->calibration.vignetting, sizeof u->calibration.vignetting);
    memcpy(g + FIRST_KNOT, u->calibration.response, sizeof u->calibration.response);
    memcpy(g + FIRST_KNOT + FS_OPTICS_KNOTS, u->veil_ambient, sizeof u->veil_ambient);
}

static bool is_learned(const Update *u, const struct Number *number)
{
    const Scene *scene = &u->engine->scene;
    switch (number->whose) {
    case OF_PANE: return scene->pane_beta && scene->separation != SEPARATION_NONE;
    case OF_VIGNETTING: return u->args->learn & LEARN_VIGNETTING;
    case OF_VEIL: return fs_pane_veil_is(&scene->veil) && u->args->veil_ambient;
    case OF_RESPONSE: return u->args->learn & LEARN_RESPONSE;
    default:
        if (number->offset == offsetof(Scene, flash_return) && !(u->task[LAYER_R] && scene->pane_beta)) return false;
        return fs_scene_lit(scene) && u->photo->flash;
    }
}

// The response leaves black black, and a bright grey as it is: how bright the scene is, is nobody's to say.
static void fix_response(Scene *scene)
{
    const double grey = scene->response[GREY_KNOT];
    scene->response[0] = 0;
    for (int k = 1; k < FS_OPTICS_KNOTS; k++) scene->response[k] -= grey * k / GREY_KNOT;
    for (int k = 1; k < FS_OPTICS_KNOTS; k++) // it rises
        scene->response[k] = fmax(scene->response[k], scene->response[k - 1] - 0.9 * (double)FS_OPTICS_SPACING);
}

static void update_numbers(const Update *u, StepResult *result)
{
    HostEngine *e = u->engine;
    Scene *scene = &e->scene;
    double g[ENGINE_NUMBERS];
    number_gradients(u, g);
    for (int k = 0; k < LOSS_TERMS; k++)
        if (u->args->weight[k] > 0 && fs_loss_terms[k].response)
            result->loss[k] += fs_loss_terms[k].response(scene->response, u->args->weight[k], g + FIRST_KNOT);
    for (int i = 0, at = 0; i < (int)(sizeof numbers / sizeof *numbers); at += numbers[i].n, i++) {
        const struct Number *number = &numbers[i];
        if (!is_learned(u, number)) continue;
        double *x = (double *)((char *)scene + number->offset);
        double rate = number->rate * (number->whose >= OF_VIGNETTING ? u->args->settle : 1);
        for (int k = 0; k < number->n; k++) {
            float y = (float)(number->logarithmic ? log(x[k]) : x[k]);
            float d = (float)(g[at + k] * (number->logarithmic ? x[k] : 1));
            AdamFields fields = {&y, &d, &e->state.m[at + k], &e->state.v[at + k]};
            e->kernels.adam->step(&fields, 1, fs_adam_rate(rate, u->args->step + 1));
            double z = number->logarithmic ? exp((double)y) : (double)y;
            x[k] = fmin(fmax(z, number->min), number->max);
        }
    }
    double *n = scene->pane.normal, length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int i = 0; i < 3 && scene->pane_beta; i++) n[i] /= length;
    if (u->args->learn & LEARN_RESPONSE) fix_response(scene);
}

void fs_update_numbers_run(const Update *update, StepResult *result)
{
    update_numbers(update, result);
    if (update->args->learn & (LEARN_LIGHT | LEARN_WHITE)) fs_update_photo_run(update, result);
}
