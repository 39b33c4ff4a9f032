// Twins of the pixelwise kernels against the scalar definition, and that against formulas in double.
#include "check.h"

enum { W = 83, H = 21 };

typedef struct Case {
    Planes m, open, hidden, d_open, d_m, logit, beta, d_beta, d_logit, mask, photo, I, weight, passes, d_passes, d_mask,
        d_passes_2;
    double mean, apart;
    const PixelwiseKernels *k;
} Case;

static Case make(const PixelwiseKernels *k)
{
    Rng rng = fs_rng_new(8);
    Case c = {.k = k,
              .m = random_planes(W, H, 1, 0, 1, &rng),
              .open = random_planes(W, H, 1, 0, 1, &rng),
              .hidden = random_planes(W, H, 1, 0, 1, &rng),
              .d_open = random_planes(W, H, 1, -1, 1, &rng),
              .d_m = random_planes(W, H, 1, -1, 1, &rng),
              .logit = random_planes(W, H, 1, -9, 9, &rng),
              .beta = random_planes(W, H, 1, 0, 1, &rng),
              .d_beta = random_planes(W, H, 1, -1, 1, &rng),
              .d_logit = random_planes(W, H, 1, -1, 1, &rng),
              .mask = random_planes(W, H, 1, -1, 2, &rng),
              .photo = random_planes(W, H, 3, 0, 1, &rng),
              .I = random_planes(W, H, 3, 0, 1, &rng),
              .weight = random_planes(W, H, 1, 0, 1, &rng),
              .passes = random_planes(W, H, 1, 0, 1, &rng),
              .d_passes = random_planes(W, H, 1, 0, 1, &rng),
              .d_mask = random_planes(W, H, 1, 0, 1, &rng),
              .d_passes_2 = random_planes(W, H, 1, 0, 1, &rng)};
    for (int i = 0; i < H * c.mask.stride; i++) c.mask.px[i] = fminf(fmaxf(c.mask.px[i], 0), 1);
    return c;
}
static void drop(Case *c)
{
    Planes *all[] = {&c->m,      &c->open,   &c->hidden,   &c->d_open, &c->d_m,       &c->logit,
                     &c->beta,   &c->d_beta, &c->d_logit,  &c->mask,   &c->photo,     &c->I,
                     &c->weight, &c->passes, &c->d_passes, &c->d_mask, &c->d_passes_2};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]->px);
}
static void run(void *context)
{
    Case *c = context;
    c->mean = c->apart = 0;
    memset(c->d_mask.px, 0, fs_planes_floats(W, H, 1) * sizeof(float));
    memset(c->d_passes_2.px, 0, fs_planes_floats(W, H, 1) * sizeof(float));
    FOR_STRIPS(H, 8, a, b)
    {
        c->k->sigmoid(&c->logit, &c->beta, a, b);
        c->k->cover(&c->m, &c->open, &c->hidden, a, b);
        c->k->cover_backward(&c->m, &c->open, &c->d_open, &c->d_m, a, b);
        c->k->sigmoid_backward(&c->beta, &c->d_beta, &c->d_logit, a, b);
        c->k->clipped(&c->mask, &c->photo, &c->I, &c->weight, a, b);
        ApartArgs apart = {&c->mask, &c->passes, &c->d_mask, &c->d_passes_2, 0.6f};
        c->apart += c->k->apart(&apart, a, b);
        c->mean += c->k->opaque(&c->passes, 0.7f, &c->d_passes, a, b);
    }
}

static double sigmoid(double x)
{
    return 1 / (1 + exp(-x));
}

static double hidden(double m, double beta)
{
    return (1 - fmin(m / 0.9, 1)) * beta;
}

