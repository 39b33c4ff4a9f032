// Renders of a scene, written again in double and one pixel at a time, as the equations say: what every device of the
// engine is held against.
#ifndef TESTS_UNIT_DRAWN_H
#define TESTS_UNIT_DRAWN_H

#include <math.h>
#include <stdlib.h>

enum { DRAWN_MOST = 32 }; // Gaussians of a cloud

typedef struct Drawn {
    double color[4], transmittance, depth, cover; // sums of alpha T times each; of depth the median, or NAN
} Drawn;

typedef struct Flat { // a splat
    double x, y, conic[3], opacity, z, cover, color[4];
} Flat;

static int nearer(const void *a, const void *b)
{
    double x = ((const Flat *)a)->z, y = ((const Flat *)b)->z;
    return (x > y) - (x < y);
}

static void rotation_of(const float *quat, double r[3][3])
{
    double length = sqrt((double)(quat[0] * quat[0] + quat[1] * quat[1] + quat[2] * quat[2] + quat[3] * quat[3]));
    double w = quat[0] / length, v[3] = {quat[1] / length, quat[2] / length, quat[3] / length};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) r[i][j] = 2 * v[i] * v[j] + (i == j ? 2 * w * w - 1 : 0);
    r[0][1] -= 2 * w * v[2], r[1][0] += 2 * w * v[2];
    r[0][2] += 2 * w * v[1], r[2][0] -= 2 * w * v[1];
    r[1][2] -= 2 * w * v[0], r[2][1] += 2 * w * v[0];
}

static Flat flatten(const Cloud *cloud, int i, const Camera *cam)
{
    const float *mean = cloud->field[CLOUD_MEANS] + 3 * i, *scale = cloud->field[CLOUD_SCALES] + 3 * i;
    double p[3], rq[3][3], cov[3] = {0.3, 0, 0.3};
    for (int r = 0; r < 3; r++)
        p[r] = cam->w2c[4 * r] * mean[0] + cam->w2c[4 * r + 1] * mean[1] + cam->w2c[4 * r + 2] * mean[2] +
               cam->w2c[4 * r + 3];
    rotation_of(cloud->field[CLOUD_QUATS] + 4 * i, rq);
    for (int k = 0; k < 3; k++) { // the image of each axis
        double axis[3] = {0};
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++) axis[r] += cam->w2c[4 * r + c] * rq[c][k] * exp((double)scale[k]);
        double u = cam->fx / p[2] * (axis[0] - p[0] / p[2] * axis[2]),
               v = cam->fy / p[2] * (axis[1] - p[1] / p[2] * axis[2]);
        cov[0] += u * u, cov[1] += u * v, cov[2] += v * v;
    }
    double det = cov[0] * cov[2] - cov[1] * cov[1];
    return (Flat){.x = cam->fx * p[0] / p[2] + cam->cx,
                  .y = cam->fy * p[1] / p[2] + cam->cy,
                  .conic = {cov[2] / det, -cov[1] / det, cov[0] / det},
                  .opacity = 1 / (1 + exp(-(double)cloud->field[CLOUD_OPACITIES][i])),
                  .z = p[2]};
}

// alpha of the flash on a Gaussian (kernels/shade.h), times `share`; 0 without flash.
static double flash_gain(const Scene *s, const Cloud *cloud, int i, const Camera *cam, double share, int channel)
{
    if (share == 0) return 0;
    double centre[3], d2 = 0, gain = cloud->width[CLOUD_GAINS] ? exp((double)cloud->field[CLOUD_GAINS][i]) : 1;
    fs_camera_centre(cam, centre);
    for (int k = 0; k < 3; k++) d2 += pow((double)cloud->field[CLOUD_MEANS][3 * i + k] - centre[k], 2);
    double fall = s->separation == SEPARATION_LINEAR ? 1 : s->flash_distance * s->flash_distance / d2;
    return s->gain_color[channel] * share * gain * fall;
}

