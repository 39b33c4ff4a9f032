// The occlusion's twins against the scalar definition, and the definition's gradient against differences.
#include "check.h"

enum { W = 83, H = 61 };

typedef struct Case {
    Planes beta, hidden, d_hidden, d_beta, R, d_R, render;
    float q[OCCLUSION_CELLS], d_q[OCCLUSION_CELLS], around[3 * OCCLUSION_CELLS];
    OcclusionSums open, differ;
    double apart;
    const OcclusionKernels *k;
} Case;

static Case make(const OcclusionKernels *k)
{
    Rng rng = fs_rng_new(9);
    Case c = {.k = k,
              .beta = random_planes(W, H, 1, 0, 1, &rng),
              .hidden = random_planes(W, H, 1, 0, 1, &rng),
              .d_hidden = random_planes(W, H, 1, -1, 1, &rng),
              .d_beta = random_planes(W, H, 1, -1, 1, &rng),
              .R = random_planes(W, H, 3, 0, 1, &rng),
              .d_R = random_planes(W, H, 3, 0, 0, &rng),
              .render = random_planes(W, H, 3, 0, 1, &rng)};
    for (int i = 0; i < OCCLUSION_CELLS; i++) {
        c.q[i] = fs_rng_uniform(&rng);
        if (i % OCCLUSION_WIDTH < 20) c.q[i] *= 0.2f; // some of it open
        for (int at = 3 * i; at < 3 * i + 3; at++) c.around[at] = fs_rng_uniform(&rng);
    }
    return c;
}
static void drop(Case *c)
{
    Planes *all[] = {&c->beta, &c->hidden, &c->d_hidden, &c->d_beta, &c->R, &c->d_R, &c->render};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]->px);
}
static void run(void *context)
{
    Case *c = context;
    OcclusionAroundArgs args = {c->q, &c->R, &c->d_R, c->around, 0.7f};
    memset(c->d_q, 0, sizeof c->d_q);
    memset(&c->open, 0, sizeof c->open);
    c->apart = 0;
    fs_planes_zero(&c->d_R, 0, H);
    FOR_STRIPS(H, 8, a, b) c->k->open(c->q, &c->R, &c->open, a, b);
    memset(&c->differ, 0, sizeof c->differ);
    FOR_STRIPS(H, 8, a, b) c->k->differ(&c->R, &c->render, &c->beta, &c->differ, a, b);
    FOR_STRIPS(H, 8, a, b) c->apart += c->k->apart(&args, a, b);
    FOR_STRIPS(H, 8, a, b)
    {
        c->k->forward(c->q, &c->beta, &c->hidden, a, b);
        c->k->backward(c->q, &c->beta, &c->d_hidden, &c->d_beta, a, b, c->d_q);
    }
}

// Sum of d_hidden * hidden, whose gradients backward gives.
static double sum(const Case *c, const float *q)
{
    double s = 0;
    c->k->forward(q, &c->beta, &c->hidden, 0, H);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            s += (double)fs_planes_row(&c->hidden, 0, y)[x] * (double)fs_planes_row(&c->d_hidden, 0, y)[x];
    return s;
}

static void check_definition(Case *c)
{
    float q[OCCLUSION_CELLS];
    for (int i = 0; i < OCCLUSION_CELLS; i++) q[i] = 0.25f;
    sum(c, q);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            CHECK(fabsf(fs_planes_row(&c->hidden, 0, y)[x] - 0.75f * fs_planes_row(&c->beta, 0, y)[x]) < 1e-6f, "%d %d",
                  x, y);
    const int at[] = {0, 7, OCCLUSION_WIDTH - 1, 5 * OCCLUSION_WIDTH + 20, OCCLUSION_CELLS - 1};
    for (size_t k = 0; k < sizeof at / sizeof *at; k++) { // linear in q: any step will do
        double side[2];
        for (int s = 0; s < 2; s++) {
            memcpy(q, c->q, sizeof q);
            q[at[k]] += s ? 0.5f : -0.5f;
            side[s] = sum(c, q);
        }
        double g = (double)c->d_q[at[k]];
        CHECK(fabs(side[1] - side[0] - g) < 1e-4 + 1e-3 * fabs(g), "cell %d: %g, differences %g", at[k], g,
              side[1] - side[0]);
    }
    sum(c, c->q);
    double with = 0, beta = 0; // hidden is linear in beta, so d_beta * beta sums up to it
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            with += (double)fs_planes_row(&c->hidden, 0, y)[x] * (double)fs_planes_row(&c->d_hidden, 0, y)[x];
            beta += (double)fs_planes_row(&c->beta, 0, y)[x] * (double)fs_planes_row(&c->d_beta, 0, y)[x];
        }
    CHECK(fabs(with - beta) < 1e-3, "%g %g", with, beta);
}

