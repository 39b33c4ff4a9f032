// The tile rasteriser's twins against the scalar definition. The strict comparison has no cut-offs, at which a
// difference in the last bit would decide about a whole pair; the loose one has those of training.
#include "check.h"

enum { SPLATS = 300, X0 = 32, Y0 = 48 };

typedef struct Case {
    Splat *splats;
    TileEntry entry[SPLATS];
    float d_feature[FS_FEATURES_MAX * FS_TILE_PIXELS], d_transmittance[FS_TILE_PIXELS];
    float feature[FS_FEATURES_MAX * FS_TILE_PIXELS], transmittance[FS_TILE_PIXELS];
    float *records;
    RasterTile tile;
    const RasterKernels *k;
    long pairs;
} Case;

static void make(Case *c, int n, int features, bool cut)
{
    Rng rng = fs_rng_new((uint64_t)(n + features));
    memset(c, 0, sizeof *c);
    c->splats = aligned_alloc(64, sizeof(Splat) * SPLATS);
    c->records = calloc(SPLATS * FS_RECORD, sizeof(float));
    if (!c->splats || !c->records) abort();
    memset(c->splats, 0, sizeof(Splat) * SPLATS);
    for (int i = 0; i < SPLATS; i++) {
        Splat *s = &c->splats[i];
        float sx = expf(1.0f + 0.8f * fs_rng_normal(&rng)), sy = expf(1.0f + 0.8f * fs_rng_normal(&rng));
        float angle = 6.28f * fs_rng_uniform(&rng), u = cosf(angle), v = sinf(angle);
        float p = 0.72134752f / (sx * sx + 0.3f), q = 0.72134752f / (sy * sy + 0.3f); // log2(e) / 2 / variance
        s->x = X0 - 4 + (FS_TILE_W + 8) * fs_rng_uniform(&rng);
        s->y = Y0 - 4 + (FS_TILE_H + 8) * fs_rng_uniform(&rng);
        s->a = -(p * u * u + q * v * v);
        s->b = -2 * (p - q) * u * v;
        s->c = -(p * v * v + q * u * u);
        s->l = -4 + 4.2f * fs_rng_uniform(&rng); // some above 0.99
        for (int k = 0; k < FS_FEATURES_MAX; k++) s->feature[k] = fs_rng_uniform(&rng);
    }
    for (int i = 0; i < FS_FEATURES_MAX * FS_TILE_PIXELS; i++) c->d_feature[i] = fs_rng_uniform(&rng) - 0.5f;
    for (int i = 0; i < FS_TILE_PIXELS; i++) c->d_transmittance[i] = fs_rng_uniform(&rng) - 0.5f;
    if (!cut)
        for (int i = 0; i < SPLATS; i++) // keep alpha clear of the clamp and the light from running out
            c->splats[i].l = fminf(c->splats[i].l - 2, -0.2f);
    for (int i = 0; i < SPLATS; i++) {
        uint32_t id = (uint32_t)(SPLATS - 1 - i);
        uint32_t mask = 0xffffffffu;
        if (cut) fs_raster_scalar.cover(&c->splats[id], X0, Y0, 1, FS_T_MIN, &mask);
        c->entry[i] = (TileEntry){id, mask, (uint32_t)((i * 7) % SPLATS)};
    }
    c->tile = (RasterTile){
        X0, Y0, n, c->entry, c->splats, features, cut ? FS_T_MIN : -29.0f, cut ? FS_TRANSMITTANCE_MIN : 0, true};
}
static void drop(Case *c)
{
    free(c->splats);
    free(c->records);
}
static void run_forward(void *context)
{
    Case *c = context;
    c->pairs = c->k->forward(&c->tile, c->feature, c->transmittance);
}
static void run_backward(void *context)
{
    Case *c = context;
    c->k->backward(&c->tile, c->feature, c->transmittance, c->d_feature, c->d_transmittance, c->records);
}

static double difference(const float *a, const float *b, int n)
{
    double most = 0, size = 1e-30;
    for (int i = 0; i < n; i++) {
        if (!isfinite(b[i])) return INFINITY;
        most = fmax(most, fabs((double)a[i] - b[i]));
        size = fmax(size, fabs((double)a[i]));
    }
    return most / size;
}

// The last feature of the splat at which half of the light is stopped; another one where that is by rounding alone.
static void compare_median(int features)
{
    Case *ref = malloc(sizeof *ref), *c = malloc(sizeof *c), *sums = malloc(sizeof *sums);
    if (!ref || !c || !sums) abort();
    make(ref, SPLATS, features, false);
    make(sums, SPLATS, features, false);
    ref->k = sums->k = &fs_raster_scalar;
    for (int i = 0; i < SPLATS; i++) ref->splats[i].l = sums->splats[i].l = -1.5f;
    ref->tile.median = true;
    run_forward(ref);
    run_forward(sums);
    const float *median = ref->feature + (features - 1) * FS_TILE_PIXELS;
    int found = 0, kept = (features - 1) * FS_TILE_PIXELS;
    for (int p = 0; p < FS_TILE_PIXELS; p++) found += median[p] > 0;
    CHECK(found > FS_TILE_PIXELS / 4, "%d medians of %d", found, FS_TILE_PIXELS);
    for (int p = 0; p < FS_TILE_PIXELS; p++)
        CHECK((median[p] > 0) == (ref->transmittance[p] < 0.5f), "pixel %d: %g passes, median %g", p,
              (double)ref->transmittance[p], (double)median[p]);
    CHECK(memcmp(ref->feature, sums->feature, sizeof(float) * (size_t)kept) == 0, "others are sums");
    FOR_LEVELS(level)
    {
        make(c, SPLATS, features, false);
        for (int i = 0; i < SPLATS; i++) c->splats[i].l = -1.5f;
        c->tile.median = true;
        c->k = fs_kernels_at(level).raster;
        run_forward(c);
        int other = 0;
        for (int p = 0; p < FS_TILE_PIXELS; p++) other += c->feature[kept + p] != median[p];
        CHECK(other <= 1, "%s features %d: %d medians differ", fs_cpu_name(level), features, other);
        CHECK(difference(ref->feature, c->feature, kept + 1) < 2e-5, "%s features %d: sums", fs_cpu_name(level),
              features);
        CHECK(c->pairs == ref->pairs, "%s pairs %ld, scalar %ld", fs_cpu_name(level), c->pairs, ref->pairs);
        drop(c);
    }
    drop(ref);
    drop(sums);
    free(ref), free(c), free(sums);
}

