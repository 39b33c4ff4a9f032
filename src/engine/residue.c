// A residue is weighed as its photo's noise is, without its broad part (which tells no place), less so at outliers and
// at edges of the render. The scenes' own part in it is what the other photos of its lighting expect, carried along T's
// or R's depth: as much of that is taken off as there is of it around each pixel. What is on a plane before the scenes
// moves against them from photo to photo, and stays.
#include "engine/residue.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/order.h"
#include "image/blur.h"

// Chosen by:
#define OUTLIER 3.0f    // -           residuals, in standard deviations, that count half
#define DARK 0.1f       // -           of the photo's mean, beside what noise is told by
#define FINE 1.0f       // -           sigma of what tells that, pixels
#define BROAD 5.0f      // experiment  and of what is too broad to tell a plane by
#define EDGES 2.0f      // experiment  pixels that scenes are off
#define AROUND 5.0f     // experiment  sigma of where as much of what is expected is taken off, pixels
#define MOST 1.5f       // -           and at most so many times of it
#define DEVIATION 1.48f // standard deviation of a normal distribution, by its middle deviation

// ---- of a photo ----

// Standard deviation of what is trusted, for a weight of 1. Room for a picture.
static float deviation(const float *residual, const float *weight, size_t n, float *room)
{
    size_t trusted = 0;
    for (size_t i = 0; i < n; i++)
        if (weight[i] > 0) room[trusted++] = fabsf(residual[i]) * sqrtf(weight[i]);
    fs_order_floats(room, trusted);
    return DEVIATION * (trusted ? room[trusted / 2] : 0) + 1e-12f;
}

// residual, weight: of the photo's pixels; x: as much room, y: twice as much.
static void weigh(float *residual, float *weight, const Image *bright, const Image *mask, float *x, float *y)
{
    const size_t n = fs_image_pixels(bright);
    Image one = {bright->width, bright->height, 1, x};
    double mean = 0;
    for (size_t i = 0; i < n; i++) mean += fmax((double)bright->px[i], 0) / (double)n;
    fs_blur_image(bright, x, weight, FINE);
    for (size_t i = 0; i < n; i++) weight[i] = mask->px[i] / (fmaxf(weight[i], 0) + DARK * (float)mean + 1e-9f);
    float *scratch = y + n, *blurred = y;
    for (size_t i = 0; i < n; i++) x[i] = residual[i] * weight[i];
    fs_blur_image(&one, scratch, blurred, BROAD);
    memcpy(x, weight, sizeof *x * n);
    for (size_t i = 0; i < n; i++) weight[i] = blurred[i]; // for now
    fs_blur_image(&one, scratch, blurred, BROAD);
    for (size_t i = 0; i < n; i++) residual[i] -= blurred[i] > 0 ? weight[i] / blurred[i] : 0;
    memcpy(weight, x, sizeof *x * n);
    const float usual = OUTLIER * deviation(residual, weight, n, x);
    for (size_t i = 0; i < n; i++) {
        float off = residual[i] * sqrtf(weight[i]) / usual;
        weight[i] /= 1 + off * off;
    }
}

// At edges of what is rendered a scene that is a little off leaves most. Room for three pictures.
static void weigh_edges(const float *residual, float *weight, const Image *whole, float *room)
{
    const int w = whole->width, h = whole->height;
    const size_t n = fs_image_pixels(whole), line = (size_t)w;
    float *bright = room, *steep = room + n;
    const float usual = deviation(residual, weight, n, room);
    for (size_t i = 0; i < n; i++) bright[i] = (whole->px[3 * i] + whole->px[3 * i + 1] + whole->px[3 * i + 2]) / 3;
    for (size_t i = 0; i < n; i++) {
        int x = (int)(i % line), y = (int)(i / line);
        float across = bright[i + (x + 1 < w)] - bright[i - (x > 0)];
        float down = bright[i + (y + 1 < h ? line : 0)] - bright[i - (y > 0 ? line : 0)];
        steep[i] = (across * across + down * down) / 4;
    }
    fs_blur_image(&(Image){w, h, 1, steep}, room + 2 * n, bright, FINE);
    for (size_t i = 0; i < n; i++) weight[i] /= 1 + EDGES * EDGES * bright[i] * weight[i] / (usual * usual);
}

