// Projection, rasteriser and flash shading: every twin of this machine against the scalar definition, on splats of
// all shapes (needles, larger than the tile, outside it, nearly opaque).
#include "check.h"

enum { N = 4001, TILE_SPLATS = 300 };

static float *random_array(int n, float lo, float hi, Rng *rng)
{
    float *x = malloc(sizeof(float) * (size_t)n);
    if (!x) abort();
    for (int i = 0; i < n; i++) x[i] = lo + (hi - lo) * fs_rng_uniform(rng);
    return x;
}

static ProjectParams random_params(int n, Rng *rng)
{
    ProjectParams p = {random_array(3 * n, -2, 2, rng), random_array(3 * n, -6, -0.5f, rng), random_array(4 * n, -1, 1, rng),
                       random_array(n, -6, 6, rng)};
    for (int i = 0; i < n; i++) p.means[3 * i + 2] += 2.5f; // some behind the camera
    return p;
}

static void free_params(ProjectParams *p)
{
    free(p->means);
    free(p->scales);
    free(p->quats);
    free(p->opacities);
}

static const ProjectCamera camera = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .fx = 60, .fy = 60, .cx = 40, .cy = 30, .near = 0.2f,
                                     .width = 80, .height = 60, .limit_x = 0.9f, .limit_y = 0.7f};

static double relative(float a, float b, float floor)
{
    return fabs((double)a - (double)b) / (fabs((double)a) + (double)floor);
}

static void check_project(const Kernels *k)
{
    Rng rng = fs_rng_new(1);
    ProjectParams p = random_params(N, &rng), d[2];
    Splat *splats[2] = {calloc(N, sizeof(Splat)), calloc(N, sizeof(Splat))};
    float *moments = random_array(N * FS_RECORD, -1, 1, &rng), *d_depth = random_array(N, -1, 1, &rng);
    const ProjectKernels *kernels[2] = {&fs_project_scalar, k->project};
    int visible = 0;
    for (int v = 0; v < 2; v++) {
        d[v] = random_params(N, &rng);
        kernels[v]->forward(&camera, &p, 0, N, FS_T_MIN, splats[v]);
        kernels[v]->backward(&camera, &p, 0, N, splats[0], moments, d_depth, &d[v]);
    }
    for (int i = 0; i < N; i++) {
        const Splat *a = &splats[0][i], *b = &splats[1][i];
        bool edge = memcmp(a->tile, b->tile, sizeof a->tile) != 0; // a bound may round to the other side of a tile's edge
        CHECK(!edge || abs(a->tile[0] - b->tile[0]) + abs(a->tile[2] - b->tile[2]) + abs(a->tile[1] - b->tile[1]) + abs(a->tile[3] - b->tile[3]) <= 8, "splat %d: tiles", i);
        if (a->tile[0] == a->tile[2]) continue;
        visible++;
        CHECK(relative(a->x, b->x, 1) < 1e-4 && relative(a->y, b->y, 1) < 1e-4 && relative(a->depth, b->depth, 1) < 1e-5, "splat %d: mean", i);
        CHECK(relative(a->a, b->a, 1e-3f) < 3e-3 && relative(a->c, b->c, 1e-3f) < 3e-3 && relative(a->l, b->l, 1) < 1e-4, "splat %d: conic %g %g", i, (double)a->a, (double)b->a);
    }
    CHECK(visible > N / 10, "only %d visible", visible);
    float *const x[2][4] = {{d[0].means, d[0].scales, d[0].quats, d[0].opacities}, {d[1].means, d[1].scales, d[1].quats, d[1].opacities}};
    const int width[4] = {3, 3, 4, 1};
    for (int f = 0; f < 4; f++) {
        double error = 0, size = 0;
        for (int i = 0; i < N * width[f]; i++) {
            error += fabs((double)x[0][f][i] - (double)x[1][f][i]);
            size += fabs((double)x[0][f][i]);
        }
        CHECK(error < 1e-3 * size && size > 0, "%s: gradient of field %d differs by %g of %g", fs_cpu_name(k->level), f, error, size);
    }
    free_params(&p);
    for (int v = 0; v < 2; v++) {
        free_params(&d[v]);
        free(splats[v]);
    }
    free(moments);
    free(d_depth);
}

