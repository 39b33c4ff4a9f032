// The occlusion's twins against the scalar definition, and the definition's gradient against differences.
#include "check.h"

enum { W = 83, H = 61 };

typedef struct Case {
    Planes beta, hidden, d_hidden, d_beta;
    float q[OCCLUSION_CELLS], d_q[OCCLUSION_CELLS];
    const OcclusionKernels *k;
} Case;

static Case make(const OcclusionKernels *k)
{
    Rng rng = fs_rng_new(9);
    Case c = {.k = k,
              .beta = random_planes(W, H, 1, 0, 1, &rng),
              .hidden = random_planes(W, H, 1, 0, 1, &rng),
              .d_hidden = random_planes(W, H, 1, -1, 1, &rng),
              .d_beta = random_planes(W, H, 1, -1, 1, &rng)};
    for (int i = 0; i < OCCLUSION_CELLS; i++) c.q[i] = fs_rng_uniform(&rng);
    return c;
}
static void drop(Case *c)
{
    Planes *all[] = {&c->beta, &c->hidden, &c->d_hidden, &c->d_beta};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]->px);
}
static void run(void *context)
{
    Case *c = context;
    memset(c->d_q, 0, sizeof c->d_q);
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

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    Case ref = make(&fs_occlusion_scalar);
    run(&ref);
    check_definition(&ref);
    FOR_LEVELS(level)
    {
        Case c = make(fs_kernels_at(level).occlusion);
        run(&c);
        double worst = fmax(planes_difference(&ref.hidden, &c.hidden), planes_difference(&ref.d_beta, &c.d_beta));
        for (int i = 0; i < OCCLUSION_CELLS; i++) worst = fmax(worst, fabs((double)(ref.d_q[i] - c.d_q[i])));
        CHECK(worst < 1e-5, "%s: %g", fs_cpu_name(level), worst);
        BENCH("occlusion", level, "pixel", W * H, run, &c);
        drop(&c);
    }
    drop(&ref);
    return check_end();
}
