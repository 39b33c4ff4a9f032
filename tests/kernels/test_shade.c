#include "check.h"

enum { N = 517 };

typedef struct Case {
    float means[N * 3], colors[N * 3], gains[N], out[N * 3], d_out[N * 3], d_colors[N * 3], d_gains[N];
    double d_tint[3];
    ShadeLight light;
    float lit[N * 3], d_lit[N * 3], d_lit_gains[N], back[N * 3];
    unsigned char visible[N];
    const ShadeKernels *k;
} Case;

static void make(Case *c)
{
    Rng rng = fs_rng_new(13);
    *c = (Case){.light = {{0.1f, -0.3f, 0.2f}, 2.5f, {1.5f, 1.2f, 0.9f}}};
    for (int i = 0; i < N * 3; i++) {
        c->means[i] = 2 * fs_rng_normal(&rng);
        c->colors[i] = fs_rng_uniform(&rng);
        c->d_out[i] = fs_rng_normal(&rng);
    }
    for (int i = 0; i < N; i++) {
        c->gains[i] = fs_rng_normal(&rng);
        c->visible[i] = i % 7 != 3;
    }
    memcpy(c->means + 30, c->light.centre, sizeof c->light.centre); // at the flash itself
}
static void run_forward(void *context)
{
    Case *c = context;
    c->k->forward(&c->light, &(ShadeCloud){c->means, c->colors, c->gains}, 0, N, c->out);
}
static void run_backward(void *context)
{
    Case *c = context;
    c->k->backward(&c->light, &(ShadeCloud){c->means, c->colors, c->gains}, 0, N, c->d_out,
                   &(ShadeGradients){c->d_colors, c->d_gains}, c->d_tint);
}
static void run_lit(void *context)
{
    Case *c = context;
    memcpy(c->lit, c->colors, sizeof c->lit);
    memcpy(c->d_lit, c->d_out, sizeof c->d_lit);
    memcpy(c->d_lit_gains, c->gains, sizeof c->d_lit_gains);
    c->k->enter(&c->light, &(ShadeCloud){c->means, c->lit, c->gains}, c->visible, 0, N,
                &(ShadeGradients){c->d_lit, c->d_lit_gains});
    memcpy(c->back, c->lit, sizeof c->back);
    c->k->leave(&c->light, &(ShadeCloud){c->means, c->back, c->gains}, c->visible, 0, N);
}
static double difference(const float *a, const float *b, int n)
{
    double most = 0;
    for (int i = 0; i < n; i++) {
        double e = fabs((double)a[i] - b[i]) / (fabs((double)a[i]) + 0.1);
        if (!(e <= most)) most = e;
    }
    return most;
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    static Case ref, c;
    make(&ref);
    ref.k = &fs_shade_scalar;
    run_forward(&ref);
    run_backward(&ref);
    run_lit(&ref);
    CHECK(difference(ref.colors, ref.back, N * 3) < 1e-5, "enter and leave: %g",
          difference(ref.colors, ref.back, N * 3));
    for (int i = 0; i < N * 3; i++) { // by the formula, in double
        double d2 = 0, x = ref.light.flash_distance;
        for (int k = 0; k < 3; k++) d2 += pow((double)ref.means[i / 3 * 3 + k] - ref.light.centre[k], 2);
        if (d2 < 1e-4 * x * x) continue;
        double alpha = ref.light.tint[i % 3] * exp(ref.gains[i / 3]) * x * x / d2,
               want = ref.colors[i] * pow(1 + alpha, 0.22);
        CHECK(fabs(ref.out[i] - want) < 1e-5 * (want + 1), "%d: %g, formula %g", i, (double)ref.out[i], want);
    }
    FOR_LEVELS(level)
    {
        const char *name = fs_cpu_name(level);
        make(&c);
        c.k = fs_kernels_at(level).shade;
        run_forward(&c);
        run_backward(&c);
        CHECK(difference(ref.out, c.out, N * 3) < 1e-5, "%s out: %g", name, difference(ref.out, c.out, N * 3));
        const ShadeCloud none = {c.means, c.colors, NULL}, zero = {c.means, c.colors, c.d_lit_gains};
        c.k->forward(&c.light, &none, 0, N, c.lit); // no gains: all 0
        memset(c.d_lit_gains, 0, sizeof c.d_lit_gains);
        c.k->forward(&c.light, &zero, 0, N, c.back);
        CHECK(memcmp(c.lit, c.back, sizeof c.lit) == 0, "%s: forward without gains", name);
        c.k->backward(&c.light, &none, 0, N, c.d_out, &(ShadeGradients){c.lit, NULL}, c.d_tint);
        c.k->backward(&c.light, &zero, 0, N, c.d_out, &(ShadeGradients){c.back, c.d_gains}, c.d_tint);
        CHECK(memcmp(c.lit, c.back, sizeof c.lit) == 0, "%s: backward without gains", name);
        make(&c);
        c.k = fs_kernels_at(level).shade;
        run_forward(&c);
        run_backward(&c);
        run_lit(&c);
        double lit = difference(ref.lit, c.lit, N * 3), d_lit = difference(ref.d_lit, c.d_lit, N * 3),
               d_lit_gains = difference(ref.d_lit_gains, c.d_lit_gains, N), back = difference(ref.back, c.back, N * 3);
        CHECK(lit < 1e-5 && d_lit < 1e-5 && d_lit_gains < 1e-5 && back < 1e-5, "%s lit: %g %g %g %g", name, lit, d_lit,
              d_lit_gains, back);
        double e = difference(ref.d_colors, c.d_colors, N * 3), f = difference(ref.d_gains, c.d_gains, N);
        CHECK(e < 1e-5 && f < 1e-5, "%s gradients: %g %g", name, e, f);
        for (int k = 0; k < 3; k++)
            CHECK(fabs(c.d_tint[k] - ref.d_tint[k]) < 1e-4 * (1 + fabs(ref.d_tint[k])), "%s tint %g, scalar %g", name,
                  c.d_tint[k], ref.d_tint[k]);
        BENCH("shade forward", level, "splat", N, run_forward, &c);
        BENCH("shade backward", level, "splat", N, run_backward, &c);
    }
    return check_end();
}
