// Rows of photos to and fro, as one takes them by hand; flash and no flash alternate pair by pair in random order.
#include "synth/path.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/linalg.h"

#define FOCAL 1.0722534 // of the longer side: 38.6 mm on 36 mm film

// A camera at `eye` looking at `at`, upright but for roll (radians).
static Camera look(Vec eye, Vec at, float roll, const Spec *spec)
{
    int side = spec->width > spec->height ? spec->width : spec->height;
    Vec z = vec_unit(vec_sub(at, eye)), x = vec_unit(vec_cross(z, vec(0, 0, 1))), y = vec_cross(z, x);
    Vec xr = vec_mad(vec_scale(x, cosf(roll)), y, sinf(roll)), yr = vec_mad(vec_scale(y, cosf(roll)), x, -sinf(roll));
    Camera c = {spec->width, spec->height, FOCAL * side, FOCAL * side, 0.5 * spec->width, 0.5 * spec->height, {0}};
    const Vec row[3] = {xr, yr, z};
    for (int i = 0; i < 3; i++) {
        c.w2c[4 * i] = row[i].x;
        c.w2c[4 * i + 1] = row[i].y;
        c.w2c[4 * i + 2] = row[i].z;
        c.w2c[4 * i + 3] = -((double)row[i].x * eye.x + (double)row[i].y * eye.y + (double)row[i].z * eye.z);
    }
    return c;
}

// a, b: place on the path in -0.5..0.5 across and upwards.
static Camera take(const Layout *l, const Spec *spec, double a, double b, Rng *rng)
{
    Vec ahead = vec_unit(vec_sub(l->look_at, l->stand)), right = vec_unit(vec_cross(ahead, vec(0, 0, 1)));
    float width = spec->path_scale * l->span_x, height = spec->path_scale * l->span_y;
    Vec up = vec_cross(right, ahead), jitter[2], eye = l->stand, at = l->look_at;
    for (int i = 0; i < 2; i++) {
        float s = i ? 0.035f : 0.022f;
        jitter[i].x = s * (2 * fs_rng_uniform(rng) - 1);
        jitter[i].y = s * (2 * fs_rng_uniform(rng) - 1);
        jitter[i].z = s * (2 * fs_rng_uniform(rng) - 1);
    }
    // Sideways steps follow the pane, so that the flash's own mirror image stays out of view.
    Vec along = vec_unit(vec_mad(right, l->pane_normal, -vec_dot(right, l->pane_normal)));
    eye = vec_mad(vec_mad(eye, along, (float)a * width), up, (float)b * height);
    eye = vec_add(eye, jitter[0]);
    at = vec_mad(vec_mad(at, along, spec->follow * (float)a * width), up, spec->follow * (float)b * height);
    at = vec_add(at, jitter[1]);
    return look(eye, at, (float)(-0.02 + 0.04 * (double)fs_rng_uniform(rng)), spec);
}

// Which photos get truth layers: one out of each eighth of the path, of either lighting by turns.
static void choose_truth(Shot *shot, int photos)
{
    for (int k = 0; k < 8; k++)
        for (int i = k * photos / 8; i < (k + 1) * photos / 8; i++)
            if (shot[i].flash == (k & 1)) {
                shot[i].truth = true;
                break;
            }
}

int fs_path_plan(const Layout *layout, const Spec *spec, Shot **shots, FsError *err)
{
    int n = spec->photos, total = n + spec->held_out;
    Shot *shot = calloc((size_t)total, sizeof *shot);
    if (!shot) return fs_error_memory(err);
    Rng rng = fs_rng_new(spec->seed * 977ull + 5);
    int rows = (int)lround(sqrt(n * 0.83)), per_row;
    rows = rows < 1 ? 1 : rows;
    per_row = (n + rows - 1) / rows;
    for (int i = 0; i < n; i++) {
        int row = i / per_row, column = i % per_row;
        if (row & 1) column = per_row - 1 - column;
        double a = per_row > 1 ? (double)column / (per_row - 1) - 0.5 : 0.0,
               b = rows > 1 ? (double)row / (rows - 1) - 0.5 : 0.0;
        shot[i].camera = take(layout, spec, a, b, &rng);
        shot[i].flash = i & 1 ? !shot[i - 1].flash : fs_rng_below(&rng, 2) == 1;
        snprintf(shot[i].name, sizeof shot[i].name, "IMG_%04d", i + 1);
    }
    choose_truth(shot, n);
    for (int i = 0; i < spec->held_out; i++) { // between the photos, not beyond them
        Shot *s = &shot[n + i];
        double a = 0.72 * (fmod(0.5 + 0.618034 * i, 1.0) - 0.5), b = 0.72 * ((i + 0.5) / spec->held_out - 0.5);
        s->camera = take(layout, spec, a, b, &rng);
        s->held_out = s->truth = true;
        snprintf(s->name, sizeof s->name, "TEST_%02d", i + 1);
    }
    *shots = shot;
    return 0;
}

Camera fs_path_disturbed(const Camera *camera, Rng *rng)
{
    double r[9], q[4] = {1}, centre[3], d[9];
    for (int i = 0; i < 9; i++) r[i] = camera->w2c[4 * (i / 3) + i % 3];
    fs_camera_centre(camera, centre);
    for (int i = 0; i < 3; i++) {
        q[i + 1] = 0.5 * (0.0006 * (double)fs_rng_normal(rng)); // 0.035 degrees
        centre[i] += 0.0012 * (double)fs_rng_normal(rng);       // 1.2 mm
    }
    fs_camera_quat_to_rotation(q, d);
    Camera c = *camera;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            c.w2c[4 * i + j] = d[3 * i] * r[j] + d[3 * i + 1] * r[3 + j] + d[3 * i + 2] * r[6 + j];
        c.w2c[4 * i + 3] = -v3_dot(c.w2c + 4 * i, centre);
    }
    return c;
}
