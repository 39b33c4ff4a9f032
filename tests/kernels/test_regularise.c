// The regularisers' twins against the scalar definition.
#include "check.h"

enum { N = 1003 };

typedef struct Case {
    float x[N], d[N];
    double sum;
    const RegulariseKernels *k;
} Case;

static void run_sigmoid(void *context)
{
    Case *c = context;
    c->sum = c->k->sigmoid(c->x, N, 0.3f, c->d);
}
static void run_exp(void *context)
{
    Case *c = context;
    c->sum = c->k->exp(c->x, N, 0.3f, c->d);
}

static void make(Case *c, const RegulariseKernels *k)
{
    Rng rng = fs_rng_new(5);
    c->k = k;
    for (int i = 0; i < N; i++) {
        c->x[i] = 3 * fs_rng_normal(&rng);
        c->d[i] = fs_rng_normal(&rng);
    }
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    static Case before, ref, c;
    void (*const run[2])(void *) = {run_sigmoid, run_exp};
    const char *const name[2] = {"sigmoid", "exp"};
    for (int f = 0; f < 2; f++) {
        make(&before, NULL);
        make(&ref, &fs_regularise_scalar);
        run[f](&ref);
        double sum = 0;
        for (int i = 0; i < N; i++) { // the definition, in double
            double x = before.x[i], s = 1 / (1 + exp(-x)), want = before.d[i] + 0.3 * (f ? exp(x) : s * (1 - s));
            CHECK(fabs(ref.d[i] - want) < 1e-6 * (fabs(want) + 1), "%s %d: %g, not %g", name[f], i, ref.d[i], want);
            sum += f ? exp(x) : s;
        }
        CHECK(fabs(ref.sum - sum) < 1e-5 * sum, "%s: sum %g, not %g", name[f], ref.sum, sum);
        FOR_LEVELS(level)
        {
            make(&c, fs_kernels_at(level).regularise);
            run[f](&c);
            CHECK(fabs(c.sum - sum) < 1e-5 * sum, "%s %s: sum %g, not %g", name[f], fs_cpu_name(level), c.sum, sum);
            for (int i = 0; i < N; i++)
                CHECK(fabsf(c.d[i] - ref.d[i]) <= 1e-6f * (fabsf(ref.d[i]) + 1), "%s %s %d: %g, scalar %g", name[f],
                      fs_cpu_name(level), i, c.d[i], ref.d[i]);
            BENCH(name[f], level, "value", N, run[f], &c);
        }
    }
    return check_end();
}