static void compare(int n, int features, bool cut)
{
    Case *ref = malloc(sizeof *ref), *c = malloc(sizeof *c);
    if (!ref || !c) abort();
    make(ref, n, features, cut);
    ref->k = &fs_raster_scalar;
    run_forward(ref);
    run_backward(ref);
    FOR_LEVELS(level)
    {
        const char *name = fs_cpu_name(level);
        make(c, n, features, cut);
        c->k = fs_kernels_at(level).raster;
        run_forward(c);
        double e = difference(ref->feature, c->feature, features * FS_TILE_PIXELS);
        double t = difference(ref->transmittance, c->transmittance, FS_TILE_PIXELS);
        CHECK(e < (cut ? 4e-3 : 2e-5) && t < (cut ? 4e-3 : 2e-5), "%s n %d features %d: %g %g", name, n, features, e,
              t);
        CHECK(labs(c->pairs - ref->pairs) <= (cut ? 2 + ref->pairs / 1000 : 0), "%s pairs %ld, scalar %ld", name,
              c->pairs, ref->pairs);
        memcpy(c->feature, ref->feature, sizeof c->feature);
        memcpy(c->transmittance, ref->transmittance, sizeof c->transmittance);
        run_backward(c);
        // Each kind of moment on its own scale. Where alpha is large, a 14-bit reciprocal is in one of two terms
        // (AVX-512).
        for (int k = 0; k < 6 + features; k++) {
            float a[SPLATS], b[SPLATS];
            for (int i = 0; i < SPLATS; i++)
                a[i] = ref->records[i * FS_RECORD + k], b[i] = c->records[i * FS_RECORD + k];
            e = difference(a, b, SPLATS);
            CHECK(e < (cut ? 2e-2 : 5e-4), "%s n %d features %d record %d: %g", name, n, features, k, e);
        }
        drop(c);
    }
    drop(ref);
    free(ref);
    free(c);
}

// Every pixel over the threshold lies in a marked row; few rows are marked that have none.
static void check_cover(void)
{
    Case *c = malloc(sizeof *c);
    if (!c) abort();
    make(c, SPLATS, 3, true);
    FOR_LEVELS(level)
    {
        int extra = 0, rows = 0;
        for (int i = 0; i < SPLATS; i++) {
            const Splat *s = &c->splats[i];
            uint32_t row[2], mask; // as the second of two tiles
            fs_kernels_at(level).raster->cover(s, X0 - FS_TILE_W, Y0, 2, FS_T_MIN, row);
            mask = row[1];
            for (int g = 0; g < FS_TILE_H; g++) {
                double best = -1e9;
                for (int l = 0; l < FS_TILE_W; l++) {
                    double dx = X0 + l + 0.5 - s->x, dy = Y0 + g + 0.5 - s->y;
                    best = fmax(best, (s->a * dx + s->b * dy) * dx + s->c * dy * dy + s->l);
                }
                if (best > FS_T_MIN + 1e-4)
                    CHECK(mask >> g & 1, "%s splat %d row %d: %g not covered", fs_cpu_name(level), i, g, best);
                rows += best > FS_T_MIN;
                extra += best < FS_T_MIN && (mask >> g & 1);
            }
        }
        // a row's ellipse may pass between two pixel centres
        CHECK(extra < rows / 20, "%s: %d of %d rows for nothing", fs_cpu_name(level), extra, rows);
    }
    drop(c);
    free(c);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    check_cover();
    for (int features = 1; features <= FS_FEATURES_MAX; features++) compare_median(features);
    for (int features = 1; features <= FS_FEATURES_MAX; features++)
        for (int cut = 0; cut < 2; cut++) {
            compare(0, features, cut);
            compare(1, features, cut);
            compare(20, features, cut);
            compare(cut ? SPLATS : 120, features, cut);
        }
    if (bench_wanted) {
        Case *c = malloc(sizeof *c);
        if (!c) abort();
        make(c, 100, 3, true);
        for (int i = 0; i < SPLATS; i++) c->entry[i].mask = 0xffffffffu;
        FOR_LEVELS(level)
        {
            c->k = fs_kernels_at(level).raster;
            run_forward(c);
            BENCH("raster forward", level, "pair", c->pairs, run_forward, c);
            BENCH("raster backward", level, "pair", c->pairs, run_backward, c);
        }
        drop(c);
        free(c);
    }
    return check_end();
}
