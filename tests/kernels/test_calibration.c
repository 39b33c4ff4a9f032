// The calibration's twins against the scalar definition, and the definition's gradient against differences.
#include "check.h"

#include "kernels/calibration.h"

enum { W = 77, H = 23, PARAMETERS = 3 + FS_OPTICS_VIGNETTING + FS_OPTICS_KNOTS };

typedef struct Case {
    CalibrationView view;
    Planes I, P, d_P, d_I;
    CalibrationGradient gradient;
    const CalibrationKernels *k;
} Case;

static void run_forward(void *context)
{
    Case *c = context;
    c->k->forward(&c->view, &c->I, &c->P, 0, H);
}
static void run_backward(void *context)
{
    Case *c = context;
    c->gradient = (CalibrationGradient){0};
    c->k->backward(&c->view, &c->I, &c->d_P, &c->d_I, 0, H, &c->gradient);
}

static void make(Case *c, int curved)
{
    Rng rng = fs_rng_new(9);
    c->view = (CalibrationView){.white = {0.2f, -0.1f, -0.3f},
                                .vignetting = {-0.05f, 0.03f, -0.08f},
                                .cx = 35.2f,
                                .cy = 13.1f,
                                .per_px = {1 / 40.0f, 1 / 44.0f},
                                .exposure = curved ? 0.8f : 0,
                                .curved = curved};
    for (int k = 1; k < FS_OPTICS_KNOTS; k++) c->view.response[k] = 0.05f * (fs_rng_uniform(&rng) - 0.5f);
    c->I = random_planes(W, H, 3, 0, 1.6f, &rng); // some beyond the last knot
    c->d_P = random_planes(W, H, 3, -1, 1, &rng);
    c->P = random_planes(W, H, 3, 0, 1, &rng);
    c->d_I = random_planes(W, H, 3, 0, 1, &rng);
}
static void drop(Case *c)
{
    free(c->I.px), free(c->P.px), free(c->d_P.px), free(c->d_I.px);
}

static double loss(Case *c)
{
    double sum = 0;
    run_forward(c);
    for (int k = 0; k < 3; k++)
        for (int y = 0; y < H; y++)
            for (int x = 0; x < W; x++)
                sum += (double)fs_planes_row(&c->P, k, y)[x] * (double)fs_planes_row(&c->d_P, k, y)[x];
    return sum;
}

static float *parameter(CalibrationView *v, int i)
{
    if (i < 3) return &v->white[i];
    i -= 3;
    return i < FS_OPTICS_VIGNETTING ? &v->vignetting[i] : &v->response[i - FS_OPTICS_VIGNETTING];
}
static double gradient(const CalibrationGradient *g, int i)
{
    if (i < 3) return g->white[i];
    i -= 3;
    return i < FS_OPTICS_VIGNETTING ? g->vignetting[i] : g->response[i - FS_OPTICS_VIGNETTING];
}

static void check_parameters(Case *c)
{
    const float h = 1e-3f;
    run_backward(c);
    for (int i = 0; i < PARAMETERS; i++) {
        if (!c->view.curved && i >= 3 + FS_OPTICS_VIGNETTING) continue;
        float *p = parameter(&c->view, i), at = *p;
        double l[2], g = gradient(&c->gradient, i);
        for (int side = 0; side < 2; side++) {
            *p = at + (side ? h : -h);
            l[side] = loss(c);
        }
        *p = at;
        double slope = (l[1] - l[0]) / (2 * (double)h);
        CHECK(fabs(slope - g) < 2e-2 * fabs(slope) + 3e-2, "parameter %d: differences %g, gradient %g", i, slope, g);
    }
}

// dP/dI at single pixels away from the knots, where the response bends.
static void check_pixels(Case *c)
{
    int looked_at = 0;
    for (int y = 0; y < H; y += 2)
        for (int x = 0; x < W; x++) {
            float *I = &fs_planes_row(&c->I, 1, y)[x], at = *I, d_P = fs_planes_row(&c->d_P, 1, y)[x];
            const float h = 1e-3f;
            float P[3];
            for (int side = 0; side < 3; side++) {
                *I = at + h * (float)(side - 1);
                c->k->forward(&c->view, &c->I, &c->P, y, y + 1);
                P[side] = fs_planes_row(&c->P, 1, y)[x];
            }
            *I = at;
            if (fabsf(P[2] - 2 * P[1] + P[0]) > 2e-6f) continue; // a knot between
            double slope = (double)((P[2] - P[0]) * d_P) / (2 * (double)h), g = fs_planes_row(&c->d_I, 1, y)[x];
            looked_at++;
            CHECK(fabs(slope - g) < 1e-2 * fabs(slope) + 1e-3, "pixel %d %d: differences %g, gradient %g", x, y, slope,
                  g);
        }
    CHECK(looked_at > W * H / 4, "%d", looked_at);
}

// A photo of another exposure, brought to that of the others, shows what it would show without, times the factor.
static void check_exposure(void)
{
    Case c[2];
    const float exposure = 1.3f;
    for (int i = 0; i < 2; i++) {
        make(&c[i], 1);
        c[i].k = &fs_calibration_scalar;
        c[i].view.exposure = i ? exposure : 0;
        for (int k = 0; k < H * c[i].I.stride * 3 && i == 0; k++) c[i].I.px[k] /= exposure;
        run_forward(&c[i]);
    }
    for (int k = 0; k < H * c[0].P.stride * 3; k++) c[0].P.px[k] *= exposure;
    double difference = planes_difference(&c[0].P, &c[1].P);
    CHECK(difference < 1e-5, "%g", difference);
    for (int i = 0; i < 2; i++) drop(&c[i]);
}

// Nothing learned is nothing done.
static void check_identity(void)
{
    Case c;
    make(&c, 1);
    c.k = &fs_calibration_scalar;
    c.view = (CalibrationView){.per_px = {0.02f, 0.02f}, .curved = 1};
    run_forward(&c);
    double difference = planes_difference(&c.I, &c.P);
    CHECK(difference == 0, "%g", difference);
    drop(&c);
}

static void check_twin(Case *ref, int level, int curved)
{
    Case c;
    make(&c, curved);
    c.k = fs_kernels_at((CpuLevel)level).calibration;
    run_forward(&c);
    run_backward(&c);
    double P = planes_difference(&ref->P, &c.P), d_I = planes_difference(&ref->d_I, &c.d_I);
    CHECK(P < 1e-5 && d_I < 1e-3, "%s: %g %g", fs_cpu_name((CpuLevel)level), P, d_I);
    for (int i = 0; i < PARAMETERS; i++) {
        double p = gradient(&ref->gradient, i), q = gradient(&c.gradient, i);
        CHECK(fabs(p - q) < 1e-4 * (fabs(p) + 10), "%s parameter %d: %g, scalar %g", fs_cpu_name((CpuLevel)level), i, q,
              p);
    }
    BENCH(curved ? "calibration, response, forward" : "calibration forward", level, "pixel", W * H, run_forward, &c);
    BENCH(curved ? "calibration, response, backward" : "calibration backward", level, "pixel", W * H, run_backward, &c);
    drop(&c);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    check_exposure();
    check_identity();
    for (int curved = 0; curved < 2; curved++) {
        Case ref;
        make(&ref, curved);
        ref.k = &fs_calibration_scalar;
        check_parameters(&ref);
        run_backward(&ref);
        check_pixels(&ref);
        run_forward(&ref);
        FOR_LEVELS(level) check_twin(&ref, level, curved);
        drop(&ref);
    }
    return check_end();
}
