// Twins of the kernels for samples along a ray against the scalar definition; that is held against finite differences
// in tests/grad/test_volume.c.
#include "check.h"

enum { N = 37, KEPT = 21, CHANNELS = 5, STRIDE = 32 };

typedef struct Case {
    float logarithm[N], tau[N], w[2][N], d_tau[N], d_logarithm[N], d_w[N];
    float x[CHANNELS * STRIDE], d_x[CHANNELS * STRIDE], out[CHANNELS], passes[2];
} Case;

static void run(const VolumeKernels *k, Case *t)
{
    Rng rng = fs_rng_new(5);
    int of[KEPT];
    float d_out[CHANNELS];
    memset(t, 0, sizeof *t);
    for (int i = 0; i < KEPT; i++) of[i] = i + i / 2;
    for (int i = 0; i < N; i++) t->logarithm[i] = i == 30 ? 20 : fs_rng_normal(&rng) - 3;
    for (int i = 0; i < CHANNELS * STRIDE; i++) t->x[i] = fs_rng_uniform(&rng);
    for (int i = 0; i < CHANNELS; i++) d_out[i] = fs_rng_normal(&rng);
    VolumeBlend blend = {t->w[0], of, t->x, KEPT, CHANNELS, STRIDE};
    k->thickness(t->logarithm, N, t->tau);
    for (int far = 0; far < 2; far++) t->passes[far] = k->weights(t->tau, N, far == 1, t->w[far]);
    k->blend(&blend, t->out);
    k->blend_backward(&blend, d_out, t->d_x, t->d_w);
    for (int far = 0; far < 2; far++) k->weights_backward(t->w[far], N, far == 1, t->d_w, 0.3f, t->d_tau);
    k->thickness_backward(t->logarithm, t->tau, t->d_tau, N, t->d_logarithm);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    Case ref, twin;
    run(&fs_volume_scalar, &ref);
    for (int far = 0; far < 2; far++) {
        double sum = (double)ref.passes[far];
        for (int i = 0; i < N; i++) sum += (double)ref.w[far][i];
        CHECK(fabs(sum - 1) < 1e-5, "weights and what passes add up to %g", sum);
    }
    CHECK(ref.d_logarithm[30] == 0 && ref.d_logarithm[29] != 0, "thicker than the thickest has no slope");
    FOR_LEVELS(level)
    {
        double worst = 0;
        run(fs_kernels_at(level).volume, &twin);
        const float *a = ref.logarithm, *b = twin.logarithm;
        for (size_t i = 0; i < sizeof ref / sizeof *a; i++)
            worst = fmax(worst, fabs((double)a[i] - (double)b[i]) / (1 + fabs((double)a[i])));
        CHECK(worst < 1e-5, "%s: %g", fs_cpu_name(level), worst);
    }
    return check_end();
}