int fs_residue_fill(Residue *residue, const Image *photo, const Image *mask, const Image *whole,
                    const Image *const depth[2], FsError *err)
{
    const int w = photo->width, h = photo->height;
    const size_t n = fs_image_pixels(photo);
    Image bright = {0};
    float *room = malloc(sizeof *room * 5 * n), *light = room, *weight = room + n;
    int rc;
    if (!room) TRY(fs_error_memory(err));
    TRY(fs_image_new(&bright, w, h, 1, err));
    float *px = aligned_alloc(64, fs_planes_floats(w, h, RESIDUE_PLANES) * sizeof(float));
    if (!px) TRY(fs_error_memory(err));
    residue->px = fs_planes_over(px, w, h, RESIDUE_PLANES);
    fs_planes_zero(&residue->px, 0, h);
    for (size_t i = 0; i < n; i++) {
        light[i] = 0;
        for (int c = 0; c < 3; c++) {
            bright.px[i] += photo->px[3 * i + (size_t)c] / 3;
            light[i] += (photo->px[3 * i + (size_t)c] - whole->px[3 * i + (size_t)c]) / 3;
        }
    }
    weigh(light, weight, &bright, mask, room + 2 * n, room + 3 * n);
    weigh_edges(light, weight, whole, room + 2 * n);
    for (size_t i = 0; i < n; i++) {
        int x = (int)(i % (size_t)w), y = (int)(i / (size_t)w);
        fs_planes_row(&residue->px, RESIDUE_SUM, y)[x] = light[i] * weight[i];
        fs_planes_row(&residue->px, RESIDUE_WEIGHT, y)[x] = weight[i];
        for (int k = 0; k < 2; k++) fs_planes_row(&residue->px, RESIDUE_DEPTH + k, y)[x] = depth[k]->px[i];
    }
fail:
    fs_image_free(&bright);
    free(room);
    return rc;
}

void fs_residue_free(Residue *residue)
{
    free(residue->px.px);
    *residue = (Residue){0};
}

// ---- of the scenes ----

typedef struct Clearing {
    Residue *residue; // (n)
    int n, scene;     // 0: T, 1: R
    size_t room;      // floats of a worker's
    float *scratch;
} Clearing;

// From a pixel of one photo, at a depth there, to one of another: of that one's axes, x = a[0] + depth (a[1] + column
// a[2] + row a[3]).
static void carry_between(const Camera *from, const Camera *to, double a[3][4])
{
    double turn[9], t[3];
    fs_camera_relative(from, to, turn, t);
    for (int k = 0; k < 3; k++) {
        const double *r = turn + 3 * k, x = (0.5 - from->cx) / from->fx, y = (0.5 - from->cy) / from->fy;
        a[k][0] = t[k];
        a[k][1] = r[0] * x + r[1] * y + r[2];
        a[k][2] = r[0] / from->fx;
        a[k][3] = r[1] / from->fy;
    }
}

// Adds what `p` has at (u, v), between the middles of pixels, to sum and weight. Nothing beyond the picture.
static void add_at(const Planes *p, double u, double v, float *sum, float *weight)
{
    if (!(u > -1 && v > -1 && u < p->width && v < p->height)) return;
    int x0 = (int)floor(u), y0 = (int)floor(v);
    float fx = (float)(u - x0), fy = (float)(v - y0);
    for (int i = 0; i < 4; i++) {
        int x = x0 + (i & 1), y = y0 + (i >> 1);
        if (x < 0 || y < 0 || x >= p->width || y >= p->height) continue;
        float part = (i & 1 ? fx : 1 - fx) * (i >> 1 ? fy : 1 - fy);
        *sum += part * fs_planes_row(p, RESIDUE_SUM, y)[x];
        *weight += part * fs_planes_row(p, RESIDUE_WEIGHT, y)[x];
    }
}

static void expect_job(void *context, int job, int worker)
{
    const Clearing *c = context;
    const Residue *own = &c->residue[job];
    const int w = own->px.width, h = own->px.height;
    const size_t n = (size_t)w * (size_t)h;
    float *sum = c->scratch + (size_t)worker * c->room, *weight = sum + n;
    memset(sum, 0, sizeof *sum * 2 * n);
    for (int k = 0; k < c->n; k++) {
        const Residue *other = &c->residue[k];
        double a[3][4];
        if (k == job || other->flash != own->flash) continue;
        carry_between(&own->camera, &other->camera, a);
        for (size_t i = 0; i < n; i++) {
            int x = (int)(i % (size_t)w), y = (int)(i / (size_t)w);
            double depth = (double)fs_planes_row(&own->px, RESIDUE_DEPTH + c->scene, y)[x], at[3];
            if (!(depth > 0)) continue;
            for (int r = 0; r < 3; r++) at[r] = a[r][0] + depth * (a[r][1] + x * a[r][2] + y * a[r][3]);
            if (!(at[2] > 0)) continue;
            add_at(&other->px, other->camera.fx * at[0] / at[2] + other->camera.cx - 0.5,
                   other->camera.fy * at[1] / at[2] + other->camera.cy - 0.5, &sum[i], &weight[i]);
        }
    }
    for (size_t i = 0; i < n; i++)
        fs_planes_row(&own->px, RESIDUE_EXPECTED, (int)(i / (size_t)w))[i % (size_t)w] =
            weight[i] > 0 ? sum[i] / weight[i] : 0;
}