static void check_cover(const Case *c)
{
    int whole = 0;
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            double m = fs_planes_row(&c->m, 0, y)[x], beta = fs_planes_row(&c->open, 0, y)[x], h = 1e-6;
            double d = fs_planes_row(&c->d_open, 0, y)[x], d_m = fs_planes_row(&c->d_m, 0, y)[x];
            double left = fs_planes_row(&c->hidden, 0, y)[x],
                   slope = (hidden(m + h, beta) - hidden(m - h, beta)) / (2 * h);
            CHECK(fabs(left - hidden(m, beta)) < 1e-6, "%g of %g behind %g", left, beta, m);
            if (fabs(m - 0.9) < 2 * h) continue;
            whole += m > 0.9;
            if (m > 0.9)
                CHECK(d == 0 && d_m == 0, "%g and %g behind %g", d, d_m, m);
            else
                CHECK(fabs(d_m * hidden(m, 1) - slope * d) < 1e-5, "slopes %g, %g at %g", d_m, d, m);
        }
    CHECK(whole > 0 && whole < W * H / 2, "%d covered", whole);
}

// The definition against the formulas; gradients against central differences.
static void check_definition(const Case *c)
{
    double mean = 0, apart = 0;
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            double u = fs_planes_row(&c->logit, 0, y)[x], h = 1e-5;
            double slope = (sigmoid(u + h) - sigmoid(u - h)) / (2 * h);
            double b = fs_planes_row(&c->beta, 0, y)[x], d = fs_planes_row(&c->d_logit, 0, y)[x];
            CHECK(fabs(b - sigmoid(u)) < 1e-6, "sigmoid(%g) is %g", u, b);
            CHECK(fabs(d - slope * fs_planes_row(&c->d_beta, 0, y)[x]) < 1e-6, "slope at %g: %g", u, d);
            double darker = 0, m = fs_planes_row(&c->mask, 0, y)[x], w = fs_planes_row(&c->weight, 0, y)[x];
            for (int k = 0; k < 3; k++)
                darker += fs_planes_row(&c->photo, k, y)[x] - (double)fs_planes_row(&c->I, k, y)[x];
            if (fabs(darker) > 1e-6) CHECK(w == (darker > 0 && m < 1 ? 1 : m), "mask %g of %g", w, m);
            mean += fs_planes_row(&c->passes, 0, y)[x] / (double)(W * H);
            double p = fs_planes_row(&c->passes, 0, y)[x], side = (m > p ? 0.6 : -0.6) / (W * H);
            apart += fabs(m - p) / (W * H);
            CHECK(fabs(fs_planes_row(&c->d_mask, 0, y)[x] - side) < 1e-9, "%d %d", x, y);
            CHECK(fabs(fs_planes_row(&c->d_passes_2, 0, y)[x] + side) < 1e-9, "%d %d", x, y);
            CHECK(fabs(fs_planes_row(&c->d_passes, 0, y)[x] - 0.7 / (W * H)) < 1e-9, "%d %d", x, y);
        }
    CHECK(fabs(c->apart - apart) < 1e-6 && apart > 0.2, "apart %g, not %g", c->apart, apart);
    CHECK(fabs(c->mean - mean) < 1e-6 && mean > 0.4, "mean %g, not %g", c->mean, mean);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    Case ref = make(&fs_pixelwise_scalar);
    run(&ref);
    check_definition(&ref);
    check_cover(&ref);
    FOR_LEVELS(level)
    {
        Case c = make(fs_kernels_at(level).pixelwise);
        run(&c);
        double worst = fmax(fmax(planes_difference(&ref.beta, &c.beta), planes_difference(&ref.d_logit, &c.d_logit)),
                            fmax(planes_difference(&ref.weight, &c.weight) + planes_difference(&ref.d_mask, &c.d_mask),
                                 planes_difference(&ref.d_passes, &c.d_passes)));
        worst = fmax(worst, planes_difference(&ref.hidden, &c.hidden) + planes_difference(&ref.d_open, &c.d_open) +
                                planes_difference(&ref.d_m, &c.d_m));
        CHECK(worst < 1e-5 && fabs(ref.mean - c.mean) + fabs(ref.apart - c.apart) < 1e-6, "%s: %g, mean %g",
              fs_cpu_name(level), worst, c.mean);
        BENCH("pixelwise", level, "pixel", W * H, run, &c);
        drop(&c);
    }
    drop(&ref);
    return check_end();
}