static Drawn draw(const Scene *s, const Cloud *cloud, const Camera *cam, double share, const double at[2])
{
    Flat flat[DRAWN_MOST];
    Drawn d = {.transmittance = 1};
    int channels = cloud->n ? cloud->width[CLOUD_COLORS] : 0;
    for (int i = 0; i < cloud->n; i++) {
        flat[i] = flatten(cloud, i, cam);
        flat[i].cover = cloud->width[CLOUD_COVERS] ? (double)cloud->field[CLOUD_COVERS][i] : 0;
        for (int c = 0; c < channels; c++)
            flat[i].color[c] = (double)cloud->field[CLOUD_COLORS][channels * i + c] *
                               (channels == 3 ? pow(1 + flash_gain(s, cloud, i, cam, share, c), 0.22) : 1);
    }
    qsort(flat, (size_t)cloud->n, sizeof *flat, nearer);
    for (int i = 0; i < cloud->n && d.transmittance >= 1e-4; i++) {
        double x = at[0] - flat[i].x, y = at[1] - flat[i].y;
        double q = flat[i].conic[0] * x * x + 2 * flat[i].conic[1] * x * y + flat[i].conic[2] * y * y;
        double alpha = fmin(flat[i].opacity * exp(-q / 2), 0.99);
        if (alpha < 1 / 255.0) continue;
        for (int c = 0; c < channels; c++) d.color[c] += alpha * d.transmittance * flat[i].color[c];
        double after = d.transmittance * (1 - alpha);
        if (fabs(after - 0.5) < 1e-3) d.depth = NAN; // this one or the next, by rounding
        if (d.transmittance >= 0.5 && after < 0.5 && !isnan(d.depth)) d.depth = flat[i].z;
        d.cover += alpha * d.transmittance * flat[i].cover;
        d.transmittance *= 1 - alpha;
    }
    return d;
}

static double decode(double toned)
{
    return toned < 0.03 ? toned * pow(0.03, 1 / 0.22) / 0.03 : pow(toned, 1 / 0.22);
}

// All layers at one pixel, as the equations say: want[layer][channel].
static void all_layers(const Scene *s, const Camera *cam, int x, int y, double want[RENDER_LAYERS][3])
{
    const double at[2] = {x + 0.5, y + 0.5};
    double ray[3] = {(at[0] - cam->cx) / cam->fx, (at[1] - cam->cy) / cam->fy, 1}, dot = 0, length = 0;
    for (int k = 0; k < 3; k++) {
        double world = cam->w2c[k] * ray[0] + cam->w2c[4 + k] * ray[1] + cam->w2c[8 + k];
        dot += world * s->pane.normal[k];
        length += world * world;
    }
    double rho = 1 + 22 * pow(1 - fabs(dot) / sqrt(length), 5);
    double beta = fmin(s->pane.f0 * rho, 0.97), tau = (1 - fmin(s->pane.dimming * rho, 0.97)) / (1 - s->pane.dimming);
    if (!s->pane_beta) beta = 1 / (1 + exp(-draw(s, &s->cloud[LAYER_BETA], cam, 0, at).color[0])), tau = 1;
    bool lit = fs_scene_lit(s);
    Drawn T = draw(s, &s->cloud[LAYER_T_N], cam, 0, at), R = draw(s, &s->cloud[LAYER_R], cam, 0, at);
    beta *= 1 - fmin(T.cover / 0.9, 1); // nothing is mirrored before bars
    Drawn T_F = draw(s, &s->cloud[s->shared_geometry ? LAYER_T_N : LAYER_T_F], cam, lit ? 1 : 0, at);
    Drawn R_F = draw(s, &s->cloud[LAYER_R], cam, lit ? s->flash_return : 0, at);
    for (int c = 0; c < 3; c++) {
        want[RENDER_T_N][c] = tau * decode(T.color[c]);
        want[RENDER_T_F][c] = tau * decode(T_F.color[c]);
        want[RENDER_R_SCENE][c] = decode(R.color[c]);
        want[RENDER_R][c] = beta * decode(R.color[c]);
        want[RENDER_I_N][c] = want[RENDER_T_N][c] + want[RENDER_R][c];
        want[RENDER_I_F][c] = want[RENDER_T_F][c] + beta * decode(R_F.color[c]);
    }
    want[RENDER_BETA][0] = beta;
    want[RENDER_DEPTH_T][0] = T.depth;
    want[RENDER_DEPTH_R][0] = R.depth;
}

#endif
