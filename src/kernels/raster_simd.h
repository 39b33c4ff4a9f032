// SIMD twin of raster.c, written once; see simd.h. A vector holds part of a group (VW 4), a group (8) or two (16).
#include "kernels/raster.h"
#include "kernels/simd.h"

#define GROUP_VECTORS (VW < 8 ? 8 / VW : 1) // vectors per step of the mask
#define LANES_PER_STEP (VW < 8 ? 8 : VW)

typedef uint32_t vu __attribute__((vector_size(4 * VW)));

// 2^t, t in [-30, 1]: relative error under 3e-6 (degree-4 minimax polynomial on [-1/2, 1/2]).
INLINE vf exp2_fast(vf t)
{
    vf n = v_round(t);
    vf r = t - n;
    vf p = v_set(0.0095701f);
    p = v_fma(p, r, v_set(0.05591786f));
    p = v_fma(p, r, v_set(0.24024745f));
    p = v_fma(p, r, v_set(0.69312181f));
    p = v_fma(p, r, v_set(0.99999926f));
    return (vf)((vu)p + (vu)v_shift_left(v_to_int(n), 23)); // unsigned: lanes out of range, masked later, may wrap
}

// The masks of steps: with VW 16, one step covers two groups.
INLINE uint32_t steps_of(uint32_t mask)
{
#if VW == 16
    return (mask | mask >> 1) & 0x55555555u;
#else
    return mask;
#endif
}

// Lanes of the first vector of step g, as pixel centres.
INLINE void lane_centres(float *x, float *y)
{
    for (int p = 0; p < FS_TILE_PIXELS; p++) {
        x[p] = (float)(p / 128 * 8 + p % 8) + 0.5f;
        y[p] = (float)(p % 128 / 8) + 0.5f;
    }
}

// Sums of the lanes of four vectors.
INLINE void sum4(vf a, vf b, vf c, vf d, float out[4])
{
#if VW == 4
    float32x4_t ab = vpaddq_f32((float32x4_t)a, (float32x4_t)b), cd = vpaddq_f32((float32x4_t)c, (float32x4_t)d);
    vst1q_f32(out, vpaddq_f32(ab, cd));
#else
#if VW == 16
#define FOLD(v) _mm256_add_ps(_mm512_castps512_ps256((__m512)v), _mm512_extractf32x8_ps((__m512)v, 1))
#else
#define FOLD(v) (__m256) v
#endif
    __m256 ab = _mm256_hadd_ps(FOLD(a), FOLD(b)), cd = _mm256_hadd_ps(FOLD(c), FOLD(d));
    __m256 s = _mm256_hadd_ps(ab, cd);
    _mm_storeu_ps(out, _mm_add_ps(_mm256_castps256_ps128(s), _mm256_extractf128_ps(s, 1)));
#undef FOLD
#endif
}

static uint32_t cover(const Splat *s, int x0, int y0, float t_min)
{
    const float margin = 1e-3f;
    float inv = -0.5f / s->a;
    vf k = v_set(4 * s->a * (s->l - t_min)), q = v_set(s->b * s->b - 4 * s->a * s->c);
    uint32_t left = 0, right = 0;
    for (int row = 0; row < FS_TILE; row += VW) {
        float centre[VW];
        for (int l = 0; l < VW; l++) centre[l] = (float)l + 0.5f;
        vf dy = v_load(centre) + v_set((float)(y0 + row) - s->y);
        vf disc = v_fma(q * dy, dy, v_set(0) - k);
        vm any = v_le(v_set(0), disc);
        vf half = v_sqrt(v_max(disc, v_set(0))) * v_set(inv) + v_set(margin);
        vf mid = v_fma(dy, v_set(s->b * inv), v_set(s->x - (float)x0));
        vf lo = mid - half, hi = mid + half;
        vm m0 = vm_and(any, vm_and(v_le(lo, v_set(7.5f)), v_le(v_set(0.5f), hi)));
        vm m1 = vm_and(any, vm_and(v_le(lo, v_set(15.5f)), v_le(v_set(8.5f), hi)));
        left |= (uint32_t)vm_bits(m0) << row;
        right |= (uint32_t)vm_bits(m1) << row;
    }
    return left | right << 16;
}

