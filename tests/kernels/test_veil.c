// The veil's twins against the scalar definition, and the definition against what its head says.
#include "check.h"

enum { W = 83, H = 61, CELLS_X = 40, CELLS_Y = 30, CELLS = CELLS_X * CELLS_Y };

typedef struct Case {
    Planes veil, d_veil;
    float texture[CELLS], d_texture[CELLS];
    double d_ambient[3];
    VeilView view;
    const VeilKernels *k;
} Case;

// The camera looks aslant at a patch that it does not see all of, and sees past it.
static Case make(const VeilKernels *k)
{
    Rng rng = fs_rng_new(9);
    Case c = {.k = k,
              .veil = random_planes(W, H, 3, 0, 1, &rng),
              .d_veil = random_planes(W, H, 3, -1, 1, &rng),
              .view = {.base = {-0.45f, -0.3f, 1.02f},
                       .dx = {0.0125f, 0, -0.002f},
                       .dy = {0.001f, 0.0119f, 0.0003f},
                       .at = {19.3f, 12.2f},
                       .per = 41,
                       .light = {1.3f, 1.2f, 0.9f},
                       .ambient = {0.2f, 0.3f, 0.4f},
                       .width = CELLS_X,
                       .height = CELLS_Y}};
    for (int i = 0; i < CELLS; i++) c.texture[i] = fs_rng_uniform(&rng);
    return c;
}
static void drop(Case *c)
{
    free(c->veil.px);
    free(c->d_veil.px);
}
static void run(void *context)
{
    Case *c = context;
    memset(c->d_texture, 0, sizeof c->d_texture);
    memset(c->d_ambient, 0, sizeof c->d_ambient);
    FOR_STRIPS(H, 8, a, b)
    {
        c->k->forward(&c->view, c->texture, &c->veil, a, b);
        c->k->backward(&c->view, c->texture, &c->d_veil, c->d_texture, c->d_ambient, a, b);
    }
}

// A texture that rises evenly along rows (or columns) is met where geometry says, and dims with the squared distance.
static void check_definition(bool down)
{
    Case c = make(&fs_veil_scalar);
    int met = 0, missed = 0;
    for (int i = 0; i < CELLS; i++) c.texture[i] = (float)(down ? i / CELLS_X : i % CELLS_X);
    run(&c);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            double ray[3], at[2];
            for (int k = 0; k < 3; k++)
                ray[k] = (double)c.view.base[k] + x * (double)c.view.dx[k] + y * (double)c.view.dy[k];
            for (int k = 0; k < 2; k++) at[k] = (double)c.view.at[k] + (double)c.view.per * ray[k] / ray[2];
            double falloff = ray[2] * ray[2] / (ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]);
            double border = fmin(fmin(at[0], CELLS_X - 1 - at[0]), fmin(at[1], CELLS_Y - 1 - at[1]));
            if (fabs(border) < 1e-3) continue;
            for (int k = 0; k < 3; k++) {
                double is = (double)fs_planes_row(&c.veil, k, y)[x];
                double want = ((double)c.view.ambient[k] + (double)c.view.light[k] * falloff) * at[down];
                CHECK(fabs(is - (border > 0 ? want : 0)) < 1e-4 * (1 + fabs(want)), "%d %d %d: %g", x, y, k, is);
            }
            met += border > 0;
            missed += border < 0;
        }
    CHECK(met > 1000 && missed > 300, "%d met, %d missed", met, missed);
    drop(&c);
}

// The sum of d_veil * veil is linear in the texture: d_texture * texture.
static void check_gradient(Case *c)
{
    double forward = 0, backward = 0;
    run(c);
    for (int k = 0; k < 3; k++)
        for (int y = 0; y < H; y++)
            for (int x = 0; x < W; x++)
                forward += (double)fs_planes_row(&c->veil, k, y)[x] * (double)fs_planes_row(&c->d_veil, k, y)[x];
    for (int i = 0; i < CELLS; i++) backward += (double)c->d_texture[i] * (double)c->texture[i];
    CHECK(fabs(forward - backward) < 1e-3, "%g %g", forward, backward);
    float *const moved[] = {&c->texture[12 * CELLS_X + 19], &c->view.ambient[1]}; // one of them alone
    const double g[] = {(double)c->d_texture[12 * CELLS_X + 19], c->d_ambient[1]};
    for (int m = 0; m < 2; m++) {
        double more = 0;
        for (int side = 0; side < 2; side++) {
            *moved[m] += side ? -0.5f : 0.25f;
            c->k->forward(&c->view, c->texture, &c->veil, 0, H);
            for (int i = 0; i < 3 * H * W; i++)
                more += (side ? -2 : 2) * (double)fs_planes_row(&c->veil, i / (H * W), i / W % H)[i % W] *
                        (double)fs_planes_row(&c->d_veil, i / (H * W), i / W % H)[i % W];
        }
        *moved[m] += 0.25f;
        CHECK(fabs(g[m]) > 1e-3 && fabs(more - g[m]) < 1e-3 * (1 + fabs(g[m])), "%g, differences %g", g[m], more);
    }
}

// What looks away from the pane, or past it, is left alone.
static void check_behind(bool nowhere)
{
    Case c = make(&fs_veil_scalar);
    c.view.base[2] = -1;
    if (nowhere) c.view = (VeilView){.width = 0};
    run(&c);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) CHECK(fs_planes_row(&c.veil, 0, y)[x] == 0, "%d %d", x, y);
    drop(&c);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    for (int down = 0; down < 2; down++) check_definition(down);
    for (int nowhere = 0; nowhere < 2; nowhere++) check_behind(nowhere);
    Case ref = make(&fs_veil_scalar);
    check_gradient(&ref);
    run(&ref);
    FOR_LEVELS(level)
    {
        Case c = make(fs_kernels_at(level).veil);
        run(&c);
        double worst = planes_difference(&ref.veil, &c.veil);
        for (int i = 0; i < CELLS; i++) worst = fmax(worst, fabs((double)(ref.d_texture[i] - c.d_texture[i])));
        for (int k = 0; k < 3; k++) worst = fmax(worst, fabs(ref.d_ambient[k] - c.d_ambient[k]));
        CHECK(worst < 1e-4, "%s: %g", fs_cpu_name(level), worst);
        BENCH("veil", level, "pixel", W * H, run, &c);
        drop(&c);
    }
    drop(&ref);
    return check_end();
}
