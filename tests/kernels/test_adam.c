#include "check.h"

enum { N = 100000 };
typedef struct Case {
    float *x, *grad, *m, *v;
    unsigned char *visible;
    size_t n;
    int width;
    AdamRate rate;
    const AdamKernels *k;
} Case;

static void make(Case *c, size_t n, int width, int hidden)
{
    Rng rng = fs_rng_new(n);
    size_t all = n * (size_t)width;
    *c = (Case){calloc(all, 4), calloc(all, 4),        calloc(all, 4),
                calloc(all, 4), calloc(n, 1),          n,
                width,          fs_adam_rate(0.01, 3), NULL};
    for (size_t i = 0; i < all; i++) {
        c->x[i] = fs_rng_normal(&rng);
        c->grad[i] = i % 7 == 0 ? 0 : fs_rng_normal(&rng) * expf(10 * fs_rng_normal(&rng) - 10);
        c->m[i] = i % 14 == 0 ? 0 : c->grad[i] * fs_rng_uniform(&rng);
        c->v[i] = i % 14 == 0 ? 0 : c->grad[i] * c->grad[i];
    }
    for (size_t i = 0; i < n; i++)
        c->visible[i] = hidden == 0 || (i / 40 % 3 && (int)(fs_rng_u32(&rng) % 100) >= hidden);
}
static void drop(Case *c)
{
    free(c->x), free(c->grad), free(c->m), free(c->v), free(c->visible);
}
static double difference(const float *a, const float *b, size_t n)
{
    double most = 0;
    for (size_t i = 0; i < n; i++) most = fmax(most, fabs((double)a[i] - b[i]) / (fabs((double)a[i]) + 1e-30));
    return most;
}
static void run_dense(void *context)
{
    Case *c = context;
    c->k->step(&(AdamFields){c->x, c->grad, c->m, c->v}, c->n * (size_t)c->width, c->rate);
}
static void run_sparse(void *context)
{
    Case *c = context;
    c->k->step_sparse(&(AdamFields){c->x, c->grad, c->m, c->v}, c->n, c->width, c->visible, c->rate);
}

static void compare(size_t n, int width, int hidden)
{
    size_t all = n * (size_t)width;
    Case ref, before;
    make(&ref, n, width, hidden);
    make(&before, n, width, hidden);
    ref.k = &fs_adam_scalar;
    (hidden < 0 ? run_dense : run_sparse)(&ref);
    FOR_LEVELS(level)
    {
        Case c;
        make(&c, n, width, hidden);
        c.k = fs_kernels_at(level).adam;
        (hidden < 0 ? run_dense : run_sparse)(&c);
        double e = difference(ref.x, c.x, all), em = difference(ref.m, c.m, all), ev = difference(ref.v, c.v, all);
        CHECK(e < 1e-5 && em < 1e-5 && ev < 1e-5, "%s n %zu width %d: x %g m %g v %g", fs_cpu_name(level), n, width, e,
              em, ev);
        for (size_t i = 0; i < all && hidden >= 0; i++)
            if (!c.visible[i / (size_t)width])
                CHECK(c.x[i] == before.x[i] && c.m[i] == before.m[i] && c.v[i] == before.v[i], "hidden row changed");
        drop(&c);
    }
    drop(&ref);
    drop(&before);
}

// Two steps by the formula, in double.
static void check_formula(void)
{
    float x = 1, g = 0.5f, m = 0, v = 0;
    double xd = 1, md = 0, vd = 0;
    for (int t = 1; t <= 2; t++) {
        fs_adam_scalar.step(&(AdamFields){&x, &g, &m, &v}, 1, fs_adam_rate(0.1, t));
        md = 0.9 * md + 0.1 * g, vd = 0.999 * vd + 0.001 * g * g;
        xd -= 0.1 * (md / (1 - pow(0.9, t))) / (sqrt(vd / (1 - pow(0.999, t))) + 1e-15);
        g = -0.2f;
    }
    CHECK(fabs(x - xd) < 1e-6, "%g, formula %g", (double)x, xd);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    check_formula();
    for (size_t n = 1; n < 70; n += 5)
        for (int width = 1; width <= 6; width++) {
            compare(n, width, -1);
            compare(n, width, 0);
            compare(n, width, 50);
        }
    compare(1000, 3, 90);
    if (bench_wanted) FOR_LEVELS(level)
        {
            Case c;
            make(&c, N, 3, 60);
            c.k = fs_kernels_at(level).adam;
            BENCH("adam dense", level, "parameter", N * 3, run_dense, &c);
            BENCH("adam 73% hidden", level, "parameter", N * 3, run_sparse, &c);
            drop(&c);
        }
    return check_end();
}