INLINE long forward_n(const RasterTile *tile, float *feature, float *transmittance, const int nf)
{
    float px[FS_TILE_PIXELS], py[FS_TILE_PIXELS];
    lane_centres(px, py);
    for (int p = 0; p < FS_TILE_PIXELS; p++) transmittance[p] = 1;
    memset(feature, 0, sizeof(float) * FS_TILE_PIXELS * (size_t)nf);
    const vf t_min = v_set(tile->t_min), T_min = v_set(tile->transmittance_min);
    uint32_t alive = steps_of(0xffffffffu);
    long pairs = 0;
    for (int i = 0; i < tile->n && alive; i++) {
        const Splat *s = &tile->splats[tile->entry[i].splat];
        if (i + 4 < tile->n) __builtin_prefetch(&tile->splats[tile->entry[i + 4].splat]);
        const vf mx = v_set(s->x - (float)tile->x0), my = v_set(s->y - (float)tile->y0);
        const vf a = v_set(s->a), b = v_set(s->b), c = v_set(s->c), l = v_set(s->l);
        vf f[FS_FEATURES_MAX];
        for (int k = 0; k < nf; k++) f[k] = v_set(s->feature[k]);
        for (uint32_t m = steps_of(tile->entry[i].mask) & alive; m; m &= m - 1) {
            const int g = __builtin_ctz(m);
            int open = 0;
            for (int v = 0; v < GROUP_VECTORS; v++) {
                const int p = g * 8 + v * VW;
                vf dx = v_load(px + p) - mx, dy = v_load(py + p) - my, T = v_load(transmittance + p);
                vf t = v_fma(v_fma(a, dx, b * dy), dx, v_fma(c * dy, dy, l));
                vm on = vm_and(v_le(t_min, t), v_le(T_min, T));
                vf w = v_where(on, v_min(exp2_fast(t), v_set(FS_ALPHA_MAX))) * T;
                for (int k = 0; k < nf; k++)
                    v_store(feature + k * FS_TILE_PIXELS + p, v_fma(w, f[k], v_load(feature + k * FS_TILE_PIXELS + p)));
                T = T - w;
                v_store(transmittance + p, T);
                open |= vm_any(v_le(T_min, T));
                pairs += __builtin_popcount(vm_bits(on));
            }
            if (!open) alive &= ~(1u << g);
        }
    }
    return pairs;
}

static long forward(const RasterTile *tile, float *feature, float *transmittance)
{
    switch (tile->features) {
    case 1: return forward_n(tile, feature, transmittance, 1);
    case 2: return forward_n(tile, feature, transmittance, 2);
    case 3: return forward_n(tile, feature, transmittance, 3);
    default: return forward_n(tile, feature, transmittance, 4);
    }
}

