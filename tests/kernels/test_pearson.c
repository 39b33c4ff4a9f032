#include "check.h"

typedef struct Case {
    Planes X, Y, X_linear, Y_linear, d_X, d_Y;
    PearsonArgs args;
    PearsonSums sums;
    const PearsonKernels *k;
} Case;

static void make(Case *c, int width, int height)
{
    Rng rng = fs_rng_new((uint64_t)width);
    *c = (Case){.X = random_planes(width, height, 3, -0.02f, 1, &rng),
                .Y = random_planes(width, height, 3, -0.02f, 1, &rng),
                .X_linear = random_planes(width, height, 3, 0, 1, &rng),
                .Y_linear = random_planes(width, height, 3, 0, 1, &rng),
                .d_X = random_planes(width, height, 3, 0, 1e-6f, &rng),
                .d_Y = random_planes(width, height, 3, 0, 1e-6f, &rng)};
    for (int ch = 0; ch < 3; ch++)
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++)
                fs_planes_row(&c->Y, ch, y)[x] =
                    0.6f * fs_planes_row(&c->X, ch, y)[x] + 0.4f * fs_planes_row(&c->Y, ch, y)[x];
    fs_compose_scalar.decode(&c->X, &c->X_linear, 0, height);
    fs_compose_scalar.decode(&c->Y, &c->Y_linear, 0, height);
    c->args = (PearsonArgs){&c->X, &c->Y, &c->X_linear, &c->Y_linear, &c->d_X, &c->d_Y, 0.5f};
}
static void drop(Case *c)
{
    Planes *all[] = {&c->X, &c->Y, &c->X_linear, &c->Y_linear, &c->d_X, &c->d_Y};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]->px);
}
static void run(Case *c, const PearsonKernels *k, int rows)
{
    c->k = k;
    c->sums = (PearsonSums){0};
    FOR_STRIPS(c->X.height, rows, a, b)
    {
        PearsonSums s = k->sums(&c->args, a, b);
        c->sums.n += s.n, c->sums.x += s.x, c->sums.y += s.y;
        c->sums.xx += s.xx, c->sums.yy += s.yy, c->sums.xy += s.xy;
    }
    FOR_STRIPS(c->X.height, rows, a, b) k->gradient(&c->args, &c->sums, a, b);
}
static void run_all(void *context)
{
    Case *c = context;
    run(c, c->k, 50);
}

// The correlation in two passes, in double.
static double direct(const Case *c)
{
    double n = 3.0 * c->X.width * c->X.height, m[2] = {0}, s[3] = {0};
    for (int pass = 0; pass < 2; pass++)
        for (int ch = 0; ch < 3; ch++)
            for (int y = 0; y < c->X.height; y++)
                for (int x = 0; x < c->X.width; x++) {
                    double u = fs_planes_row(&c->X_linear, ch, y)[x], v = fs_planes_row(&c->Y_linear, ch, y)[x];
                    if (pass == 0)
                        m[0] += u / n, m[1] += v / n;
                    else
                        s[0] += (u - m[0]) * (u - m[0]), s[1] += (v - m[1]) * (v - m[1]),
                            s[2] += (u - m[0]) * (v - m[1]);
                }
    return s[2] / sqrt(s[0] * s[1]);
}

static void compare(int width, int height)
{
    Case ref;
    make(&ref, width, height);
    run(&ref, &fs_pearson_scalar, height);
    double loss = fs_pearson_fit(&ref.sums).loss, definition = -direct(&ref);
    CHECK(fabs(loss - definition) < 1e-5, "%d: %g, definition %g", width, loss, definition);
    FOR_LEVELS(level)
    {
        Case c;
        make(&c, width, height);
        run(&c, fs_kernels_at(level).pearson, 3);
        double e = fabs(fs_pearson_fit(&c.sums).loss - loss);
        CHECK(e < 2e-6, "%s loss: %g", fs_cpu_name(level), e);
        CHECK(c.sums.n == 3.0 * width * height, "%s counts %g", fs_cpu_name(level), c.sums.n);
        e = fmax(planes_difference(&ref.d_X, &c.d_X), planes_difference(&ref.d_Y, &c.d_Y));
        CHECK(e < 1e-5, "%s gradient: %g", fs_cpu_name(level), e);
        drop(&c);
    }
    drop(&ref);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    for (int width = 2; width < 40; width += 3) compare(width, 7);
    compare(201, 11);
    Case flat; // images of one colour: no gradient, no NaN
    make(&flat, 20, 10);
    for (int i = 0; i < 3 * 10 * flat.X.stride; i++) flat.X_linear.px[i] = flat.Y_linear.px[i] = 0, flat.d_X.px[i] = 0;
    run(&flat, fs_kernels_at(fs_cpu_best()).pearson, 10);
    CHECK(fs_pearson_fit(&flat.sums).loss == 0, "flat");
    for (int i = 0; i < 20; i++) CHECK(flat.d_X.px[i] == 0, "flat gradient %g", (double)flat.d_X.px[i]);
    drop(&flat);
    if (bench_wanted) {
        Case c;
        make(&c, 300, 200);
        FOR_LEVELS(level)
        {
            c.k = fs_kernels_at(level).pearson;
            BENCH("pearson", level, "value", 3 * 300 * 200, run_all, &c);
        }
        drop(&c);
    }
    return check_end();
}
