#include "check.h"

typedef struct Case {
    Planes I, Y, mu_Y, var_Y, mask, d_I;
    PhotometricArgs args;
    PhotometricSums sums;
    const PhotometricKernels *k;
} Case;

// masked: a mask with zeros, ones and parts; plain: no mask.
static void make(Case *c, int width, int height, bool masked, const float share[2])
{
    Rng rng = fs_rng_new((uint64_t)(width * 1000 + height));
    *c = (Case){.I = random_planes(width, height, 3, 0, 1, &rng),
                .Y = random_planes(width, height, 3, 0, 1, &rng),
                .mu_Y = random_planes(width, height, 3, 0, 1, &rng),
                .var_Y = random_planes(width, height, 3, 0, 1, &rng),
                .mask = random_planes(width, height, 1, -1, 2, &rng),
                .d_I = random_planes(width, height, 3, -9, 9, &rng)};
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float *m = fs_planes_row(&c->mask, 0, y) + x;
            *m = fminf(fmaxf(*m, 0), 1);
            for (int ch = 0; ch < 3; ch++) // smooth enough that the windows' statistics matter
                fs_planes_row(&c->I, ch, y)[x] =
                    0.5f + 0.3f * sinf(0.2f * (float)(x + ch)) + 0.1f * fs_planes_row(&c->I, ch, y)[x];
            if ((x + y) % 5 == 0) fs_planes_row(&c->Y, 1, y)[x] = fs_planes_row(&c->I, 1, y)[x];
        }
    c->args =
        (PhotometricArgs){&c->I,    &c->Y,    &c->mu_Y, &c->var_Y, masked ? &c->mask : NULL,
                          share[0], share[1], 3.0f,     &c->d_I,   aligned_alloc(64, fs_photometric_scratch(width))};
    memset(c->args.scratch, 0x7f, fs_photometric_scratch(width));
}
static void drop(Case *c)
{
    Planes *all[] = {&c->I, &c->Y, &c->mu_Y, &c->var_Y, &c->mask, &c->d_I};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]->px);
    free(c->args.scratch);
}
static void run(Case *c, const PhotometricKernels *k, int rows)
{
    c->k = k;
    c->sums = (PhotometricSums){0, 0, 0};
    FOR_STRIPS(c->Y.height, rows, a, b) k->target_stats(&c->args, a, b);
    FOR_STRIPS(c->Y.height, rows, a, b)
    {
        PhotometricSums s = k->loss(&c->args, a, b);
        c->sums.l1 += s.l1;
        c->sums.dssim += s.dssim;
        c->sums.contrast += s.contrast;
    }
}
static void run_loss(void *context)
{
    Case *c = context;
    FOR_STRIPS(c->Y.height, 50, a, b) c->k->loss(&c->args, a, b);
}

// All three straight from their definitions, in double.
static PhotometricSums direct(const Case *c)
{
    double w[11], sum = 0;
    for (int i = 0; i < 11; i++) sum += w[i] = exp(-(i - 5) * (i - 5) / 4.5);
    PhotometricSums s = {0, 0, 0};
    for (int ch = 0; ch < 3; ch++)
        for (int y = 0; y < c->Y.height; y++)
            for (int x = 0; x < c->Y.width; x++) {
                double m = c->args.mask ? fs_planes_row(&c->mask, 0, y)[x] : 1;
                double e[7] = {0};
                for (int j = -5; j <= 5; j++)
                    for (int i = -5; i <= 5; i++) {
                        if (y + j < 0 || y + j >= c->Y.height || x + i < 0 || x + i >= c->Y.width) continue;
                        double k = w[i + 5] * w[j + 5] / (sum * sum);
                        double a = fs_planes_row(&c->I, ch, y + j)[x + i], b = fs_planes_row(&c->Y, ch, y + j)[x + i];
                        if (c->args.mask) a = b + fs_planes_row(&c->mask, 0, y + j)[x + i] * (a - b);
                        e[0] += k * a, e[1] += k * b, e[2] += k * a * a, e[3] += k * b * b, e[4] += k * a * b;
                        e[5] += k * (a - b), e[6] += k * (a - b) * (a - b);
                    }
                double ssim = (2 * e[0] * e[1] + 1e-4) * (2 * (e[4] - e[0] * e[1]) + 9e-4) /
                              ((e[0] * e[0] + e[1] * e[1] + 1e-4) * (e[2] - e[0] * e[0] + e[3] - e[1] * e[1] + 9e-4));
                s.l1 += m * fabs((double)fs_planes_row(&c->I, ch, y)[x] - fs_planes_row(&c->Y, ch, y)[x]);
                s.dssim += m * (1 - ssim);
                s.contrast += m * (e[6] - e[5] * e[5]) / (2 * (e[3] - e[1] * e[1]) + 1e-4);
            }
    double n = 3.0 * c->Y.width * c->Y.height;
    bool dssim = c->args.lambda > 0, contrast = c->args.kappa > 0;
    return (PhotometricSums){s.l1 / n, dssim ? s.dssim / n : 0, contrast ? s.contrast / n : 0};
}

