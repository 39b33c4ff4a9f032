#include "check.h"

enum { N = 1003 };

typedef struct Case {
    float means[N * 3], scales[N * 3], quats[N * 4], opacities[N];
    float d_means[N * 3], d_scales[N * 3], d_quats[N * 4], d_opacities[N];
    float moments[N * FS_RECORD], d_depth[N];
    ProjectCamera camera;
    ProjectParams params, gradients;
    Splat *splats;
    const ProjectKernels *k;
} Case;

static Case *make(void)
{
    Rng rng = fs_rng_new(11);
    Case *c = calloc(1, sizeof *c);
    if (!c) abort();
    c->splats = aligned_alloc(64, sizeof(Splat) * N);
    if (!c->splats) abort();
    memset(c->splats, 0, sizeof(Splat) * N);
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 3; k++) {
            c->means[3 * i + k] = 2.5f * fs_rng_normal(&rng);
            c->scales[3 * i + k] = -3 + fs_rng_normal(&rng);
        }
        c->means[3 * i + 2] += 3; // some behind the camera
        for (int k = 0; k < 4; k++) c->quats[4 * i + k] = fs_rng_normal(&rng);
        c->opacities[i] = i % 9 == 0 ? -8 : 2 * fs_rng_normal(&rng); // some below the threshold
        for (int k = 0; k < FS_RECORD; k++) c->moments[i * FS_RECORD + k] = fs_rng_normal(&rng);
        c->d_depth[i] = fs_rng_normal(&rng);
    }
    const float s = sinf(0.2f), co = cosf(0.2f);
    c->camera = (ProjectCamera){{co, 0, s, 0, 1, 0, -s, 0, co},
                                {0.1f, -0.2f, 0.5f},
                                300,
                                310,
                                160,
                                120,
                                0.2f,
                                320,
                                240,
                                0.7f,
                                0.5f,
                                0.3f,
                                0.075f};
    c->params = (ProjectParams){c->means, c->scales, c->quats, c->opacities};
    c->gradients = (ProjectParams){c->d_means, c->d_scales, c->d_quats, c->d_opacities};
    return c;
}
static void drop(Case *c)
{
    free(c->splats);
    free(c);
}
static void run_forward(void *context)
{
    Case *c = context;
    c->k->forward(&c->camera, &c->params, 0, N, FS_T_MIN, c->splats);
}
static void run_backward(void *context)
{
    Case *c = context;
    ProjectBack from = {c->splats, c->moments, c->d_depth};
    c->k->backward(&c->camera, &c->params, 0, N, &from, &c->gradients);
}

// Largest difference of a field over visible Gaussians, relative to its Gaussian's size.
static double difference(const Case *a, const Case *b, const float *u, const float *v, int width)
{
    double most = 0;
    for (int i = 0; i < N; i++) {
        double size = 1e-6;
        for (int k = 0; k < width; k++) size = fmax(size, fabs((double)u[i * width + k]));
        if (a->splats[i].tile[0] == a->splats[i].tile[2] || b->splats[i].tile[0] == b->splats[i].tile[2]) continue;
        for (int k = 0; k < width; k++) {
            double e = fabs((double)u[i * width + k] - v[i * width + k]) / size;
            if (!(e <= most)) most = e;
        }
    }
    return most;
}