// The gradient of apart, with `around` as it is, along itself.
static void check_apart(Case *c)
{
    const double h = 1e-3;
    double value[2], along = 0, seen = 0, all = 0;
    Planes none = c->hidden, moved = c->R; // d_R of no interest
    none.px = calloc(3 * (size_t)c->R.stride * H, sizeof(float));
    none.channels = 3;
    moved.px = calloc(3 * (size_t)c->R.stride * H, sizeof(float));
    for (int side = 0; side < 2; side++) {
        along = 0;
        for (int k = 0; k < 3; k++)
            for (int y = 0; y < H; y++)
                for (int x = 0; x < W; x++) {
                    double d = (double)fs_planes_row(&c->d_R, k, y)[x] > 0   ? 1
                               : (double)fs_planes_row(&c->d_R, k, y)[x] < 0 ? -1
                                                                             : 0;
                    fs_planes_row(&moved, k, y)[x] = fs_planes_row(&c->R, k, y)[x] + (float)((side ? h : -h) * d);
                    along += (double)fs_planes_row(&c->d_R, k, y)[x] * d;
                }
        OcclusionAroundArgs args = {c->q, &moved, &none, c->around, 0};
        value[side] = c->k->apart(&args, 0, H);
    }
    double slope = 0.7 * (value[1] - value[0]) / (2 * h);
    CHECK(along > 0.05 && fabs(slope - along) < 0.01 * along, "gradient %g, differences %g", along, slope);
    for (int i = 0; i < OCCLUSION_CELLS; i++) seen += (double)c->open.n[i], all += (double)c->open.all[i];
    CHECK(all == W * H && seen > 0.05 * all && seen < 0.5 * all, "%g of %g pixels are open", seen, all);
    free(none.px);
    free(moved.px);
}

// The whole, and the last cell.
static void check_differ(const Case *c)
{
    double sum = 0, cells = 0, weights = 0, n = 0;
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            double w = (double)fs_planes_row(&c->beta, 0, y)[x];
            sum += w * (double)(fs_planes_row(&c->R, 1, y)[x] - fs_planes_row(&c->render, 1, y)[x]);
            weights += w;
        }
    for (int i = 0; i < OCCLUSION_CELLS; i++) cells += (double)c->differ.rgb[3 * i + 1], n += (double)c->differ.n[i];
    CHECK(fabs(cells - sum) < 1e-3 && fabs(n - weights) < 1e-2, "%g %g, weights %g %g", cells, sum, n, weights);
    double corner = 0, last = (double)c->differ.rgb[3 * OCCLUSION_CELLS - 1];
    for (int j = H - 1; j * OCCLUSION_HEIGHT / H == OCCLUSION_HEIGHT - 1; j--)
        for (int i = W - 1; i * OCCLUSION_WIDTH / W == OCCLUSION_WIDTH - 1; i--)
            corner += (double)(fs_planes_row(&c->beta, 0, j)[i] *
                               (fs_planes_row(&c->R, 2, j)[i] - fs_planes_row(&c->render, 2, j)[i]));
    CHECK(fabs(last - corner) < 1e-5, "%g, %g", last, corner);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    Case ref = make(&fs_occlusion_scalar);
    run(&ref);
    check_definition(&ref);
    check_apart(&ref);
    check_differ(&ref);
    FOR_LEVELS(level)
    {
        Case c = make(fs_kernels_at(level).occlusion);
        run(&c);
        double worst = fmax(planes_difference(&ref.hidden, &c.hidden), planes_difference(&ref.d_beta, &c.d_beta));
        for (int i = 0; i < OCCLUSION_CELLS; i++) worst = fmax(worst, fabs((double)(ref.d_q[i] - c.d_q[i])));
        worst = fmax(worst, fmax(1e3 * planes_difference(&ref.d_R, &c.d_R), fabs(ref.apart - c.apart)));
        for (int i = 0; i < 3 * OCCLUSION_CELLS; i++)
            worst = fmax(worst, fabs((double)(ref.differ.rgb[i] - c.differ.rgb[i])));
        for (int i = 0; i < 3 * OCCLUSION_CELLS; i++)
            worst = fmax(worst, fabs((double)(ref.open.rgb[i] - c.open.rgb[i])));
        CHECK(worst < 1e-5, "%s: %g", fs_cpu_name(level), worst);
        BENCH("occlusion", level, "pixel", W * H, run, &c);
        drop(&c);
    }
    drop(&ref);
    return check_end();
}