static bool near(const PhotometricSums *a, const PhotometricSums *b, double far)
{
    return fabs(a->l1 - b->l1) < far && fabs(a->dssim - b->dssim) < far && fabs(a->contrast - b->contrast) < 5 * far;
}

static void compare(int width, int height, bool masked)
{
    static const float shares[4][2] = {{0.2f, 0}, {0, 0.1f}, {0.2f, 0.3f}, {0, 0}};
    const float *share = shares[width % 4];
    Case ref;
    make(&ref, width, height, masked, share);
    run(&ref, &fs_photometric_scalar, height);
    PhotometricSums d = direct(&ref);
    CHECK(near(&d, &ref.sums, 1e-5), "%dx%d: %g %g %g, definition %g %g %g", width, height, ref.sums.l1, ref.sums.dssim,
          ref.sums.contrast, d.l1, d.dssim, d.contrast);
    FOR_LEVELS(level)
    {
        Case c;
        make(&c, width, height, masked, share);
        run(&c, fs_kernels_at(level).photometric, 7);
        const char *name = fs_cpu_name(level);
        double e = planes_difference(&ref.mu_Y, &c.mu_Y), v = planes_difference(&ref.var_Y, &c.var_Y);
        CHECK(e < 1e-6 && v < 1e-5, "%s %dx%d stats: %g %g", name, width, height, e, v);
        e = planes_difference(&ref.d_I, &c.d_I);
        CHECK(e < 2e-4, "%s %dx%d d_I: %g", name, width, height, e);
        CHECK(near(&c.sums, &ref.sums, 1e-5), "%s %g %g %g, %g %g %g", name, c.sums.l1, c.sums.dssim, c.sums.contrast,
              ref.sums.l1, ref.sums.dssim, ref.sums.contrast);
        PhotometricSums whole = c.sums;
        c.args.d_I = NULL; // value only: the same number
        run(&c, c.k, 3);
        CHECK(near(&c.sums, &whole, 1e-9), "%s value only", name);
        drop(&c);
    }
    drop(&ref);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    for (int width = 1; width < 40; width += 3) compare(width, 3 + width % 19, width & 4);
    compare(77, 40, true);
    compare(64, 33, false);
    static const int sizes[2][2] = {{300, 200}, {1200, 800}};
    for (int i = 0; i < 2 && bench_wanted; i++)
        for (int masked = 0; masked < 2; masked++) {
            Case c;
            make(&c, sizes[i][0], sizes[i][1], masked, (const float[2]){0, 0.1f});
            FOR_LEVELS(level)
            {
                if (i && level == CPU_SCALAR) continue;
                c.k = fs_kernels_at(level).photometric;
                c.k->target_stats(&c.args, 0, c.Y.height);
                printf("%4d x %-4d %-9s ", sizes[i][0], sizes[i][1], masked ? "mask" : "");
                BENCH("photometric", level, "value", 3 * sizes[i][0] * sizes[i][1], run_loss, &c);
            }
            drop(&c);
        }
    return check_end();
}
