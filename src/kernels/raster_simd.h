// SIMD twin of raster.c, written once; see simd.h. A vector holds part of a group (VW 4), a group (8) or two (16).
#include <stdbool.h>

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

static const float row_centre[FS_TILE] = {0.5f, 1.5f, 2.5f,  3.5f,  4.5f,  5.5f,  6.5f,  7.5f,
                                          8.5f, 9.5f, 10.5f, 11.5f, 12.5f, 13.5f, 14.5f, 15.5f};

INLINE vi count_lanes(vi count, vm on) // one more in the lanes that are on
{
#if VW == 16
    return (vi)_mm512_mask_add_epi32((__m512i)count, on, (__m512i)count, _mm512_set1_epi32(1));
#else
    return count - (vi)on;
#endif
}

INLINE vf reciprocal(vf x)
{
#if VW == 16
    vf r = (vf)_mm512_rcp14_ps((__m512)x); // one Newton step: 2^-27
    return r * (v_set(2) - x * r);
#else
    return v_set(1) / x;
#endif
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

static void cover(const Splat *s, int x0, int y0, int tiles, float t_min, uint32_t *mask)
{
    const float margin = 1e-3f;
    float inv = -0.5f / s->a;
    vf k = v_set(4 * s->a * (s->l - t_min)), q = v_set(s->b * s->b - 4 * s->a * s->c);
    for (int i = 0; i < tiles; i++) mask[i] = 0;
    for (int row = 0; row < FS_TILE; row += VW) {
        vf dy = v_load(row_centre + row) + v_set((float)y0 - s->y);
        vf disc = v_fma(q * dy, dy, v_set(0) - k);
        vm any = v_le(v_set(0), disc);
        vf half = v_fma(v_sqrt(v_max(disc, v_set(0))), v_set(inv), v_set(margin));
        vf mid = v_fma(dy, v_set(s->b * inv), v_set(s->x - (float)x0));
        vf lo = mid - half, hi = mid + half;
        for (int i = 0; i < tiles; i++) {
            float x = (float)(i * FS_TILE);
            vm m0 = vm_and(any, vm_and(v_le(lo, v_set(x + 7.5f)), v_le(v_set(x + 0.5f), hi)));
            vm m1 = vm_and(any, vm_and(v_le(lo, v_set(x + 15.5f)), v_le(v_set(x + 8.5f), hi)));
            mask[i] |= (uint32_t)vm_bits(m0) << row | (uint32_t)vm_bits(m1) << (row + 16);
        }
    }
}

// ---- forward: step by step ----
// A step's colours and transmittance stay in registers while all splats that touch it pass. The tile's entries are
// taken BATCH at a time: their splats are copied side by side, and each step gets the list of those that touch it.

enum { BATCH = 128, STEPS = FS_TILE_PIXELS / LANES_PER_STEP, GROUPS_PER_STEP = LANES_PER_STEP / 8 };
#if VW == 16
typedef uint32_t BatchIndex;
#else
typedef uint8_t BatchIndex;
#endif

typedef struct Batch {
    Splat splat[BATCH]; // x and y from the tile's corner
    uint32_t mask[BATCH];
    int count[STEPS];
    BatchIndex list[STEPS][BATCH + 16];
} Batch;

INLINE void fill_batch(const RasterTile *tile, int first, uint32_t alive, Batch *batch)
{
    int n = tile->n - first < BATCH ? tile->n - first : BATCH;
    for (int i = 0; i < n; i++) {
        const TileEntry *e = &tile->entry[first + i];
        if (first + i + 24 < tile->n) __builtin_prefetch(&tile->splats[e[24].splat]);
        batch->splat[i] = tile->splats[e->splat];
        batch->splat[i].x -= (float)tile->x0;
        batch->splat[i].y -= (float)tile->y0;
        batch->mask[i] = steps_of(e->mask) & alive;
    }
    memset(batch->count, 0, sizeof batch->count);
#if VW == 16
    for (int i = n; i < (n + 15) / 16 * 16; i++) batch->mask[i] = 0;
    const __m512i lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    for (int i = 0; i < n; i += 16) {
        __m512i mask = _mm512_loadu_si512(batch->mask + i), index = _mm512_add_epi32(lane, _mm512_set1_epi32(i));
        for (int s = 0; s < STEPS; s++) {
            __mmask16 on = _mm512_test_epi32_mask(mask, _mm512_set1_epi32(1 << (2 * s)));
            _mm512_storeu_si512(batch->list[s] + batch->count[s], _mm512_maskz_compress_epi32(on, index));
            batch->count[s] += __builtin_popcount(on);
        }
    }
#else
    for (int i = 0; i < n; i++)
        for (uint32_t m = batch->mask[i]; m; m &= m - 1) {
            int s = __builtin_ctz(m);
            batch->list[s][batch->count[s]++] = (BatchIndex)i;
        }
#endif
}

// One vector of pixels through its list; returns whether any is still open.
INLINE bool forward_vector(const RasterTile *tile, const Batch *batch, int step, vf x, vf y, float *feature,
                           float *transmittance, long *pairs, const int nf)
{
    const vf t_min = v_set(tile->t_min), T_min = v_set(tile->transmittance_min);
    vf T = v_load(transmittance), sum[FS_FEATURES_MAX];
    for (int k = 0; k < nf; k++) sum[k] = v_load(feature + k * FS_TILE_PIXELS);
    vf T_end = T; // T goes on falling in closed lanes, where nobody asks: the chain from splat to splat stays short
    vm open = v_le(T_min, T);
    vi n_pairs = v_seti(0);
    for (int i = 0, n = batch->count[step]; i < n && vm_any(open); i++) {
        const Splat *s = &batch->splat[batch->list[step][i]];
        vf dx = x - v_set(s->x), dy = y - v_set(s->y);
        vf t = v_fma(v_fma(v_set(s->a), dx, v_set(s->b) * dy), dx, v_fma(v_set(s->c) * dy, dy, v_set(s->l)));
        vm near = v_le(t_min, t);
        vf alpha = v_where(near, v_min(exp2_fast(t), v_set(FS_ALPHA_MAX)));
        vf w = v_where(open, alpha * T);
        for (int k = 0; k < nf; k++) sum[k] = v_fma(w, v_set(s->feature[k]), sum[k]);
        n_pairs = count_lanes(n_pairs, vm_and(near, open));
        T = v_fma(v_set(0) - alpha, T, T);
        T_end = v_sel(open, T, T_end);
        open = v_le(T_min, T);
    }
    v_store(transmittance, T_end);
    for (int k = 0; k < nf; k++) v_store(feature + k * FS_TILE_PIXELS, sum[k]);
    for (int l = 0; l < VW; l++) *pairs += n_pairs[l];
    return vm_any(open);
}

INLINE long forward_n(const RasterTile *tile, float *feature, float *transmittance, const int nf)
{
    _Alignas(64) float px[FS_TILE_PIXELS], py[FS_TILE_PIXELS];
    _Alignas(64) Batch batch;
    lane_centres(px, py);
    for (int p = 0; p < FS_TILE_PIXELS; p++) transmittance[p] = 1;
    memset(feature, 0, sizeof(float) * FS_TILE_PIXELS * (size_t)nf);
    uint32_t alive = steps_of(0xffffffffu);
    long pairs = 0;
    for (int i = 0; i < tile->n && alive; i += BATCH) {
        fill_batch(tile, i, alive, &batch);
        for (int s = 0; s < STEPS; s++) {
            bool open = false;
            if (!batch.count[s]) continue;
            for (int p = s * LANES_PER_STEP; p < (s + 1) * LANES_PER_STEP; p += VW)
                open |= forward_vector(tile, &batch, s, v_load(px + p), v_load(py + p), feature + p, transmittance + p,
                                       &pairs, nf);
            if (!open) alive &= ~(1u << (s * GROUPS_PER_STEP));
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
    _Alignas(64) float px[FS_TILE_PIXELS], py[FS_TILE_PIXELS], T_now[FS_TILE_PIXELS], behind[FS_TILE_PIXELS];
    lane_centres(px, py);
    for (int p = 0; p < FS_TILE_PIXELS; p += VW) {
        vf s = d_transmittance ? v_load(d_transmittance + p) * v_load(transmittance + p) : v_set(0);
        for (int k = 0; k < nf; k++)
            s = v_fma(v_load(d_feature + k * FS_TILE_PIXELS + p), v_load(feature + k * FS_TILE_PIXELS + p), s);
        v_store(behind + p, s);
        v_store(T_now + p, v_set(1));
    }
    const vf t_min = v_set(tile->t_min), T_min = v_set(tile->transmittance_min), zero = v_set(0);
    uint32_t alive[GROUP_VECTORS];
    for (int v = 0; v < GROUP_VECTORS; v++) alive[v] = steps_of(0xffffffffu);
    for (int i = 0; i < tile->n; i++) {
        const Splat *s = &tile->splats[tile->entry[i].splat];
        if (i + 8 < tile->n) { // splats and records lie far apart: their cache lines must be on the way
            const TileEntry *ahead = &tile->entry[i + 8];
            const float *record = records + (size_t)ahead->slot * FS_RECORD;
            __builtin_prefetch(&tile->splats[ahead->splat]);
            __builtin_prefetch(record, 1);
            __builtin_prefetch(record + FS_RECORD - 1, 1);
        }
        const vf my = v_set(s->y - (float)tile->y0), c = v_set(s->c);
        const uint32_t steps = steps_of(tile->entry[i].mask);
        vf f[FS_FEATURES_MAX], d_f[FS_FEATURES_MAX];
        for (int k = 0; k < nf; k++) {
            f[k] = v_set(s->feature[k]);
            d_f[k] = zero;
        }
        vf m0 = zero, m1 = zero, m2 = zero, m3 = zero, m4 = zero, m5 = zero;
        for (int part = 0; part < 2 * GROUP_VECTORS; part++) { // lanes keep their x within a part
            const int half = part & 1, v = part >> 1;
            uint32_t m = steps & alive[v] & (half ? 0xffff0000u : 0xffffu);
            if (!m) continue;
            const vf dx = v_load(px + half * 128 + v * VW) - v_set(s->x - (float)tile->x0);
            const vf b_dx = v_set(s->b) * dx, t_dx = v_fma(v_set(s->a) * dx, dx, v_set(s->l));
            vf n0 = zero, n1 = zero, n2 = zero; // moments of d_t in y
            for (; m; m &= m - 1) {
                const int step = __builtin_ctz(m), p = step * 8 + v * VW;
                vf dy = v_load(py + p) - my, T = v_load(T_now + p);
                vf t = v_fma(v_fma(c, dy, b_dx), dy, t_dx);
                vm on = vm_and(v_le(t_min, t), v_le(T_min, T));
                vf alpha = v_where(on, exp2_fast(t));
                vm free = v_le(alpha, v_set(FS_ALPHA_MAX));
                alpha = v_min(alpha, v_set(FS_ALPHA_MAX));
                vf w = alpha * T, g = zero;
                for (int k = 0; k < nf; k++) {
                    vf d_k = v_load(d_feature + k * FS_TILE_PIXELS + p);
                    g = k ? v_fma(d_k, f[k], g) : d_k * f[k];
                    d_f[k] = v_fma(w, d_k, d_f[k]);
                }
                vf rest = v_load(behind + p) - w * g;
                v_store(behind + p, rest);
                vf d_t = v_where(free, w * g - alpha * (rest * reciprocal(v_set(1) - alpha)));
                T = v_fma(v_set(0) - alpha, T, T);
                v_store(T_now + p, T);
                if (!vm_any(v_le(T_min, T))) alive[v] &= ~(1u << step);
                vf gy = d_t * dy;
                n0 = n0 + d_t;
                n1 = n1 + gy;
                n2 = v_fma(gy, dy, n2);
            }
            vf gx = n0 * dx;
            m0 = m0 + n0;
            m1 = m1 + gx;
            m2 = m2 + n1;
            m3 = v_fma(gx, dx, m3);
            m4 = v_fma(n1, dx, m4);
            m5 = m5 + n2;
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