static void random_splats(Splat *s, Rng *rng, float opaque)
{
    for (int i = 0; i < TILE_SPLATS; i++) {
        double c = cos(i), d = sin(i), l0 = pow(10, 2 * (double)fs_rng_uniform(rng) - 0.7), l1 = pow(10, 2 * (double)fs_rng_uniform(rng) - 0.7);
        double a = c * c / (l0 * l0) + d * d / (l1 * l1), b = 2 * c * d * (1 / (l0 * l0) - 1 / (l1 * l1)), e = d * d / (l0 * l0) + c * c / (l1 * l1);
        s[i] = (Splat){.x = 32 + 24 * (fs_rng_uniform(rng) - 0.25f), .y = 16 + 24 * (fs_rng_uniform(rng) - 0.25f), .a = (float)(-0.7213475 * a),
                       .b = (float)(-0.7213475 * b), .c = (float)(-0.7213475 * e), .l = log2f(opaque * fs_rng_uniform(rng) + 1e-3f)};
        for (int k = 0; k < FS_FEATURES_MAX; k++) s[i].feature[k] = fs_rng_uniform(rng);
    }
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void check_raster(const Kernels *k, int features, float opaque)
{
    Rng rng = fs_rng_new(2 + (uint64_t)features);
    static Splat splats[TILE_SPLATS];
    TileEntry entries[TILE_SPLATS];
    random_splats(splats, &rng, opaque);
    for (int i = 0; i < TILE_SPLATS; i++) {
        entries[i] = (TileEntry){(uint32_t)i, fs_raster_scalar.cover(&splats[i], 32, 16, FS_T_MIN), (uint32_t)i};
        uint32_t other = k->raster->cover(&splats[i], 32, 16, FS_T_MIN);
        CHECK(__builtin_popcount(other ^ entries[i].mask) <= 1, "splat %d covers %08x or %08x", i, (unsigned)entries[i].mask, (unsigned)other);
    }
    RasterTile tile = {32, 16, TILE_SPLATS, entries, splats, features, FS_T_MIN, FS_TRANSMITTANCE_MIN};
    float feature[2][4 * FS_TILE_PIXELS], T[2][FS_TILE_PIXELS], *d_feature = random_array(4 * FS_TILE_PIXELS, -1, 1, &rng),
          *d_T = random_array(FS_TILE_PIXELS, -1, 1, &rng), *records[2];
    const RasterKernels *kernels[2] = {&fs_raster_scalar, k->raster};
    long pairs[2];
    for (int v = 0; v < 2; v++) {
        records[v] = random_array(TILE_SPLATS * FS_RECORD, 0, 0, &rng);
        pairs[v] = kernels[v]->forward(&tile, feature[v], T[v]);
        kernels[v]->backward(&tile, feature[0], T[0], d_feature, d_T, records[v]);
    }
    CHECK(labs(pairs[0] - pairs[1]) <= 5 && pairs[0] > 1000, "%ld and %ld pairs", pairs[0], pairs[1]);
    int off = 0;
    for (int i = 0; i < features * FS_TILE_PIXELS; i++) off += fabsf(feature[0][i] - feature[1][i]) > 1e-4f;
    for (int i = 0; i < FS_TILE_PIXELS; i++) off += fabsf(T[0][i] - T[1][i]) > 1e-4f;
    CHECK(off <= 8, "%s: %d values differ (a few may sit on the 1/255 cut)", fs_cpu_name(k->level), off);
    for (int c = 0; c < 6 + features; c++) {
        double error = 0, size = 0;
        for (int i = 0; i < TILE_SPLATS; i++) {
            error += fabs((double)records[0][i * FS_RECORD + c] - (double)records[1][i * FS_RECORD + c]);
            size += fabs((double)records[0][i * FS_RECORD + c]);
        }
        CHECK(error < 2e-3 * size, "%s, %d features: record %d differs by %g of %g", fs_cpu_name(k->level), features, c, error, size);
    }
    if (bench_wanted)
        for (int v = 0; v < 2; v++) {
            double t0 = now();
            for (int r = 0; r < 300; r++) kernels[v]->forward(&tile, feature[v], T[v]);
            double t1 = now();
            for (int r = 0; r < 300; r++) kernels[v]->backward(&tile, feature[0], T[0], d_feature, d_T, records[v]);
            double t2 = now();
            printf("%-7s %d features: forward %.2f ns, backward %.2f ns a pair (%ld pairs)\n", v ? fs_cpu_name(k->level) : "scalar", features,
                   (t1 - t0) * 1e9 / 300 / (double)pairs[v], (t2 - t1) * 1e9 / 300 / (double)pairs[v], pairs[v]);
        }
    for (int v = 0; v < 2; v++) free(records[v]);
    free(d_feature);
    free(d_T);
}

static void check_shade(const Kernels *k)
{
    Rng rng = fs_rng_new(9);
    ShadeLight light = {{0.1f, 0.2f, -3}, 2.5f, {1.2f, 1.3f, 1.5f}};
    float *means = random_array(3 * N, -1, 1, &rng), *colors = random_array(3 * N, 0, 1, &rng), *gains = random_array(N, -2, 2, &rng);
    float *d_out = random_array(3 * N, -1, 1, &rng), *out[2], *d_colors[2], *d_gains[2];
    double d_tint[2][3] = {{0}};
    const ShadeKernels *kernels[2] = {&fs_shade_scalar, k->shade};
    for (int v = 0; v < 2; v++) {
        out[v] = random_array(3 * N, 0, 0, &rng);
        d_colors[v] = random_array(3 * N, 0, 0, &rng);
        d_gains[v] = random_array(N, 0, 0, &rng);
        kernels[v]->forward(&light, means, colors, gains, 0, N, out[v]);
        kernels[v]->backward(&light, means, colors, gains, 0, N, d_out, d_colors[v], d_gains[v], d_tint[v]);
    }
    for (int i = 0; i < 3 * N; i++) {
        CHECK(relative(out[0][i], out[1][i], 1e-2f) < 1e-5, "colour %d", i);
        CHECK(relative(d_colors[0][i], d_colors[1][i], 1e-2f) < 1e-5, "gradient of colour %d", i);
    }
    for (int i = 0; i < N; i++) CHECK(relative(d_gains[0][i], d_gains[1][i], 1e-2f) < 1e-4, "gradient of gain %d", i);
    for (int c = 0; c < 3; c++) CHECK(fabs(d_tint[0][c] - d_tint[1][c]) < 1e-3 * (1 + fabs(d_tint[0][c])), "gradient of tint");
    // against differences of the definition: one Gaussian's gain, and the tint
    float keep = gains[5], h = 1e-2f, row[2][3];
    for (int v = 0; v < 2; v++) {
        gains[5] = keep + (v ? -h : h);
        k->shade->forward(&light, means, colors, gains, 5, 6, out[v]);
        memcpy(row[v], out[v] + 15, sizeof row[v]);
    }
    double numeric = 0;
    for (int c = 0; c < 3; c++) numeric += (double)(row[0][c] - row[1][c]) / (2 * (double)h) * (double)d_out[15 + c];
    CHECK(fabs(numeric - (double)d_gains[0][5]) < 1e-3 + 1e-2 * fabs(numeric), "%g by differences, %g by backward", numeric, (double)d_gains[0][5]);
    free(means);
    free(colors);
    free(gains);
    free(d_out);
    for (int v = 0; v < 2; v++) {
        free(out[v]);
        free(d_colors[v]);
        free(d_gains[v]);
    }
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    for (int level = 0; level < CPU_LEVELS; level++) {
        if (!fs_cpu_has((CpuLevel)level)) continue;
        Kernels k = fs_kernels_at((CpuLevel)level);
        check_project(&k);
        for (int features = 1; features <= FS_FEATURES_MAX; features++) check_raster(&k, features, features == 2 ? 1.0f : 0.3f);
        check_shade(&k);
    }
    return check_end();
}
