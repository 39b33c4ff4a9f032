// A made-up capture for tests: two parallel textured planes, one behind the pane that the flash brightens, one mirrored
// in it, seen by a hand's worth of cameras of either lighting. Where wanted, a bright board stands before the former.
#ifndef MADE_CAPTURE_H
#define MADE_CAPTURE_H

#include <math.h>
#include <stdlib.h>

#include "base/rng.h"
#include "initialise/small_views.h"

enum { MADE_PHOTOS = 20, MADE_WIDTH = 120, MADE_HEIGHT = 80, MADE_WAVES = 24 };
#define MADE_DEPTH_T 2.0
#define MADE_DEPTH_R 4.0
#define MADE_DEPTH_BOARD 1.8
#define MADE_BOARD 0.12 // half its width
#define MADE_ALPHA 1.2f

typedef struct MadeTexture {
    bool board;                          // of the plane behind the pane: a board before it
    float level, wave[3][MADE_WAVES][4]; // per channel: x, y frequency, phase, amplitude
} MadeTexture;

static inline MadeTexture made_texture(uint64_t seed, double depth)
{
    MadeTexture t = {.level = 0.2f};
    Rng rng = fs_rng_new(seed);
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < MADE_WAVES; k++) {
            float f = (20 + 60 * fs_rng_uniform(&rng)) * 2 / (float)depth, a = 6.2831853f * fs_rng_uniform(&rng);
            t.wave[c][k][0] = f * cosf(a);
            t.wave[c][k][1] = f * sinf(a);
            t.wave[c][k][2] = 6.2831853f * fs_rng_uniform(&rng);
            t.wave[c][k][3] = 0.015f;
        }
    return t;
}

static inline float made_texture_at(const MadeTexture *t, int c, double x, double y)
{
    float v = t->level;
    for (int k = 0; k < MADE_WAVES; k++) {
        const float *w = t->wave[c][k];
        v += w[3] * sinf(w[0] * (float)x + w[1] * (float)y + w[2]);
    }
    return fmaxf(v, 0.01f);
}

// n points on a plane, within the view of all cameras.
static inline void made_scatter(float *xyz, int n, double depth, uint64_t seed)
{
    Rng rng = fs_rng_new(seed);
    for (int i = 0; i < n; i++) {
        xyz[3 * i] = (fs_rng_uniform(&rng) - 0.5f) * 0.4f * (float)depth;
        xyz[3 * i + 1] = (fs_rng_uniform(&rng) - 0.5f) * 0.25f * (float)depth;
        xyz[3 * i + 2] = (float)depth;
    }
}

static inline float made_photo_at(const Camera *camera, const MadeTexture *T, const MadeTexture *R, bool flash, int c,
                                  double x, double y)
{
    double u = (x - camera->cx) / camera->fx, v = (y - camera->cy) / camera->fy;
    double X = -camera->w2c[3], Y = -camera->w2c[7];
    float t = made_texture_at(T, c, X + u * MADE_DEPTH_T, Y + v * MADE_DEPTH_T);
    float r = made_texture_at(R, c, X + u * MADE_DEPTH_R, Y + v * MADE_DEPTH_R);
    if (T->board && fabs(X + u * MADE_DEPTH_BOARD) < MADE_BOARD)
        t = 4 * made_texture_at(T, c, X + u * MADE_DEPTH_BOARD, Y + v * MADE_DEPTH_BOARD);
    return t * (flash ? 1 + MADE_ALPHA : 1) + r;
}

// Cameras on a 5 x 4 grid, 0.12 apart, flash and no flash in turns, all looking along z.
static inline int made_photos(SmallViews *views, const MadeTexture *T, const MadeTexture *R, FsError *err)
{
    *views = (SmallViews){.n = MADE_PHOTOS, .view = calloc(MADE_PHOTOS, sizeof(SmallView))};
    if (!views->view) return fs_error_memory(err);
    Rng rng = fs_rng_new(3);
    for (int i = 0; i < MADE_PHOTOS; i++) {
        SmallView *f = &views->view[i];
        f->flash = (i + i / 5) % 2;
        f->camera = (Camera){MADE_WIDTH,
                             MADE_HEIGHT,
                             150,
                             150,
                             MADE_WIDTH / 2.0,
                             MADE_HEIGHT / 2.0,
                             {1, 0, 0, -0.12 * (i % 5) + 0.24, 0, 1, 0, -0.12 * (double)(i / 5) + 0.18, 0, 0, 1, 0}};
        int rc = fs_image_new(&f->photo, MADE_WIDTH, MADE_HEIGHT, 3, err);
        if (rc < 0) return rc;
        for (int p = 0; p < MADE_WIDTH * MADE_HEIGHT * 3; p++)
            f->photo.px[p] = made_photo_at(&f->camera, T, R, f->flash, p % 3, p / 3 % MADE_WIDTH + 0.5,
                                           (double)(p / 3 / MADE_WIDTH) + 0.5) +
                             0.003f * fs_rng_normal(&rng);
    }
    fs_small_views_finish(views);
    return 0;
}

static inline int made_capture(SmallViews *views, MadeTexture *T, MadeTexture *R, FsError *err)
{
    *T = made_texture(11, MADE_DEPTH_T);
    *R = made_texture(12, MADE_DEPTH_R);
    return made_photos(views, T, R, err);
}

#endif