static void take_off_job(void *context, int job, int worker)
{
    const Clearing *c = context;
    const Planes *p = &c->residue[job].px;
    const size_t n = (size_t)p->width * (size_t)p->height, line = (size_t)p->width;
    float *both = c->scratch + (size_t)worker * c->room, *squares = both + n, *room = squares + n, *out = room + n;
    for (size_t i = 0; i < n; i++) {
        int x = (int)(i % line), y = (int)(i / line);
        float expected = fs_planes_row(p, RESIDUE_EXPECTED, y)[x];
        both[i] = expected * fs_planes_row(p, RESIDUE_SUM, y)[x];
        squares[i] = expected * expected * fs_planes_row(p, RESIDUE_WEIGHT, y)[x];
    }
    fs_blur_image(&(Image){p->width, p->height, 1, both}, room, out, AROUND);
    memcpy(both, out, sizeof *both * n);
    fs_blur_image(&(Image){p->width, p->height, 1, squares}, room, out, AROUND);
    for (size_t i = 0; i < n; i++) {
        int x = (int)(i % line), y = (int)(i / line);
        float share = out[i] > 0 ? fminf(fmaxf(both[i] / out[i], 0), MOST) : 0;
        fs_planes_row(p, RESIDUE_SUM, y)[x] -=
            share * fs_planes_row(p, RESIDUE_EXPECTED, y)[x] * fs_planes_row(p, RESIDUE_WEIGHT, y)[x];
    }
}

// Where much is left all around, beside what usually is, a scene is not as it should be: that counts less.
static void weigh_job(void *context, int job, int worker)
{
    const Clearing *c = context;
    const Planes *p = &c->residue[job].px;
    const size_t n = (size_t)p->width * (size_t)p->height, line = (size_t)p->width;
    float *light = c->scratch + (size_t)worker * c->room, *weight = light + n, *room = weight + n, *out = room + n;
    for (size_t i = 0; i < n; i++) {
        weight[i] = fs_planes_row(p, RESIDUE_WEIGHT, (int)(i / line))[i % line];
        light[i] = weight[i] > 0 ? fs_planes_row(p, RESIDUE_SUM, (int)(i / line))[i % line] / weight[i] : 0;
    }
    const float usual = deviation(light, weight, n, room);
    for (size_t i = 0; i < n; i++) light[i] *= light[i] * weight[i];
    fs_blur_image(&(Image){p->width, p->height, 1, light}, room, out, AROUND);
    for (size_t i = 0; i < n; i++) {
        light[i] = out[i];
        weight[i] = weight[i] > 0;
    }
    fs_blur_image(&(Image){p->width, p->height, 1, weight}, room, out, AROUND);
    for (size_t i = 0; i < n; i++) {
        float share = out[i] > 0 ? 1 / (1 + light[i] / (out[i] * usual * usual)) : 0;
        for (int k = RESIDUE_SUM; k <= RESIDUE_WEIGHT; k++) fs_planes_row(p, k, (int)(i / line))[i % line] *= share;
    }
}

int fs_residue_clear_scenes(Residue *residue, int n, Threads *threads, FsError *err)
{
    Clearing c = {.residue = residue, .n = n};
    for (int i = 0; i < n; i++) {
        size_t room = 4 * (size_t)residue[i].px.width * (size_t)residue[i].px.height;
        if (room > c.room) c.room = room;
    }
    c.scratch = malloc(sizeof *c.scratch * c.room * (size_t)fs_threads_count(threads) + 1);
    if (!c.scratch) return fs_error_memory(err);
    for (c.scene = 0; c.scene < 2; c.scene++) {
        fs_threads_for(threads, n, expect_job, &c);
        fs_threads_for(threads, n, take_off_job, &c);
    }
    fs_threads_for(threads, n, weigh_job, &c);
    free(c.scratch);
    return 0;
}
