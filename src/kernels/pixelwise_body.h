// pixelwise.h in plain C: the scalar definition, and its twins by what the compiler makes of it for their instruction
// sets.
#include <math.h>

static void sigmoid(const Planes *logit, const Planes *out, int y0, int y1)
{
    for (int y = y0; y < y1; y++) {
        const float *in = fs_planes_row(logit, 0, y);
        float *row = fs_planes_row(out, 0, y);
        for (int x = 0; x < out->stride; x++) row[x] = 1 / (1 + expf(-in[x]));
    }
}

static void sigmoid_backward(const Planes *out, const Planes *d_out, const Planes *d_logit, int y0, int y1)
{
    for (int y = y0; y < y1; y++) {
        const float *s = fs_planes_row(out, 0, y), *d_s = fs_planes_row(d_out, 0, y);
        float *d = fs_planes_row(d_logit, 0, y);
        for (int x = 0; x < out->width; x++) d[x] = d_s[x] * s[x] * (1 - s[x]);
    }
}

#define COVER_ALL 0.9f

static float covered(float m)
{
    return m < COVER_ALL ? m / COVER_ALL : 1;
}

static void cover(const Planes *m, const Planes *beta, const Planes *hidden, int y0, int y1)
{
    for (int y = y0; y < y1; y++) {
        const float *p = fs_planes_row(m, 0, y), *b = fs_planes_row(beta, 0, y);
        float *to = fs_planes_row(hidden, 0, y);
        for (int x = 0; x < m->stride; x++) to[x] = (1 - covered(p[x])) * b[x]; // the padding stays finite
    }
}

static void cover_backward(const Planes *m, const Planes *beta, const Planes *d_beta, const Planes *d_m, int y0, int y1)
{
    for (int y = y0; y < y1; y++) {
        const float *p = fs_planes_row(m, 0, y), *b = fs_planes_row(beta, 0, y);
        float *d_b = fs_planes_row(d_beta, 0, y), *d = fs_planes_row(d_m, 0, y);
        for (int x = 0; x < m->width; x++) {
            d[x] = p[x] < COVER_ALL ? -b[x] * d_b[x] / COVER_ALL : 0;
            d_b[x] *= 1 - covered(p[x]);
        }
    }
}

static void clipped(const Planes *mask, const Planes *photo, const Planes *I, const Planes *out, int y0, int y1)
{
    for (int y = y0; y < y1; y++) {
        const float *m = fs_planes_row(mask, 0, y), *p[3], *q[3];
        float *to = fs_planes_row(out, 0, y);
        for (int c = 0; c < 3; c++) p[c] = fs_planes_row(photo, c, y), q[c] = fs_planes_row(I, c, y);
        for (int x = 0; x < mask->stride; x++) { // the padding stays finite
            float darker = 0;
            for (int c = 0; c < 3; c++) darker += p[c][x] - q[c][x];
            to[x] = darker > 0 && m[x] < 1 ? 1 : m[x];
        }
    }
}

static double opaque(const Planes *passes, float weight, const Planes *d_passes, int y0, int y1)
{
    enum { LANES = 16 };
    const float share = (float)(1 / ((double)passes->width * passes->height));
    double sum = 0;
    for (int y = y0; y < y1; y++) {
        const float *p = fs_planes_row(passes, 0, y);
        float *d = fs_planes_row(d_passes, 0, y), part[LANES] = {0};
        int x = 0;
        for (; x + LANES <= passes->width; x += LANES)
            for (int k = 0; k < LANES; k++) part[k] += p[x + k];
        for (; x < passes->width; x++) part[x % LANES] += p[x];
        for (int i = 0; i < passes->width; i++) d[i] = weight * share;
        for (int k = 0; k < LANES; k++) sum += (double)(part[k] * share);
    }
    return sum;
}

static double apart(const ApartArgs *args, int y0, int y1)
{
    const Planes *a = args->a;
    const float share = (float)(1 / ((double)a->width * a->height)), slope = args->weight * share;
    double sum = 0;
    for (int y = y0; y < y1; y++) {
        const float *p = fs_planes_row(a, 0, y), *q = fs_planes_row(args->b, 0, y);
        float *d_p = fs_planes_row(args->d_a, 0, y), *d_q = fs_planes_row(args->d_b, 0, y);
        for (int x = 0; x < a->width; x++) {
            float d = p[x] - q[x], sign = d > 0 ? slope : d < 0 ? -slope : 0;
            sum += (double)(fabsf(d) * share);
            d_p[x] += sign;
            d_q[x] -= sign;
        }
    }
    return sum;
}