INLINE void backward_n(const RasterTile *tile, const float *feature, const float *transmittance, const float *d_feature,
                       const float *d_transmittance, float *records, const int nf)
{
    float px[FS_TILE_PIXELS], py[FS_TILE_PIXELS], T_now[FS_TILE_PIXELS], behind[FS_TILE_PIXELS];
    lane_centres(px, py);
    for (int p = 0; p < FS_TILE_PIXELS; p += VW) {
        vf s = d_transmittance ? v_load(d_transmittance + p) * v_load(transmittance + p) : v_set(0);
        for (int k = 0; k < nf; k++)
            s = v_fma(v_load(d_feature + k * FS_TILE_PIXELS + p), v_load(feature + k * FS_TILE_PIXELS + p), s);
        v_store(behind + p, s);
        v_store(T_now + p, v_set(1));
    }
    const vf t_min = v_set(tile->t_min), T_min = v_set(tile->transmittance_min), zero = v_set(0);
    uint32_t alive = steps_of(0xffffffffu);
    for (int i = 0; i < tile->n; i++) {
        const Splat *s = &tile->splats[tile->entry[i].splat];
        if (i + 4 < tile->n) __builtin_prefetch(&tile->splats[tile->entry[i + 4].splat]);
        const vf mx = v_set(s->x - (float)tile->x0), my = v_set(s->y - (float)tile->y0);
        const vf a = v_set(s->a), b = v_set(s->b), c = v_set(s->c), l = v_set(s->l);
        vf f[FS_FEATURES_MAX], d_f[FS_FEATURES_MAX];
        for (int k = 0; k < nf; k++) {
            f[k] = v_set(s->feature[k]);
            d_f[k] = zero;
        }
        vf m0 = zero, m1 = zero, m2 = zero, m3 = zero, m4 = zero, m5 = zero;
        for (uint32_t m = steps_of(tile->entry[i].mask) & alive; m; m &= m - 1) {
            const int step = __builtin_ctz(m);
            int open = 0;
            for (int v = 0; v < GROUP_VECTORS; v++) {
                const int p = step * 8 + v * VW;
                vf dx = v_load(px + p) - mx, dy = v_load(py + p) - my, T = v_load(T_now + p);
                vf t = v_fma(v_fma(a, dx, b * dy), dx, v_fma(c * dy, dy, l));
                vm on = vm_and(v_le(t_min, t), v_le(T_min, T));
                vf alpha = v_where(on, exp2_fast(t));
                vm free = v_le(alpha, v_set(FS_ALPHA_MAX));
                alpha = v_min(alpha, v_set(FS_ALPHA_MAX));
                vf w = alpha * T, g = zero;
                for (int k = 0; k < nf; k++) {
                    vf d_k = v_load(d_feature + k * FS_TILE_PIXELS + p);
                    g = v_fma(d_k, f[k], g);
                    d_f[k] = v_fma(w, d_k, d_f[k]);
                }
                vf rest = v_load(behind + p) - w * g;
                v_store(behind + p, rest);
                vf d_t = v_where(free, alpha * (T * g - rest / (v_set(1) - alpha)));
                T = T - w;
                v_store(T_now + p, T);
                open |= vm_any(v_le(T_min, T));
                vf gx = d_t * dx, gy = d_t * dy;
                m0 = m0 + d_t;
                m1 = m1 + gx;
                m2 = m2 + gy;
                m3 = v_fma(gx, dx, m3);
                m4 = v_fma(gx, dy, m4);
                m5 = v_fma(gy, dy, m5);
            }
            if (!open) alive &= ~(1u << step);
        }
        const vf ln2 = v_set(0.69314718f);
        float r[12];
        sum4(m0 * ln2, m1 * ln2, m2 * ln2, m3 * ln2, r);
        sum4(m4 * ln2, m5 * ln2, d_f[0], nf > 1 ? d_f[1] : zero, r + 4);
        if (nf > 2)
            sum4(d_f[2], nf > 3 ? d_f[3] : zero, zero, zero, r + 8);
        else
            r[8] = r[9] = 0;
        memcpy(records + (size_t)tile->entry[i].slot * FS_RECORD, r, sizeof(float) * FS_RECORD);
    }
}

static void backward(const RasterTile *tile, const float *feature, const float *transmittance, const float *d_feature,
                     const float *d_transmittance, float *records)
{
    switch (tile->features) {
    case 1: backward_n(tile, feature, transmittance, d_feature, d_transmittance, records, 1); break;
    case 2: backward_n(tile, feature, transmittance, d_feature, d_transmittance, records, 2); break;
    case 3: backward_n(tile, feature, transmittance, d_feature, d_transmittance, records, 3); break;
    default: backward_n(tile, feature, transmittance, d_feature, d_transmittance, records, 4); break;
    }
}

const RasterKernels FS_SIMD_SUFFIX(fs_raster) = {cover, forward, backward};
