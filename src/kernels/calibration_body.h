// The maths of calibration.h in the words of real_scalar.h and real_simd.h: one pixel per lane.
#include <math.h>

#define PER_TONE (1 / FS_OPTICS_SPACING)

FN real vignetting(const CalibrationView *v, int x, int y, real *u)
{
    real dx = (r_set((float)x + 0.5f - v->cx) + r_lanes()) * r_set(v->per_px[0]);
    float dy = ((float)y + 0.5f - v->cy) * v->per_px[1];
    *u = dx * dx + r_set(dy * dy);
    real sum = r_set(0);
    for (int k = FS_OPTICS_VIGNETTING - 1; k >= 0; k--) sum = (sum + r_set(v->vignetting[k])) * *u;
    return r_max(r_set(1) + sum, r_set(FS_CALIBRATION_LEAST));
}

FN float exposure_of(const CalibrationView *v)
{
    return v->exposure > 0 ? v->exposure : 1;
}

// A knot's weight at q, which is in units of the spacing and not beyond the last knot.
FN real hat(real at, int knot)
{
    return r_max(r_set(0), r_set(1) - r_abs(at - r_set((float)knot)));
}

static void forward(const CalibrationView *v, const Planes *I, const Planes *P, int y0, int y1)
{
    const real per_tone = r_set(PER_TONE / exposure_of(v)), exposure = r_set(exposure_of(v));
    for (int c = 0; c < 3; c++) {
        const real white = r_set(expf(FS_OPTICS_GAMMA * v->white[c]));
        for (int y = y0; y < y1; y++)
            for (int x = 0; x < I->stride; x += LANES) {
                real u, q = white * vignetting(v, x, y, &u) * r_load(fs_planes_row(I, c, y) + x), h = q;
                real at = r_min(q * per_tone, r_set(FS_OPTICS_KNOTS - 1));
                for (int k = 0; k < FS_OPTICS_KNOTS && v->curved; k++)
                    h = h + exposure * r_set(v->response[k]) * hat(at, k);
                r_store(fs_planes_row(P, c, y) + x, h);
            }
    }
}

typedef struct Parts {
    real white, vignetting[FS_OPTICS_VIGNETTING], response[FS_OPTICS_KNOTS];
} Parts;

// Back through the response: dL/dq.
FN real curve_backward(const CalibrationView *v, real q, real d_h, Parts *parts)
{
    const real one = r_set(1), end = r_set(FS_OPTICS_KNOTS - 1), d_knots = r_set(exposure_of(v)) * d_h;
    const real scaled = q * r_set(PER_TONE / exposure_of(v)), at = r_min(scaled, end);
    real slope = r_set(0);
    for (int k = 0; k < FS_OPTICS_KNOTS; k++) {
        real d = at - r_set((float)k), rise = r_set(v->response[k] * PER_TONE);
        slope = slope + r_below(r_abs(d), one, r_below(d, r_set(0), rise + rise) - rise);
        parts->response[k] = parts->response[k] + d_knots * hat(at, k);
    }
    return d_h * (one + r_below(scaled, end, slope));
}

static void backward(const CalibrationView *v, const Planes *I, const Planes *d_P, const Planes *d_I, int y0, int y1,
                     CalibrationGradient *gradient)
{
    const real width = r_set((float)I->width);
    for (int c = 0; c < 3; c++) {
        const real white = r_set(expf(FS_OPTICS_GAMMA * v->white[c]));
        for (int y = y0; y < y1; y++) {
            Parts parts;
            parts.white = r_set(0);
            for (int k = 0; k < FS_OPTICS_VIGNETTING; k++) parts.vignetting[k] = r_set(0);
            for (int k = 0; k < FS_OPTICS_KNOTS; k++) parts.response[k] = r_set(0);
            for (int x = 0; x < I->width; x += LANES) {
                real u, V = vignetting(v, x, y, &u), lit = white * r_load(fs_planes_row(I, c, y) + x), q = V * lit;
                real d = r_below(r_set((float)x) + r_lanes(), width, r_load(fs_planes_row(d_P, c, y) + x));
                if (v->curved) d = curve_backward(v, q, d, &parts);
                r_store(fs_planes_row(d_I, c, y) + x, d * white * V);
                parts.white = parts.white + d * q;
                real d_V = r_below(r_set(FS_CALIBRATION_LEAST), V, d * lit);
                for (int k = 0; k < FS_OPTICS_VIGNETTING; k++) {
                    d_V = d_V * u;
                    parts.vignetting[k] = parts.vignetting[k] + d_V;
                }
            }
            gradient->white[c] += (double)(FS_OPTICS_GAMMA * r_sum(parts.white));
            for (int k = 0; k < FS_OPTICS_VIGNETTING; k++)
                gradient->vignetting[k] += (double)r_sum(parts.vignetting[k]);
            for (int k = 0; k < FS_OPTICS_KNOTS && v->curved; k++)
                gradient->response[k] += (double)r_sum(parts.response[k]);
        }
    }
}
