// Twins of the hash encoding against the scalar definition, and that against trilinear interpolation in double.
#include "check.h"

enum { N = 4096, ROWS = 1 << 15 };

typedef struct Case {
    HashLevel level;
    HashPlaces places;
    float *memory, *table, *out, *d_table;
    unsigned char *touched;
    const HashgridKernels *k;
} Case;

static Case make(const HashgridKernels *k, int resolution)
{
    Rng rng = fs_rng_new(9);
    size_t vertices = (size_t)(resolution + 1) * (size_t)(resolution + 1) * (size_t)(resolution + 1);
    Case t = {.k = k, .level = {resolution, vertices < ROWS ? (uint32_t)vertices : ROWS, vertices >= ROWS}};
    t.memory = malloc(sizeof(float) * (3 * N + 2 * N + 4 * ROWS));
    t.touched = calloc(ROWS, 1);
    if (!t.memory || !t.touched) abort();
    t.out = t.memory + 3 * N;
    t.table = t.out + 2 * N;
    t.d_table = t.table + 2 * ROWS;
    for (int i = 0; i < 3 * N; i++) t.memory[i] = fs_rng_uniform(&rng);
    for (int i = 0; i < 2 * ROWS; i++) t.table[i] = fs_rng_normal(&rng), t.d_table[i] = 0;
    for (int c = 0; c < 3; c++) t.memory[c * N] = 0, t.memory[c * N + 1] = 1; // the cube's corners belong to it
    t.places = (HashPlaces){{t.memory, t.memory + N, t.memory + 2 * N}, N};
    return t;
}

static void drop(Case *t)
{
    free(t->memory);
    free(t->touched);
}

static void run_encode(void *context)
{
    Case *t = context;
    t->k->encode(&t->level, t->table, &t->places, t->out, N);
}
static void run_scatter(void *context)
{
    Case *t = context;
    t->k->scatter(&t->level, &t->places, t->out, N, t->d_table, t->touched);
}

static uint32_t row_of(const HashLevel *l, uint32_t x, uint32_t y, uint32_t z)
{
    uint32_t side = (uint32_t)l->resolution + 1;
    return l->hashed ? (x ^ y * 2654435761u ^ z * 805459861u) % l->rows : x + side * y + side * side * z;
}

// A place's features, and their gradient's way back: the same weights.
static void check_place(const Case *t, int i, double *back)
{
    double sum[2] = {0}, most = t->level.resolution - 1, cell[3], part[3];
    for (int c = 0; c < 3; c++) {
        double x = (double)(t->places.at[c][i] * (float)t->level.resolution);
        cell[c] = fmin(floor(x), most);
        part[c] = x - cell[c];
    }
    for (int k = 0; k < 8; k++) {
        double w = 1;
        for (int c = 0; c < 3; c++) w *= k >> c & 1 ? part[c] : 1 - part[c];
        uint32_t row = row_of(&t->level, (uint32_t)cell[0] + (k & 1), (uint32_t)cell[1] + (k >> 1 & 1),
                              (uint32_t)cell[2] + (k >> 2 & 1));
        CHECK(row < t->level.rows && (t->touched[row] || w == 0), "row %u", row);
        for (int f = 0; f < 2; f++) {
            sum[f] += w * (double)t->table[2 * row + (uint32_t)f];
            back[2 * row + (uint32_t)f] += w * (double)t->out[f * N + i];
        }
    }
    for (int f = 0; f < 2; f++)
        CHECK(fabs(sum[f] - (double)t->out[f * N + i]) < 1e-4, "place %d: %g, not %g", i, t->out[f * N + i], sum[f]);
}

int main(int argc, char **argv)
{
    static const int resolutions[] = {5, 31, 32, 200};
    check_begin(argc, argv);
    for (int r = 0; r < 4; r++) FOR_LEVELS(level)
        {
            Case t = make(fs_kernels_at(level).hashgrid, resolutions[r]);
            double *back = calloc(2 * ROWS, sizeof *back), worst = 0;
            if (!back) abort();
            run_encode(&t);
            run_scatter(&t);
            for (int i = 0; i < N; i++) check_place(&t, i, back);
            for (int i = 0; i < 2 * ROWS; i++) worst = fmax(worst, fabs(back[i] - (double)t.d_table[i]));
            CHECK(worst < 1e-3, "%s: %g", fs_cpu_name(level), worst);
            BENCH("hashgrid encode", level, "place", N, run_encode, &t);
            BENCH("hashgrid scatter", level, "place", N, run_scatter, &t);
            free(back);
            drop(&t);
        }
    return check_end();
}
