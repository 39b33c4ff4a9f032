// The pane's twins against the scalar definition, and the definition's gradient against differences.
#include "check.h"

enum { W = 77, H = 23 };

typedef struct Case {
    PaneView view;
    Planes beta, tau, d_beta, d_tau;
    PaneGradient gradient;
    const PaneKernels *k;
} Case;

static void run_forward(void *context)
{
    Case *c = context;
    c->k->forward(&c->view, &c->beta, &c->tau, 0, H);
}
static void run_backward(void *context)
{
    Case *c = context;
    c->gradient = c->k->backward(&c->view, &c->d_beta, &c->d_tau, 0, H);
}

static void make(Case *c)
{
    Rng rng = fs_rng_new(9);
    // from beyond the edge of the pane (grazing, beta at its most) to the other side of its normal
    c->view = (PaneView){{-1.2f, -0.4f, 0.7f},
                         {0.035f, 0.001f, -0.002f},
                         {0.002f, 0.03f, 0},
                         {0.6f, 0, 0.8f},
                         0.09f,
                         0.06f,
                         0.97f,
                         1.2f,
                         0.7f};
    c->beta = random_planes(W, H, 1, 0, 1, &rng);
    c->tau = random_planes(W, H, 1, 0, 1, &rng);
    c->d_beta = random_planes(W, H, 1, -1, 1, &rng);
    c->d_tau = random_planes(W, H, 1, -1, 1, &rng);
}
static void drop(Case *c)
{
    free(c->beta.px);
    free(c->tau.px);
    free(c->d_beta.px);
    free(c->d_tau.px);
}

static double loss(Case *c)
{
    double sum = 0;
    run_forward(c);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            sum += (double)fs_planes_row(&c->beta, 0, y)[x] * (double)fs_planes_row(&c->d_beta, 0, y)[x] +
                   (double)fs_planes_row(&c->tau, 0, y)[x] * (double)fs_planes_row(&c->d_tau, 0, y)[x];
    return sum;
}

// dL/d dimming, dL along a turn of the normal, and by the logarithms of the photo's factors.
static void check_gradient(Case *c)
{
    const float step = 2e-4f, turn[3] = {-0.8f, 0, 0.6f}; // at right angles to the normal
    const PaneView as_made = c->view;
    c->view.most = 10; // the bound is a kink, which no difference can cross; so is a ray along the pane
    c->view.base[0] += 0.4f;
    PaneView at = c->view;
    double slope[4], along = 0;
    run_backward(c);
    for (int k = 0; k < 3; k++) along += c->gradient.normal[k] * (double)turn[k];
    for (int what = 0; what < 4; what++) {
        double l[2];
        for (int side = 0; side < 2; side++) {
            float h = side ? step : -step;
            c->view = at;
            if (what == 0) c->view.dimming += h;
            for (int k = 0; k < 3 && what == 1; k++) c->view.normal[k] += h * turn[k];
            if (what == 2) c->view.T *= expf(h);
            if (what == 3) c->view.R *= expf(h);
            l[side] = loss(c);
        }
        slope[what] = (l[1] - l[0]) / (2 * (double)step);
    }
    c->view = as_made;
    CHECK(fabs(slope[0] - c->gradient.dimming) < 2e-2 * fabs(slope[0]) + 1e-2, "dimming: differences %g, gradient %g",
          slope[0], c->gradient.dimming);
    CHECK(fabs(slope[1] - along) < 2e-2 * fabs(slope[1]) + 1e-2, "normal: differences %g, gradient %g", slope[1],
          along);
    CHECK(fabs(slope[2] - c->gradient.T) < 2e-2 * fabs(slope[2]) + 1e-2, "T: differences %g, gradient %g", slope[2],
          c->gradient.T);
    CHECK(fabs(slope[3] - c->gradient.R) < 2e-2 * fabs(slope[3]) + 1e-2, "R: differences %g, gradient %g", slope[3],
          c->gradient.R);
}

// Where the pane reflects at its most, too: that lies at another angle with another dimming, and changing the unit of R
// changes nothing but R's brightness.
static void check_most(Case *c)
{
    const float step = 5e-5f;
    const PaneView as_made = c->view;
    double l[2];
    run_backward(c);
    for (int side = 0; side < 2; side++) {
        c->view.dimming = as_made.dimming + (side ? step : -step);
        l[side] = loss(c);
    }
    c->view = as_made;
    double slope = (l[1] - l[0]) / (2 * (double)step), g = c->gradient.dimming;
    CHECK(fabs(slope - g) < 3e-2 * fabs(slope), "dimming with the most: differences %g, gradient %g", slope, g);
    float unit = c->view.f0, highest = 0;
    run_forward(c);
    Planes beta = c->beta;
    c->beta = random_planes(W, H, 1, 0, 1, &(Rng){1});
    c->view.f0 *= 4;
    run_forward(c);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            float was = fs_planes_row(&beta, 0, y)[x], is = fs_planes_row(&c->beta, 0, y)[x];
            highest = fmaxf(highest, was);
            CHECK(fabsf(is / was - 4) < 1e-4f, "unit of R at %d %d: %g, %g", x, y, (double)was, (double)is);
        }
    float most = unit / c->view.dimming * c->view.most * c->view.R;
    CHECK(fabsf(highest / most - 1) < 1e-4f, "most %g, expected %g", (double)highest, (double)most);
    free(c->beta.px);
    c->beta = beta;
    c->view = as_made;
    run_forward(c);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    static Case ref, c;
    make(&ref);
    ref.k = &fs_pane_scalar;
    check_gradient(&ref);
    check_most(&ref);
    run_forward(&ref);
    run_backward(&ref);
    FOR_LEVELS(level)
    {
        make(&c);
        c.k = fs_kernels_at(level).pane;
        run_forward(&c);
        run_backward(&c);
        double b = planes_difference(&ref.beta, &c.beta), t = planes_difference(&ref.tau, &c.tau);
        CHECK(b < 1e-5 && t < 1e-5, "%s: %g %g", fs_cpu_name(level), b, t);
        const double *p = &ref.gradient.normal[0], *q = &c.gradient.normal[0];
        for (int k = 0; k < 3; k++)
            CHECK(fabs(p[k] - q[k]) < 1e-4 * (fabs(p[k]) + 1), "%s normal %d: %g, scalar %g", fs_cpu_name(level), k,
                  q[k], p[k]);
        CHECK(fabs(ref.gradient.T - c.gradient.T) < 1e-4 * (fabs(ref.gradient.T) + 1) &&
                  fabs(ref.gradient.R - c.gradient.R) < 1e-4 * (fabs(ref.gradient.R) + 1),
              "%s factors: %g %g, scalar %g %g", fs_cpu_name(level), c.gradient.T, c.gradient.R, ref.gradient.T,
              ref.gradient.R);
        CHECK(fabs(ref.gradient.dimming - c.gradient.dimming) < 1e-4 * (fabs(ref.gradient.dimming) + 1),
              "%s dimming: %g, scalar %g", fs_cpu_name(level), c.gradient.dimming, ref.gradient.dimming);
        BENCH("pane forward", level, "pixel", W * H, run_forward, &c);
        BENCH("pane backward", level, "pixel", W * H, run_backward, &c);
        drop(&c);
    }
    drop(&ref);
    return check_end();
}
