// The gain kernels: their twins against the scalar definition, the graph against the stated loss over each Gaussian's
// nearest neighbours, and gradients of that loss by finite differences in double.
#include "check.h"
#include "engine/host_engine.h"

enum { N = 300, K = ENGINE_NEIGHBOURS };

static int neighbour[N * K];
static float gains[N];

// As kernels/gain.h states it.
static double stated_loss(const double *g)
{
    double sum = 0, e = (double)FS_GAIN_EPSILON;
    for (int i = 0; i < N; i++)
        for (int k = 0; k < K; k++) {
            double x = g[i] - g[neighbour[i * K + k]];
            sum += (sqrt(x * x + e * e) - e) / K;
        }
    return sum / N;
}

static void make(void)
{
    Rng rng = fs_rng_new(4);
    for (int i = 0; i < N; i++) {
        gains[i] = fs_rng_normal(&rng);
        for (int k = 0; k < K; k++) { // near in number, not always both ways
            int j = (i + 1 + fs_rng_below(&rng, 5) + 5 * k * (k % 2 ? 1 : -1) + N) % N;
            neighbour[i * K + k] = j == i ? (i + 40) % N : j;
        }
    }
}

static double smooth(const GainKernels *k, const GainGraph *graph, float *d)
{
    double sum = 0;
    for (int i = 0; i < N; i++) d[i] = 0.25f;
    FOR_STRIPS(N, 77, a, b) sum += k->smooth(graph, gains, a, b, 0.6f, d);
    return sum;
}

static void check_gradient(const float *d)
{
    double g[N];
    int checked = 0;
    for (int i = 0; i < N; i++) g[i] = gains[i];
    for (int i = 0; i < N; i += 3) {
        const double step = 1e-6;
        g[i] = gains[i] + step;
        double up = stated_loss(g);
        g[i] = gains[i] - step;
        double down = stated_loss(g);
        g[i] = gains[i];
        double want = 0.25 + (double)0.6f * (up - down) / (2 * step);
        CHECK(fabs(d[i] - want) < 2e-6, "gain %d: gradient %g, differences %g", i, d[i], want);
        checked += fabs(want - 0.25) > 1e-4;
    }
    CHECK(checked > N / 6, "%d gradients are something", checked);
}

static void check_push(void)
{
    float ref[N];
    double want = 0;
    for (int i = 0; i < N; i++) want += gains[i] < 0 ? -gains[i] : 0;
    FOR_LEVELS(level)
    {
        float d[N] = {0};
        double sum = fs_kernels_at(level).gain->push(gains, 0, N, 0.3f, d);
        CHECK(fabs(sum - want) < 1e-3, "%s: push %g, not %g", fs_cpu_name(level), sum, want);
        for (int i = 0; i < N; i++) CHECK(d[i] == (gains[i] < 0 ? -0.3f : 0), "push of %g: %g", gains[i], d[i]);
        if (level == CPU_SCALAR) memcpy(ref, d, sizeof ref);
        CHECK(memcmp(ref, d, sizeof ref) == 0, "%s: push", fs_cpu_name(level));
    }
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    make();
    GainGraph graph = {0};
    CHECK(fs_gain_graph_make(&graph, neighbour, N, NULL) == 0, "memory");
    float ref[N], d[N];
    double g[N];
    for (int i = 0; i < N; i++) g[i] = gains[i];
    double value = smooth(&fs_gain_scalar, &graph, ref);
    CHECK(fabs(value - stated_loss(g)) < 1e-6 && value > 0.5, "%g, stated %g", value, stated_loss(g));
    check_gradient(ref);
    FOR_LEVELS(level)
    {
        double sum = smooth(fs_kernels_at(level).gain, &graph, d);
        CHECK(fabs(sum - value) < 1e-6, "%s: %g, scalar %g", fs_cpu_name(level), sum, value);
        for (int i = 0; i < N; i++)
            CHECK(fabsf(d[i] - ref[i]) < 1e-6f, "%s %d: %g, scalar %g", fs_cpu_name(level), i, d[i], ref[i]);
    }
    check_push();
    fs_gain_graph_free(&graph);
    return check_end();
}
