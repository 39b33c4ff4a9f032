#include "check.h"

typedef struct Case {
    Planes map, d_map, guide;
    SmoothArgs args;
    const SmoothKernels *k;
} Case;

static void make(Case *c, int width, int height, float g)
{
    Rng rng = fs_rng_new((uint64_t)(width + 97 * height));
    *c = (Case){.map = random_planes(width, height, 1, 0, 3, &rng),
                .d_map = random_planes(width, height, 1, -1e-3f, 1e-3f, &rng)};
    for (int y = 0; y + 1 < height; y += 2)
        for (int x = 0; x < width; x += 3)
            fs_planes_row(&c->map, 0, y)[x] = fs_planes_row(&c->map, 0, y + 1)[x]; // d = 0
    c->guide = random_planes(width, height, 3, 0, 1, &rng);
    c->args = (SmoothArgs){&c->map, g, 2.0f, &c->d_map, &c->guide};
}
static void drop(Case *c)
{
    free(c->map.px);
    free(c->d_map.px);
    free(c->guide.px);
}
static double run(Case *c, const SmoothKernels *k, int rows)
{
    double sum = 0;
    FOR_STRIPS(c->map.height, rows, a, b) sum += k->loss(&c->args, a, b);
    return sum;
}
static void run_all(void *context)
{
    Case *c = context;
    run(c, c->k, 50);
}

static double direct(const Case *c)
{
    static const int dx[4] = {1, 0, 1, -1}, dy[4] = {0, 1, 1, 1};
    double total = 0;
    for (int k = 0; k < 4; k++) {
        double sum = 0;
        int n = 0;
        for (int y = 0; y + dy[k] < c->map.height; y++)
            for (int x = 0; x < c->map.width; x++) {
                int xn = x + dx[k];
                if (xn < 0 || xn >= c->map.width) continue;
                double t = fabs((double)fs_planes_row(&c->map, 0, y)[x] - fs_planes_row(&c->map, 0, y + dy[k])[xn]);
                sum += t * exp(-t / c->args.g);
                n++;
            }
        if (n) total += 0.25 * sum / n;
    }
    return total;
}

// The guided term: its definition, and each twin's gradient against the scalar one's.
static void compare_guided(Case *ref)
{
    static const int dx[4] = {1, 0, 1, -1}, dy[4] = {0, 1, 1, 1};
    double total = 0;
    for (int k = 0; k < 4; k++) {
        double sum = 0;
        int n = 0;
        for (int y = 0; y + dy[k] < ref->map.height; y++)
            for (int x = 0; x < ref->map.width; x++) {
                int xn = x + dx[k];
                if (xn < 0 || xn >= ref->map.width) continue;
                double t = 0, d = 0;
                for (int c = 0; c < 3; c++)
                    d += fabs((double)fs_planes_row(&ref->guide, c, y)[x] -
                              fs_planes_row(&ref->guide, c, y + dy[k])[xn]);
                t = fabs((double)fs_planes_row(&ref->map, 0, y)[x] - fs_planes_row(&ref->map, 0, y + dy[k])[xn]);
                sum += t * exp(-d / ref->args.g);
                n++;
            }
        if (n) total += 0.25 * sum / n;
    }
    Planes gradient[2] = {copy_planes(&ref->map), copy_planes(&ref->map)};
    FOR_LEVELS(level)
    {
        SmoothArgs args = ref->args;
        args.d_map = &gradient[level > 0];
        size_t floats = fs_planes_floats(ref->map.width, ref->map.height, 1);
        memset(args.d_map->px, 0, floats * sizeof(float));
        double v = 0;
        FOR_STRIPS(ref->map.height, 3, a, b) v += fs_kernels_at(level).smooth->guided(&args, a, b);
        CHECK(fabs(v - total) < 1e-5 * total + 1e-12, "%s: %g, definition %g", fs_cpu_name(level), v, total);
        double e = planes_difference(&gradient[0], args.d_map);
        CHECK(e < 1e-5, "%s guided gradient: %g", fs_cpu_name(level), e);
    }
    for (int i = 0; i < 2; i++) free(gradient[i].px);
}

static void compare(int width, int height, float g)
{
    Case ref;
    make(&ref, width, height, g);
    double value = run(&ref, &fs_smooth_scalar, height), definition = direct(&ref);
    CHECK(fabs(value - definition) < 1e-5 * definition + 1e-12, "%dx%d %g: %g, definition %g", width, height, (double)g,
          value, definition);
    compare_guided(&ref);
    FOR_LEVELS(level)
    {
        for (int rows = 1; rows < 6; rows += 2) {
            Case c;
            make(&c, width, height, g);
            double v = run(&c, fs_kernels_at(level).smooth, rows), e = planes_difference(&ref.d_map, &c.d_map);
            CHECK(fabs(v - value) < 1e-5 * value + 1e-12, "%s %dx%d: %g, scalar %g", fs_cpu_name(level), width, height,
                  v, value);
            CHECK(e < 1e-5, "%s %dx%d gradient: %g", fs_cpu_name(level), width, height, e);
            c.args.d_map = NULL;
            CHECK(run(&c, fs_kernels_at(level).smooth, rows) == v, "%s value only", fs_cpu_name(level));
            drop(&c);
        }
    }
    drop(&ref);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    for (int width = 1; width < 40; width++) compare(width, 1 + width % 9, 0.5f + (float)width);
    for (int width = 250; width < 275; width += 3) compare(width, 5, 1);
    compare(600, 9, 0.3f);
    if (bench_wanted) {
        Case c;
        make(&c, 300, 200, 1);
        FOR_LEVELS(level)
        {
            c.k = fs_kernels_at(level).smooth;
            BENCH("smooth", level, "pixel", 300 * 200, run_all, &c);
        }
        drop(&c);
    }
    return check_end();
}
