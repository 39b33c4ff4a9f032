// The numbers beside the clouds that a step moves: those of the whole scene and those of the photo.
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "engine/update.h"

#define RATE_PHOTO 5e-3  // of a photo's numbers, which are logarithms
#define PLACE_RIDGE 0.01 // so that photos from one line or one place will do
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
        if (number->offset == offsetof(Scene, flash_return) && !u->task[LAYER_R]) return false;
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

// ---- the numbers of the photo ----

void fs_update_numbers_middle(const HostEngine *e, double middle[3])
{
    double centre[3];
    for (int k = 0; k < 3; k++) middle[k] = 0;
    for (int i = 0; i < e->n_views; i++) {
        fs_camera_centre(&e->views[i].camera, centre);
        for (int k = 0; k < 3; k++) middle[k] += centre[k] / e->n_views;
    }
}

// What is leveled: the mean of n numbers from `number` on, over the photos of one lighting (0, 1) or all (-1).
typedef struct Level {
    int number, n, flash;
    double middle[3];
} Level;

static bool is_leveled(const Level *level, const HostView *view)
{
    return level->flash < 0 || view->flash == (level->flash == 1);
}

// 1, a photo's place from the middle of all, in extents, and the mean of its numbers.
static void place_row(const Level *level, const HostView *view, double extent, double row[5])
{
    row[0] = 1;
    fs_camera_centre(&view->camera, row + 1);
    for (int k = 0; k < 3; k++) row[1 + k] = (row[1 + k] - level->middle[k]) / extent;
    row[4] = 0;
    for (int k = 0; k < level->n; k++) row[4] += (double)view->state.x[level->number + k] / level->n;
}

// Takes off what goes along with the place that photos were taken from (a constant and a slope): that belongs to the
// scene, which so keeps its brightness, while how a photo's light differs is chance.
static void level_photos(HostEngine *e, Level level)
{
    double sum[4][5] = {{0}}, row[5];
    int n = 0;
    fs_update_numbers_middle(e, level.middle);
    for (int i = 0; i < e->n_views; i++) {
        if (!is_leveled(&level, &e->views[i])) continue;
        place_row(&level, &e->views[i], e->scene.extent, row);
        for (int r = 0; r < 4; r++)
            for (int c = 0; c < 5; c++) sum[r][c] += row[r] * row[c];
        n++;
    }
    for (int r = 1; r < 4; r++) sum[r][r] += PLACE_RIDGE * n;
    for (int p = 0; p < 4; p++) // Gauss and Jordan; the matrix is positive definite
        for (int r = 0; r < 4; r++) {
            double f = r == p ? 0 : sum[r][p] / sum[p][p];
            for (int c = p; c < 5; c++) sum[r][c] -= f * sum[p][c];
        }
    for (int i = 0; i < e->n_views; i++) {
        if (!is_leveled(&level, &e->views[i])) continue;
        place_row(&level, &e->views[i], e->scene.extent, row);
        float *x = e->views[i].state.x + level.number;
        for (int k = 0; k < 4 * level.n; k++) x[k / 4] -= (float)(sum[k % 4][4] / sum[k % 4][k % 4] * row[k % 4]);
    }
}

// Exposure, which the three channels share, is leveled; each channel has its mean over all photos taken off: flash and
// no-flash photos may differ in their white balance.
static void level_white(HostEngine *e)
{
    level_photos(e, (Level){.number = PHOTO_WHITE, .n = 3, .flash = -1});
    for (int k = PHOTO_WHITE; k < PHOTO_NUMBERS; k++) {
        double sum = 0;
        for (int i = 0; i < e->n_views; i++) sum += (double)e->views[i].state.x[k];
        for (int i = 0; i < e->n_views; i++) e->views[i].state.x[k] -= (float)(sum / e->n_views);
    }
}

static void update_photo(const Update *u, StepResult *result)
{
    HostEngine *e = u->engine;
    PhotoState *state = &u->photo->state;
    const RasterTask *T = u->task[LAYER_T_N], *R = u->task[LAYER_R];
    double g[PHOTO_NUMBERS] = {[PHOTO_T] = u->pane.T, [PHOTO_R] = u->pane.R};
    bool lit = u->plan->T.lit && T;
    for (int k = 0; k < 3; k++) {
        g[PHOTO_WHITE + k] = u->calibration.white[k];
        double on_T = lit ? T->d_tint[k] * (double)u->plan->T.light.tint[k] : 0;
        double on_R = lit && R ? R->d_tint[k] * (double)u->plan->R.light.tint[k] : 0;
        g[PHOTO_T] -= on_T;
        g[PHOTO_R] -= on_R;
        g[PHOTO_FLASH] += on_T + on_R;
    }
    for (int k = 0; k < LOSS_TERMS; k++)
        if (u->args->weight[k] > 0 && fs_loss_terms[k].photo)
            result->loss[k] += fs_loss_terms[k].photo(state, u->args->weight[k], g);
    AdamRate rate = fs_adam_rate(RATE_PHOTO * u->args->settle, u->args->step / e->n_views + 1);
    for (int k = 0; k < PHOTO_NUMBERS; k++) {
        if (!(u->args->learn & (k < PHOTO_WHITE ? LEARN_LIGHT : LEARN_WHITE))) continue;
        if (k == PHOTO_FLASH ? !lit : k < PHOTO_FLASH && !u->plan->pane_beta) continue;
        float d = (float)g[k];
        AdamFields fields = {&state->x[k], &d, &state->m[k], &state->v[k]};
        e->kernels.adam->step(&fields, 1, rate);
    }
    for (int k = 0; k < PHOTO_WHITE; k++) level_photos(e, (Level){.number = k, .n = 1, .flash = u->photo->flash});
    if (u->args->learn & LEARN_WHITE) level_white(e);
}

void fs_update_numbers_run(const Update *update, StepResult *result)
{
    update_numbers(update, result);
    if (update->args->learn & (LEARN_LIGHT | LEARN_WHITE)) update_photo(update, result);
}
