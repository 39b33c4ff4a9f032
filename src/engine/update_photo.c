// The numbers of the photo that a step moves: its light and its white balance.
//
// How the photos' light differs is a guess about what they hardly tell apart: a photo that is brighter, or the scene
// where it looks. What goes along with the place that photos were taken from is told least: a scene that is brighter at
// one side, as seen from that side, fits as well. How much photos' light differs at all, though, is plain from what
// does not go along with the place. So that variance says how large differences may be, and how much of them may go
// along (empirical Bayes): in a capture under one light what goes along is the scene's, in one whose light drifts it is
// the light's.
#include <math.h>
#include <string.h>

#include "engine/update.h"

#define RATE_PHOTO 5e-3  // of a photo's numbers, which are logarithms
#define PLACE_RIDGE 0.01 // so that photos from one line or one place will do
// Standard deviations of the logarithms, see docs/experiments.md.
#define USUAL_SPREAD 0.01 // up to this photos' light is held back whole, beyond it by its square
#define HELD_LEAST 0.1    // of that
#define PLACE_SPREAD 0.02 // photos whose light differs so much may differ as much along with the place
#define ALONG_MOST 100.0

// ---- what the other photos tell ----

// Of n numbers from PhotoState.x[number] on the mean, in photos of one lighting (0, 1) or all (-1): a plane over the
// places that they were taken from, in extents.
typedef struct Among {
    int number, n, flash;
} Among;
typedef struct PhotoFit {
    double mean[4]; // of the places, and of the number
    double slope[3];
    double left; // sum of the squares of what lies off the plane, with what its slope costs the ridge,
    int freedom; // of so many free ones; 0: the plane takes it all
} PhotoFit;

static bool is_among(const Among *among, const HostView *view)
{
    return among->flash < 0 || view->flash == (among->flash == 1);
}

void fs_update_photo_middle(const HostEngine *e, double middle[3])
{
    double centre[3];
    for (int k = 0; k < 3; k++) middle[k] = 0;
    for (int i = 0; i < e->base.n_views; i++) {
        fs_camera_centre(&e->views[i].camera, centre);
        for (int k = 0; k < 3; k++) middle[k] += centre[k] / e->base.n_views;
    }
}

// A photo's place, in extents, and the mean of its numbers.
static void place_row(const HostEngine *e, const Among *among, const HostView *view, double row[4])
{
    fs_camera_centre(&view->camera, row);
    for (int k = 0; k < 3; k++) row[k] /= e->scene.extent;
    row[3] = 0;
    for (int k = 0; k < among->n; k++) row[3] += (double)view->state.x[among->number + k] / among->n;
}

// Of rows less their mean: sums of products, the last row's are the number's. Returns how many rows there are.
static int sum_rows(const HostEngine *e, const Among *among, double mean[4], double sum[4][4])
{
    double row[4];
    int n = 0;
    for (int i = 0; i < e->base.n_views; i++) {
        if (!is_among(among, &e->views[i])) continue;
        place_row(e, among, &e->views[i], row);
        for (int c = 0; c < 4; c++) mean[c] += row[c];
        n++;
    }
    for (int c = 0; c < 4; c++) mean[c] /= n > 0 ? n : 1;
    for (int i = 0; i < e->base.n_views; i++) {
        if (!is_among(among, &e->views[i])) continue;
        place_row(e, among, &e->views[i], row);
        for (int r = 0; r < 4; r++)
            for (int c = 0; c < 4; c++) sum[r][c] += (row[r] - mean[r]) * (row[c] - mean[c]);
    }
    return n;
}

static PhotoFit fit_plane(const HostEngine *e, Among among)
{
    PhotoFit fit = {{0}, {0}, 0, 0};
    double sum[4][4] = {{0}}, m[3][4];
    int n = sum_rows(e, &among, fit.mean, sum);
    for (int r = 0; r < 3; r++) {
        memcpy(m[r], sum[r], sizeof m[r]);
        m[r][r] += PLACE_RIDGE * n;
    }
    for (int p = 0; p < 3 && n > 0; p++) // Gauss and Jordan; the matrix is positive definite
        for (int r = 0; r < 3; r++) {
            double f = r == p ? 0 : m[r][p] / m[p][p];
            for (int c = p; c < 4; c++) m[r][c] -= f * m[p][c];
        }
    fit.left = sum[3][3];
    for (int k = 0; k < 3 && n > 0; k++) {
        fit.slope[k] = m[k][3] / m[k][k];
        fit.left -= fit.slope[k] * sum[k][3];
    }
    fit.left = fmax(fit.left, 0);
    fit.freedom = n > 4 ? n - 4 : 0;
    return fit;
}

