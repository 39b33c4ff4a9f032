// Written once for AVX2, AVX-512 and NEON; see simd.h.
#include "kernels/pearson.h"
#include "kernels/compose.h"
#include "kernels/simd.h"

static PearsonSums sums(const PearsonArgs *args, int y0, int y1)
{
    const Planes *X = args->X_linear, *Y = args->Y_linear;
    PearsonSums s = {0};
    for (int c = 0; c < X->channels; c++)
        for (int y = y0; y < y1; y++) {
            const float *px = fs_planes_row(X, c, y), *py = fs_planes_row(Y, c, y);
            vf sx = v_set(0), sy = sx, sxx = sx, syy = sx, sxy = sx;
            for (int x = 0; x < X->width; x += VW) {
                vm lanes = vm_first(X->width - x);
                vf a = v_where(lanes, v_load(px + x)), b = v_where(lanes, v_load(py + x));
                sx += a;
                sy += b;
                sxx = v_fma(a, a, sxx);
                syy = v_fma(b, b, syy);
                sxy = v_fma(a, b, sxy);
            }
            s.x += v_sum(sx), s.y += v_sum(sy), s.xx += v_sum(sxx), s.yy += v_sum(syy), s.xy += v_sum(sxy);
        }
    s.n = (double)X->channels * (y1 - y0) * X->width;
    return s;
}

static void row(float *d_toned, const float *toned, const float *u, const float *v, int n, const PearsonLine *l)
{
    vf dark = v_set(FS_COMPOSE_DARK);
    for (int x = 0; x < n; x += VW) {
        vf t = v_load(toned + x), linear = v_load(u + x);
        vf slope =
            v_sel(v_lt(t, dark), v_set(FS_COMPOSE_DARK_SLOPE), linear / (v_max(t, dark) * v_set(FS_COMPOSE_GAMMA)));
        vf d = v_fma(v_set(l->a), v_load(v + x) - v_set(l->mean_v), v_set(l->b) * (linear - v_set(l->mean_u))) * slope;
        v_store(d_toned + x, v_load(d_toned + x) + v_where(vm_first(n - x), d));
    }
}

#include "kernels/pearson_gradient.h"

const PearsonKernels FS_SIMD_SUFFIX(fs_pearson) = {sums, gradient};