static void compare(const Case *ref, CpuLevel level)
{
    const char *name = fs_cpu_name(level);
    Case *c = make();
    c->k = fs_kernels_at(level).project;
    c->k->forward(&c->camera, &c->params, 0, 5, FS_T_MIN, c->splats); // odd pieces
    c->k->forward(&c->camera, &c->params, 5, 6, FS_T_MIN, c->splats);
    c->k->forward(&c->camera, &c->params, 6, N, FS_T_MIN, c->splats);
    int seen = 0, other = 0;
    for (int i = 0; i < N; i++) {
        const Splat *s = &ref->splats[i], *t = &c->splats[i];
        seen += s->tile[0] < s->tile[2];
        other += memcmp(s->tile, t->tile, sizeof s->tile) != 0;
        if (s->tile[0] == s->tile[2]) continue;
        double e = fmax(fabs(s->x - t->x), fabs(s->y - t->y)) + fabs(s->depth - t->depth);
        double size = fabs(s->a) + fabs(s->c);
        double conic = fmax(fmax(fabs(s->a - t->a), fabs(s->b - t->b)), fabs(s->c - t->c)) / size;
        CHECK(e < 2e-3 && conic < 1e-4 && fabs(s->l - t->l) < 1e-5, "%s splat %d: %g %g %g", name, i, e, conic,
              fabs((double)s->l - t->l));
    }
    CHECK(seen > N / 4 && seen < N, "%d of %d are visible", seen, N);
    CHECK(other <= 2, "%s: %d other tile boxes", name, other); // on a tile's border
    run_backward(c);
    double e = difference(ref, c, ref->d_means, c->d_means, 3), f = difference(ref, c, ref->d_scales, c->d_scales, 3);
    double g = difference(ref, c, ref->d_quats, c->d_quats, 4),
           h = difference(ref, c, ref->d_opacities, c->d_opacities, 1);
    CHECK(e < 2e-3 && f < 2e-3 && g < 2e-3 && h < 1e-5, "%s gradients: means %g scales %g quats %g opacities %g", name,
          e, f, g, h);
    for (int i = 0; i < N; i++)
        if (c->splats[i].tile[0] == c->splats[i].tile[2])
            CHECK(c->d_means[3 * i] == 0 && c->d_quats[4 * i + 3] == 0 && c->d_opacities[i] == 0,
                  "%s: unseen %d has a gradient", name, i);
    drop(c);
}

// A needle at 45 degrees, longer than any scene: in float xx yy - xy^2 would round to 0, but its width is known.
static void check_needle(CpuLevel level)
{
    Case *c = make();
    for (int i = 0; i < 16; i++) {
        float mean[3] = {0, 0, 3}, scale[3] = {2 + 0.5f * (float)i, -12, -12},
              quat[4] = {0.92387953f, 0, 0, 0.38268343f};
        memcpy(c->means + 3 * i, mean, sizeof mean);
        memcpy(c->scales + 3 * i, scale, sizeof scale);
        memcpy(c->quats + 4 * i, quat, sizeof quat);
        c->opacities[i] = 2;
    }
    c->camera =
        (ProjectCamera){{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}, 300, 300, 160, 120, 0.2f, 320, 240, 0.7f, 0.5f, 0.3f, 0.3f};
    c->k = fs_kernels_at(level).project;
    run_forward(c);
    run_backward(c);
    for (int i = 0; i < 16; i++) {
        const Splat *s = &c->splats[i];
        double across = (s->a - (double)s->b + s->c) / 2; // along (1, -1) / sqrt 2: -log2(e) / 2 / dilation
        CHECK(s->tile[0] < s->tile[2] && fabs(across / (-0.72134752 / FS_COV_DILATION) - 1) < 0.02,
              "%s: needle of scale e^%g: %g across", fs_cpu_name(level), c->scales[3 * i], across);
        CHECK(isfinite(c->d_means[3 * i]) && isfinite(c->d_scales[3 * i]) && isfinite(c->d_quats[4 * i]),
              "%s: needle of scale e^%g: gradient", fs_cpu_name(level), c->scales[3 * i]);
    }
    drop(c);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    Case *ref = make();
    ref->k = &fs_project_scalar;
    run_forward(ref);
    run_backward(ref);
    FOR_LEVELS(level) compare(ref, level);
    FOR_LEVELS(level) check_needle(level);
    if (bench_wanted) FOR_LEVELS(level)
        {
            ref->k = fs_kernels_at(level).project;
            BENCH("project forward", level, "splat", N, run_forward, ref);
            BENCH("project backward", level, "splat", N, run_backward, ref);
        }
    drop(ref);
    return check_end();
}