// The plane at a photo, less the mean.
static double along_place(const HostEngine *e, Among among, const PhotoFit *fit, const HostView *photo)
{
    double row[4], along = 0;
    place_row(e, &among, photo, row);
    for (int k = 0; k < 3; k++) along += fit->slope[k] * (row[k] - fit->mean[k]);
    return along;
}

// T's and R's light differs as much whether the flash fires or not.
_Static_assert(sizeof(PhotoGuess) == 3 * (PHOTO_WHITE + 1) * sizeof(double), "a number each, and the exposure");
static PhotoGuess guess(const HostEngine *e, const HostView *photo)
{
    PhotoGuess g;
    for (int k = 0; k <= PHOTO_WHITE; k++) {
        Among own = {k, k < PHOTO_WHITE ? 1 : 3, k < PHOTO_WHITE ? photo->flash : -1};
        PhotoFit fit = fit_plane(e, own), other = {{0}, {0}, 0, 0};
        if (k < PHOTO_FLASH) other = fit_plane(e, (Among){k, 1, !photo->flash});
        double variance = (fit.left + other.left) / fmax(fit.freedom + other.freedom, 1) + 1e-12;
        g.along[k] = along_place(e, own, &fit, photo);
        g.held[k] = fmin(fmax(USUAL_SPREAD * USUAL_SPREAD / variance, HELD_LEAST), 1);
        g.held_along[k] = fmin(PLACE_SPREAD * PLACE_SPREAD / variance, ALONG_MOST);
    }
    return g;
}

// ---- the step ----

// The scene keeps its brightness: photos of either lighting have none of their own at the middle of all places.
static void take_middle_off(HostEngine *e, Among among)
{
    PhotoFit fit = fit_plane(e, among);
    double middle[3], there = fit.mean[3];
    fs_update_photo_middle(e, middle);
    for (int k = 0; k < 3; k++) there += fit.slope[k] * (middle[k] / e->scene.extent - fit.mean[k]);
    for (int i = 0; i < e->base.n_views; i++)
        for (int k = 0; k < among.n && is_among(&among, &e->views[i]); k++)
            e->views[i].state.x[among.number + k] -= (float)there;
}

static void gradients(const Update *u, double g[PHOTO_NUMBERS])
{
    const RasterTask *T = u->task[LAYER_T_N], *R = u->task[LAYER_R];
    g[PHOTO_T] = u->pane.T;
    g[PHOTO_R] = u->pane.R;
    for (int k = 0; k < 3; k++) {
        g[PHOTO_WHITE + k] = u->calibration.white[k];
        if (!u->plan->T.lit || !T) continue;
        double on_T = T->d_tint[k] * (double)u->plan->T.light.tint[k];
        double on_R = R ? R->d_tint[k] * (double)u->plan->R.light.tint[k] : 0;
        g[PHOTO_T] -= on_T;
        g[PHOTO_R] -= on_R;
        g[PHOTO_FLASH] += on_T + on_R;
    }
}

void fs_update_photo_run(const Update *u, StepResult *result)
{
    HostEngine *e = u->engine;
    PhotoState *state = &u->photo->state;
    double g[PHOTO_NUMBERS] = {0};
    bool lit = u->plan->T.lit && u->task[LAYER_T_N];
    gradients(u, g);
    PhotoGuess by_others = guess(e, u->photo);
    for (int k = 0; k < LOSS_TERMS; k++)
        if (u->args->weight[k] > 0 && fs_loss_terms[k].photo)
            result->loss[k] += fs_loss_terms[k].photo(state, &by_others, u->args->weight[k], g);
    AdamRate rate = fs_adam_rate(RATE_PHOTO * u->args->settle, u->args->step / e->base.n_views + 1);
    for (int k = 0; k < PHOTO_NUMBERS; k++) {
        if (!(u->args->learn & (k < PHOTO_WHITE ? LEARN_LIGHT : LEARN_WHITE))) continue;
        if (k == PHOTO_FLASH ? !lit : k < PHOTO_FLASH && !u->plan->pane_beta) continue;
        float d = (float)g[k];
        AdamFields fields = {&state->x[k], &d, &state->m[k], &state->v[k]};
        e->kernels.adam->step(&fields, 1, rate);
    }
    for (int k = 0; k < PHOTO_WHITE; k++) take_middle_off(e, (Among){k, 1, u->photo->flash});
    for (int k = PHOTO_WHITE; k < PHOTO_NUMBERS; k++) // flash and no-flash photos may differ in their white balance
        if (u->args->learn & LEARN_WHITE) take_middle_off(e, (Among){k, 1, -1});
}
