// Written once for AVX2, AVX-512 and NEON; see simd.h. Lanes beyond the width are stored as 0.
#include "kernels/compose.h"
#include "kernels/simd.h"

INLINE vf decode_v(vf x)
{
    vf dark = v_set(FS_COMPOSE_DARK);
    return v_sel(v_lt(x, dark), x * v_set(FS_COMPOSE_DARK_SLOPE), v_pow(v_max(x, dark), 1 / FS_COMPOSE_GAMMA));
}
INLINE vf encode_v(vf x)
{
    vf dark = v_set(FS_COMPOSE_DARK_LINEAR);
    return v_sel(v_lt(x, dark), x * v_set(1 / FS_COMPOSE_DARK_SLOPE), v_pow(v_max(x, dark), FS_COMPOSE_GAMMA));
}

static void forward(const ComposeArgs *a, int y0, int y1)
{
    for (int c = 0; c < a->T->channels; c++)
        for (int y = y0; y < y1; y++) {
            const float *T = fs_planes_row(a->T, c, y), *R = fs_planes_row(a->R, c, y);
            const float *beta = a->beta ? fs_planes_row(a->beta, 0, y) : NULL;
            const float *tau = a->tau ? fs_planes_row(a->tau, 0, y) : NULL;
            const float *veil = a->veil ? fs_planes_row(a->veil, c, y) : NULL;
            float *I = fs_planes_row(a->I, c, y), *I_linear = fs_planes_row(a->I_linear, c, y);
            float *T_linear = fs_planes_row(a->T_linear, c, y), *R_linear = fs_planes_row(a->R_linear, c, y);
            for (int x = 0; x < a->T->width; x += VW) {
                vm lanes = vm_first(a->T->width - x);
                vf t = v_where(lanes, decode_v(v_load(T + x))), r = v_where(lanes, decode_v(v_load(R + x)));
                if (tau) t = v_where(lanes, t * v_load(tau + x));
                vf sum = beta ? v_where(lanes, v_fma(v_load(beta + x), r, t)) : t + r;
                if (veil) sum = sum + v_where(lanes, v_load(veil + x));
                v_store(T_linear + x, t);
                v_store(R_linear + x, r);
                v_store(I_linear + x, sum);
                v_store(I + x, encode_v(sum));
            }
        }
}

// The slopes of tone_curve.h.
INLINE vf decode_slope_v(vf toned, vf linear)
{
    vf dark = v_set(FS_COMPOSE_DARK);
    return v_sel(v_lt(toned, dark), v_set(FS_COMPOSE_DARK_SLOPE),
                 linear / (v_max(toned, dark) * v_set(FS_COMPOSE_GAMMA)));
}
INLINE vf encode_slope_v(vf linear, vf toned)
{
    vf dark = v_set(FS_COMPOSE_DARK_LINEAR);
    return v_sel(v_lt(linear, dark), v_set(1 / FS_COMPOSE_DARK_SLOPE),
                 toned * v_set(FS_COMPOSE_GAMMA) / v_max(linear, dark));
}
INLINE void add_v(float *to, vm lanes, vf x)
{
    v_store(to, v_load(to) + v_where(lanes, x));
}

static void backward(const ComposeArgs *a, int y0, int y1)
{
    const vf floor = v_set(a->slope_floor);
    for (int c = 0; c < a->T->channels; c++)
        for (int y = y0; y < y1; y++) {
            const float *T = fs_planes_row(a->T, c, y), *R = fs_planes_row(a->R, c, y);
            const float *beta = a->beta ? fs_planes_row(a->beta, 0, y) : NULL;
            const float *I = fs_planes_row(a->I, c, y), *I_linear = fs_planes_row(a->I_linear, c, y);
            const float *T_linear = fs_planes_row(a->T_linear, c, y), *R_linear = fs_planes_row(a->R_linear, c, y);
            const float *d_I = fs_planes_row(a->d_I, c, y);
            float *d_T = a->d_T ? fs_planes_row(a->d_T, c, y) : NULL;
            float *d_R = a->d_R ? fs_planes_row(a->d_R, c, y) : NULL;
            const float *tau = a->tau ? fs_planes_row(a->tau, 0, y) : NULL;
            float *d_tau = a->tau && a->d_tau ? fs_planes_row(a->d_tau, 0, y) : NULL;
            float *d_beta = a->d_beta ? fs_planes_row(a->d_beta, 0, y) : NULL;
            float *d_veil = a->d_veil ? fs_planes_row(a->d_veil, c, y) : NULL;
            for (int x = 0; x < a->T->width; x += VW) {
                vm lanes = vm_first(a->T->width - x);
                vf d = v_load(d_I + x) * encode_slope_v(v_load(I_linear + x), v_load(I + x));
                vf r = v_load(R_linear + x);
                vf t = v_load(T_linear + x), through = tau ? v_sel(lanes, v_load(tau + x), v_set(1)) : v_set(1);
                if (tau) t = t / through;
                if (d_T) add_v(d_T + x, lanes, d * through * v_max(decode_slope_v(v_load(T + x), t), floor));
                if (d_tau) add_v(d_tau + x, lanes, d * t);
                if (d_beta) add_v(d_beta + x, lanes, d * r);
                if (d_veil) v_store(d_veil + x, v_where(lanes, d));
                if (d_R)
                    add_v(d_R + x, lanes,
                          (beta ? d * v_load(beta + x) : d) * v_max(decode_slope_v(v_load(R + x), r), floor));
            }
        }
}

static void decode(const Planes *toned, const Planes *linear, int y0, int y1)
{
    for (int c = 0; c < toned->channels; c++)
        for (int y = y0; y < y1; y++) {
            const float *from = fs_planes_row(toned, c, y);
            float *to = fs_planes_row(linear, c, y);
            for (int x = 0; x < toned->width; x += VW)
                v_store(to + x, v_where(vm_first(toned->width - x), decode_v(v_load(from + x))));
        }
}

const ComposeKernels FS_SIMD_SUFFIX(fs_compose) = {forward, backward, decode};
