#include "check.h"

typedef struct Case {
    Planes T, R, beta, veil, d_I, I, T_linear, R_linear, I_linear, d_T, d_R, d_beta, d_veil;
    ComposeArgs args;
    const ComposeKernels *k;
} Case;

static Case make(int width, int height, bool with_beta, bool with_veil)
{
    Rng rng = fs_rng_new(7);
    Case c = {.T = random_planes(width, height, 3, -0.1f, 1.1f, &rng),
              .R = random_planes(width, height, 3, -0.1f, 1.1f, &rng),
              .beta = random_planes(width, height, 1, 0, 1, &rng),
              .veil = random_planes(width, height, 3, 0, 0.3f, &rng),
              .d_I = random_planes(width, height, 3, -1, 1, &rng)};
    Planes *out[] = {&c.I, &c.T_linear, &c.R_linear, &c.I_linear, &c.d_T, &c.d_R, &c.d_veil};
    for (size_t i = 0; i < sizeof out / sizeof *out; i++) *out[i] = random_planes(width, height, 3, -1, 1, &rng);
    c.d_beta = random_planes(width, height, 1, -1, 1, &rng);
    fs_planes_row(&c.T, 0, 0)[0] = fs_planes_row(&c.R, 0, 0)[0] = 0; // black on black
    c.args.beta = with_beta ? &c.beta : NULL;
    c.args.veil = with_veil ? &c.veil : NULL;
    return c;
}
static void point(Case *c)
{
    c->args = (ComposeArgs){&c->T,
                            &c->R,
                            c->args.beta ? &c->beta : NULL,
                            &c->I,
                            &c->T_linear,
                            &c->R_linear,
                            &c->I_linear,
                            &c->d_I,
                            &c->d_T,
                            &c->d_R,
                            &c->d_beta,
                            .veil = c->args.veil ? &c->veil : NULL,
                            .d_veil = c->args.veil ? &c->d_veil : NULL};
}
static void drop(Case *c)
{
    Planes *all[] = {&c->T,        &c->R,        &c->beta, &c->d_I, &c->I,      &c->T_linear, &c->veil,
                     &c->R_linear, &c->I_linear, &c->d_T,  &c->d_R, &c->d_beta, &c->d_veil};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]->px);
}
static void run_forward(void *context)
{
    Case *c = context;
    c->k->forward(&c->args, 0, c->T.height);
}
static void run_backward(void *context)
{
    Case *c = context;
    c->k->backward(&c->args, 0, c->T.height);
}

// The veil is light that is added, and what is wanted of it is wanted of all light.
static void check_veil(void)
{
    Case c[2] = {make(9, 4, true, false), make(9, 4, true, true)};
    for (int k = 0; k < 2; k++) {
        point(&c[k]);
        c[k].k = &fs_compose_scalar;
        run_forward(&c[k]);
        run_backward(&c[k]);
    }
    for (int y = 0; y < 4; y++)
        for (int x = 0; x < 9; x++) {
            float with = fs_planes_row(&c[1].I_linear, 1, y)[x], without = fs_planes_row(&c[0].I_linear, 1, y)[x];
            CHECK(fabsf(with - without - fs_planes_row(&c[0].veil, 1, y)[x]) < 1e-6f, "%d %d", x, y);
            float slope = FS_COMPOSE_GAMMA * powf(with, FS_COMPOSE_GAMMA - 1), d = fs_planes_row(&c[1].d_veil, 1, y)[x];
            float want = slope * fs_planes_row(&c[1].d_I, 1, y)[x];
            CHECK(with < 1e-6f || fabsf(d - want) < 1e-3f * fabsf(want) + 1e-6f, "%d %d: %g, %g", x, y, d, want);
        }
    for (int k = 0; k < 2; k++) drop(&c[k]);
}

static void compare(int width, int height, bool with_beta, bool with_veil)
{
    Case ref = make(width, height, with_beta, with_veil);
    point(&ref);
    ref.k = &fs_compose_scalar;
    ref.args.slope_floor = with_beta ? 0.3f : 0;
    run_forward(&ref);
    run_backward(&ref);
    if (!with_veil) CHECK(fs_planes_row(&ref.I, 0, 0)[0] == 0, "black stays black");
    FOR_LEVELS(level)
    {
        Case c = make(width, height, with_beta, with_veil);
        point(&c);
        c.k = fs_kernels_at(level).compose;
        c.args.slope_floor = ref.args.slope_floor;
        FOR_STRIPS(height, 3, a, b) c.k->forward(&c.args, a, b);
        FOR_STRIPS(height, 2, a, b) c.k->backward(&c.args, a, b);
        double e = fmax(planes_relative(&ref.T_linear, &c.T_linear, 1e-12),
                        planes_relative(&ref.R_linear, &c.R_linear, 1e-12));
        CHECK(e < 3e-6, "%s decode: %g", fs_cpu_name(level), e);
        e = planes_relative(&ref.I, &c.I, 1e-6);
        CHECK(e < 3e-6, "%s I: %g", fs_cpu_name(level), e);
        e = fmax(planes_relative(&ref.d_T, &c.d_T, 1), planes_relative(&ref.d_R, &c.d_R, 1));
        CHECK(e < 1e-5, "%s d_T, d_R: %g", fs_cpu_name(level), e);
        e = fmax(planes_relative(&ref.d_beta, &c.d_beta, 1), planes_relative(&ref.d_veil, &c.d_veil, 1));
        CHECK(e < 1e-5, "%s d_beta, d_veil: %g", fs_cpu_name(level), e);
        c.k->decode(&c.T, &c.T, 0, height); // in place
        e = planes_relative(&ref.T_linear, &c.T, 1e-12);
        CHECK(e < 3e-6, "%s decode in place: %g", fs_cpu_name(level), e);
        drop(&c);
    }
    drop(&ref);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    for (int width = 1; width < 36; width += 3) compare(width, 5, width & 1, width & 2);
    for (int veil = 0; veil < 2; veil++) compare(131, 7, true, veil);
    check_veil();
    if (bench_wanted) {
        Case c = make(300, 200, true, false);
        point(&c);
        FOR_LEVELS(level)
        {
            c.k = fs_kernels_at(level).compose;
            BENCH("compose forward", level, "value", 3 * 300 * 200, run_forward, &c);
            BENCH("compose backward", level, "value", 3 * 300 * 200, run_backward, &c);
        }
        drop(&c);
    }
    return check_end();
}
