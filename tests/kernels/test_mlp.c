// Twins of the network's layers against the scalar definition, and that against sums in double.
#include "check.h"

enum { ROWS = 12, COLUMNS = 20, STRIDE = 96, BIG = 64, SAMPLES = 1024 };

typedef struct Case {
    MlpLayer layer;
    float *w, *x, *d_y, *y, *d_x, *d_w;
    const MlpKernels *k;
} Case;

static float *numbers(size_t n, Rng *rng)
{
    float *x = aligned_alloc(64, (sizeof(float) * n + 63) / 64 * 64);
    if (!x) abort();
    for (size_t i = 0; i < n; i++) x[i] = fs_rng_normal(rng);
    return x;
}

static Case make(const MlpKernels *k, int rows, int columns, size_t stride)
{
    Rng rng = fs_rng_new(3);
    size_t r = (size_t)rows, c = (size_t)columns;
    Case t = {
        {NULL, rows, columns, stride}, numbers(r * c, &rng),      numbers(c * stride, &rng), numbers(r * stride, &rng),
        numbers(r * stride, &rng),     numbers(c * stride, &rng), numbers(r * c, &rng),      k};
    t.layer.w = t.w;
    for (size_t i = 0; i < c * stride; i++) t.x[i] = fmaxf(t.x[i], 0);
    return t;
}

static void drop(Case *t)
{
    float *all[] = {t->w, t->x, t->d_y, t->y, t->d_x, t->d_w};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]);
}

static void run_forward(void *context)
{
    Case *t = context;
    t->k->forward(&t->layer, true, t->x, t->y);
}
static void run_back(void *context)
{
    Case *t = context;
    t->k->back(&t->layer, t->d_y, t->x, t->d_x);
}
static void run_weights(void *context)
{
    Case *t = context;
    t->k->weights(&t->layer, t->d_y, t->x, t->d_w);
}

static double worst;
static void compare(double sum, float got)
{
    worst = fmax(worst, fabs(sum - (double)got) / (1 + fabs(sum)));
}

// Every number of a case that ran once, against its definition.
static void check_case(const Case *t, const float *d_w_before)
{
    worst = 0;
    for (int s = 0; s < STRIDE; s++) {
        for (int r = 0; r < ROWS; r++) {
            double sum = 0;
            for (int c = 0; c < COLUMNS; c++) sum += (double)t->w[r * COLUMNS + c] * (double)t->x[c * STRIDE + s];
            compare(fmax(sum, 0), t->y[r * STRIDE + s]);
        }
        for (int c = 0; c < COLUMNS; c++) {
            double sum = 0;
            for (int r = 0; r < ROWS; r++) sum += (double)t->w[r * COLUMNS + c] * (double)t->d_y[r * STRIDE + s];
            compare(t->x[c * STRIDE + s] > 0 ? sum : 0, t->d_x[c * STRIDE + s]);
        }
    }
    for (int r = 0; r < ROWS; r++)
        for (int c = 0; c < COLUMNS; c++) {
            double sum = (double)d_w_before[r * COLUMNS + c];
            for (int s = 0; s < STRIDE; s++) sum += (double)t->d_y[r * STRIDE + s] * (double)t->x[c * STRIDE + s];
            compare(sum, t->d_w[r * COLUMNS + c]);
        }
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    FOR_LEVELS(level)
    {
        Case t = make(fs_kernels_at(level).mlp, ROWS, COLUMNS, STRIDE);
        float before[ROWS * COLUMNS];
        memcpy(before, t.d_w, sizeof before);
        run_forward(&t);
        run_back(&t);
        run_weights(&t);
        check_case(&t, before);
        CHECK(worst < 1e-5, "%s: %g", fs_cpu_name(level), worst);
        drop(&t);
        t = make(fs_kernels_at(level).mlp, BIG, BIG, SAMPLES);
        BENCH("mlp forward", level, "product", (double)BIG * BIG * SAMPLES, run_forward, &t);
        BENCH("mlp back", level, "product", (double)BIG * BIG * SAMPLES, run_back, &t);
        BENCH("mlp weights", level, "product", (double)BIG * BIG * SAMPLES, run_weights, &t);
        drop(&t);
    }
    return check_end();
}
