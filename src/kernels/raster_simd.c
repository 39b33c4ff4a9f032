// SIMD twin of raster.c, written once; see simd.h. A vector holds half a row of a tile (VW 4), a row (8) or two (16).
#include <stdbool.h>

#include "kernels/raster.h"
#include "kernels/simd.h"

// A step of backward is one row of the tile, with VW 16 two; one of forward always is two rows.
#define STEP_VECTORS (VW < FS_TILE_W ? FS_TILE_W / VW : 1)
#define STEP_ROWS (VW / FS_TILE_W * STEP_VECTORS > 1 ? VW / FS_TILE_W : 1)
#define STEPS (FS_TILE_H / STEP_ROWS)
#define PAIR_VECTORS (2 * FS_TILE_W / VW)
#define PAIRS (FS_TILE_H / 2)
#define ALPHAS_FIRST (VW < 16)  // alphas first, then what they do: two short loops where registers are few
#define LOG2_ALPHA_MAX -0.0146f // under log2(FS_ALPHA_MAX): a splat with L below is nowhere clamped
#define CENTRE_X (FS_TILE_W / 2)
#define CENTRE_Y (FS_TILE_H / 2)

// 2^t, t in [-30, 1]: relative error under 3e-6 (degree-4 minimax polynomial on [-1/2, 1/2]). Lanes out of range,
// masked later, may hold anything.
INLINE vf exp2_fast(vf t)
{
    vf n = v_round(t);
    vf r = t - n;
    vf p = v_set(0.0095701f);
    p = v_fma(p, r, v_set(0.05591786f));
    p = v_fma(p, r, v_set(0.24024745f));
    p = v_fma(p, r, v_set(0.69312181f));
    p = v_fma(p, r, v_set(0.99999926f));
#if VW == 16
    return (vf)_mm512_scalef_ps((__m512)p, (__m512)n);
#else
    typedef uint32_t vu __attribute__((vector_size(4 * VW))); // unsigned may wrap
    return (vf)((vu)p + (vu)v_shift_left(v_to_int(n), 23));
#endif
}

static const float row_centre[FS_TILE_H] = {0.5f,  1.5f,  2.5f,  3.5f,  4.5f,  5.5f,  6.5f,  7.5f,  8.5f,  9.5f,  10.5f,
                                            11.5f, 12.5f, 13.5f, 14.5f, 15.5f, 16.5f, 17.5f, 18.5f, 19.5f, 20.5f, 21.5f,
                                            22.5f, 23.5f, 24.5f, 25.5f, 26.5f, 27.5f, 28.5f, 29.5f, 30.5f, 31.5f};

INLINE vi count_lanes(vi count, vm on) // one more in the lanes that are on
{
#if VW == 16
    return (vi)_mm512_mask_add_epi32((__m512i)count, on, (__m512i)count, _mm512_set1_epi32(1));
#else
    return count - (vi)on;
#endif
}

INLINE vf odds_of(vf alpha) // -alpha / (1 - alpha)
{
#if VW == 16
    return alpha * (vf)_mm512_rcp14_ps((__m512)(alpha - v_set(1))); // relative error 2^-14, in one term of a gradient
#else
    return alpha / (alpha - v_set(1));
#endif
}

INLINE vf sqrt_from_above(vf x) // at most a 2^-13th too large; NaN of what is below 0, and of 0 perhaps
{
#if VW == 16
    return (vf)_mm512_rsqrt14_ps((__m512)x) * (x * v_set(1 + 0x1p-14f));
#else
    return v_sqrt(x);
#endif
}

// The mask of steps of one or two rows: of two, the first one's bit stands for both.
INLINE uint32_t steps_of(uint32_t mask, const int rows)
{
    return rows == 2 ? (mask | mask >> 1) & 0x55555555u : mask;
}

INLINE uint32_t signs_of(vi x) // bit i: lane i is negative
{
#if VW == 16
    return _mm512_movepi32_mask((__m512i)x);
#elif VW == 8
    return (uint32_t)_mm256_movemask_ps((__m256)x);
#else
    return vm_bits(vcltzq_s32((int32x4_t)x));
#endif
}

// Pixel centres of vector v of a step, from the tile's centre.
INLINE vf lane_x(int v)
{
    float x[VW];
    for (int l = 0; l < VW; l++) x[l] = (float)((v * VW + l) % FS_TILE_W - CENTRE_X) + 0.5f;
    return v_load(x);
}
INLINE vf lane_y(int step)
{
    float y[VW];
    for (int l = 0; l < VW; l++) y[l] = (float)(step * STEP_ROWS + l / FS_TILE_W - CENTRE_Y) + 0.5f;
    return v_load(y);
}

// Sums of the lanes of ten vectors, the gradient record.
#if VW == 16
INLINE __m512 half_of(vf a, vf b) // sums of 8 lanes: a's in the lower half, b's in the upper
{
    __m512 inner = _mm512_mask_blend_ps(0xff00, (__m512)a, (__m512)b);
    return _mm512_add_ps(inner, _mm512_shuffle_f32x4((__m512)a, (__m512)b, 0x4e));
}
INLINE __m512 quarter_of(__m512 ab, __m512 cd) // of 4 lanes: a's, b's, c's, d's
{
    return _mm512_add_ps(_mm512_shuffle_f32x4(ab, cd, 0x88), _mm512_shuffle_f32x4(ab, cd, 0xdd));
}
INLINE __m512 pairs_of(__m512 x, __m512 y) // within quarters, of 2 lanes: x's, y's
{
    return _mm512_add_ps(_mm512_shuffle_ps(x, y, 0x88), _mm512_shuffle_ps(x, y, 0xdd));
}
INLINE void sum_record(const vf v[FS_RECORD], float *out)
{
    __m512 x = quarter_of(half_of(v[0], v[1]), half_of(v[2], v[3]));
    __m512 y = quarter_of(half_of(v[4], v[5]), half_of(v[6], v[7]));
    __m512 z = half_of(v[8], v[9]);
    z = quarter_of(z, z);
    __m512 sums = pairs_of(pairs_of(x, y), pairs_of(z, z)); // quarter i: x_i, y_i, z_i, z_i
    sums = _mm512_permutexvar_ps(_mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15), sums);
    _mm256_storeu_ps(out, _mm512_castps512_ps256(sums));
    _mm_storel_pi((__m64 *)(out + 8), _mm512_extractf32x4_ps(sums, 2));
}
#else
INLINE void sum4(const vf v[4], float *out)
{
#if VW == 4
    float32x4_t ab = vpaddq_f32((float32x4_t)v[0], (float32x4_t)v[1]);
    vst1q_f32(out, vpaddq_f32(ab, vpaddq_f32((float32x4_t)v[2], (float32x4_t)v[3])));
#else
    __m256 ab = _mm256_hadd_ps((__m256)v[0], (__m256)v[1]), cd = _mm256_hadd_ps((__m256)v[2], (__m256)v[3]);
    __m256 s = _mm256_hadd_ps(ab, cd);
    _mm_storeu_ps(out, _mm_add_ps(_mm256_castps256_ps128(s), _mm256_extractf128_ps(s, 1)));
#endif
}
INLINE void sum_record(const vf v[FS_RECORD], float *out)
{
    sum4(v, out);
    sum4(v + 4, out + 4);
    out[8] = v_sum(v[8]);
    out[9] = v_sum(v[9]);
}
#endif

static void cover(const Splat *s, int x0, int y0, int tiles, float t_min, uint32_t *mask)
{
    const float margin = 1e-3f, inv = -0.5f / s->a;
    const vf k = v_set(4 * s->a * (s->l - t_min)), q = v_set(s->b * s->b - 4 * s->a * s->c);
    vf lo[FS_TILE_H / VW], hi[FS_TILE_H / VW]; // where each row's chord begins and ends
    for (int i = 0; i < FS_TILE_H / VW; i++) {
        vf dy = v_load(row_centre + i * VW) + v_set((float)y0 - s->y);
        vf disc = v_fma(q * dy, dy, v_set(0) - k);
        vf half = v_fma(sqrt_from_above(disc), v_set(inv), v_set(margin)); // NaN where there is none: compares as false
        vf mid = v_fma(dy, v_set(s->b * inv), v_set(s->x - (float)x0));
        lo[i] = mid - half;
        hi[i] = mid + half;
    }
    for (int tile = 0; tile < tiles; tile++) {
        const vf first = v_set((float)(tile * FS_TILE_W) + 0.5f), last = first + v_set(FS_TILE_W - 1);
        uint32_t bits = 0;
        for (int i = 0; i < FS_TILE_H / VW; i++)
            bits |= (uint32_t)vm_bits(vm_and(v_le(lo[i], last), v_le(first, hi[i]))) << (i * VW);
        mask[tile] = bits;
    }
}

// ---- a tile's entries, BATCH at a time, made ready side by side ----
// A splat's exponent over a tile is t = k + kx x + ky y + a x^2 + b x y + c y^2, with (x, y) from the tile's centre.
// The lanes of a vector keep their x from step to step: for them t = t0 + y (t1 + c y).

typedef struct Batched {
    vf t0[STEP_VECTORS], t1[STEP_VECTORS];
    float c, feature[FS_FEATURES_MAX];
    float mx, my; // mean from the tile's centre
    bool clamped; // alpha may exceed FS_ALPHA_MAX
    uint32_t slot;
} Batched;

enum { BATCH = 64, BACKWARD_BATCH = 16, AHEAD = 24 };

typedef struct Batch {
    Batched splat[BATCH];
    uint32_t mask[BATCH]; // of steps
    int n, next;          // entries taken, first one not looked at
} Batch;

INLINE void make_ready(const RasterTile *tile, const Splat *s, Batched *b)
{
    const float mx = s->x - (float)(tile->x0 + CENTRE_X), my = s->y - (float)(tile->y0 + CENTRE_Y);
    const float kx = -(2 * s->a * mx + s->b * my), ky = -(2 * s->c * my + s->b * mx);
    const vf k = v_set(s->l - 0.5f * (kx * mx + ky * my));
    for (int v = 0; v < STEP_VECTORS; v++) {
        const vf x = lane_x(v);
        b->t0[v] = v_fma(v_fma(v_set(s->a), x, v_set(kx)), x, k);
        b->t1[v] = v_fma(v_set(s->b), x, v_set(ky));
    }
    b->c = s->c;
    memcpy(b->feature, s->feature, sizeof b->feature);
    b->mx = mx;
    b->my = my;
    b->clamped = s->l > LOG2_ALPHA_MAX;
}

// The next entries of which a step of so many rows is alive, at most `most`; the records of others, if there are any,
// become 0.
INLINE void fill_batch(const RasterTile *tile, uint32_t alive, const int rows, int most, Batch *batch, float *records)
{
    batch->n = 0;
    for (; batch->next < tile->n && batch->n < most; batch->next++) {
        const int i = batch->next;
        if (i + AHEAD < tile->n) { // splats and records lie far apart: their cache lines must be on the way
            const TileEntry *ahead = &tile->entry[i + AHEAD];
            __builtin_prefetch(&tile->splats[ahead->splat]);
            if (records) {
                __builtin_prefetch(records + (size_t)ahead->slot * FS_RECORD, 1);
                __builtin_prefetch(records + (size_t)ahead->slot * FS_RECORD + FS_RECORD - 1, 1);
            }
        }
        const uint32_t mask = steps_of(tile->entry[i].mask, rows) & alive;
        if (mask) {
            make_ready(tile, &tile->splats[tile->entry[i].splat], &batch->splat[batch->n]);
            if (records) batch->splat[batch->n].slot = tile->entry[i].slot; // they are still written while forward runs
            batch->mask[batch->n++] = mask;
        } else if (records) {
            memset(records + (size_t)tile->entry[i].slot * FS_RECORD, 0, sizeof(float) * FS_RECORD);
        }
    }
}

// ---- forward: step by step ----
// A step's colours and transmittance stay in registers while all splats of a batch that touch it pass.

typedef struct Forward {
    const RasterTile *tile;
    const Batch *batch;
    uint64_t list[PAIRS]; // of each step: bit k, entry k of the batch touches it
    float *feature, *transmittance;
    long pairs;
} Forward;
_Static_assert(BATCH == 64, "a bit for each entry of a batch");

INLINE void fill_lists(Batch *batch, uint64_t list[PAIRS])
{
    for (int k = batch->n; k < BATCH; k++) batch->mask[k] = 0;
    memset(list, 0, sizeof *list * PAIRS);
    for (int k = 0; k < batch->n; k += VW) {
        vi mask;
        memcpy(&mask, batch->mask + k, sizeof mask);
        for (int s = 0; s < PAIRS; s++) list[s] |= (uint64_t)signs_of(v_shift_left(mask, 31 - 2 * s)) << k;
    }
}

INLINE vf alpha_at(const Batched *s, int v, vf y, vf t_min) // 0 where t < t_min; not clamped
{
    const vf t = v_fma(v_fma(v_set(s->c), y, s->t1[v]), y, s->t0[v]);
    return v_where(v_le(t_min, t), exp2_fast(t));
}

// Two rows of pixels through their list; returns whether any is still open.
INLINE bool forward_pair(Forward *f, int step, const int nf, const bool count, const bool median)
{
    const Batched *splat = f->batch->splat;
    float *feature = f->feature + 2 * FS_TILE_W * step, *transmittance = f->transmittance + 2 * FS_TILE_W * step;
    const vf t_min = v_set(f->tile->t_min), T_min = v_set(f->tile->transmittance_min), most = v_set(FS_ALPHA_MAX);
    const vf half = v_set(0.5f);
    vf T[PAIR_VECTORS], sum[FS_FEATURES_MAX][PAIR_VECTORS], y[PAIR_VECTORS], ready[BATCH][PAIR_VECTORS];
    vm open[PAIR_VECTORS], any = v_lt(v_set(0), v_set(0));
    vi n_pairs = v_seti(0);
    for (int v = 0; v < PAIR_VECTORS; v++) {
        T[v] = v_load(transmittance + v * VW);
        for (int k = 0; k < nf; k++) sum[k][v] = v_load(feature + k * FS_TILE_PIXELS + v * VW);
        y[v] = lane_y(step * (2 / STEP_ROWS) + v / STEP_VECTORS);
        open[v] = v_le(T_min, T[v]);
        any = vm_or(any, open[v]);
    }
    int i = 0;
    for (uint64_t list = f->list[step]; ALPHAS_FIRST && list; list &= list - 1, i++)
        for (int v = 0; v < PAIR_VECTORS; v++)
            ready[i][v] = v_min(alpha_at(&splat[__builtin_ctzll(list)], v % STEP_VECTORS, y[v], t_min), most);
    i = 0;
    for (uint64_t list = f->list[step]; list && vm_any(any); list &= list - 1, i++) {
        const Batched *s = &splat[__builtin_ctzll(list)];
        for (int v = 0; v < PAIR_VECTORS; v++) {
            vf alpha = ALPHAS_FIRST ? ready[i][v] : v_min(alpha_at(s, v % STEP_VECTORS, y[v], t_min), most);
            vf w = v_where(open[v], alpha * T[v]);
            const vm falls = vm_and(v_le(half, T[v]), v_lt(T[v] - w, half));
            const vf last = median ? v_where(falls, v_set(1)) : w;
            for (int k = 0; k < nf; k++) sum[k][v] = v_fma(k == nf - 1 ? last : w, v_set(s->feature[k]), sum[k][v]);
            if (count) n_pairs = count_lanes(n_pairs, vm_and(v_lt(v_set(0), alpha), open[v]));
            T[v] = T[v] - w;
            open[v] = v_le(T_min, T[v]);
            any = v ? vm_or(any, open[v]) : open[v];
        }
    }
    for (int v = 0; v < PAIR_VECTORS; v++) {
        v_store(transmittance + v * VW, T[v]);
        for (int k = 0; k < nf; k++) v_store(feature + k * FS_TILE_PIXELS + v * VW, sum[k][v]);
    }
    for (int l = 0; count && l < VW; l++) f->pairs += n_pairs[l];
    return vm_any(any);
}

INLINE long forward_n(const RasterTile *tile, float *feature, float *transmittance, const int nf, const bool count,
                      const bool median)
{
    Batch batch;
    Forward f = {.tile = tile, .batch = &batch, .feature = feature, .transmittance = transmittance};
    for (int p = 0; p < FS_TILE_PIXELS; p++) transmittance[p] = 1;
    memset(feature, 0, sizeof(float) * FS_TILE_PIXELS * (size_t)nf);
    uint32_t alive = steps_of(0xffffffffu, 2);
    for (batch.next = 0; batch.next < tile->n && alive;) {
        fill_batch(tile, alive, 2, BATCH, &batch, NULL);
        fill_lists(&batch, f.list);
        for (int s = 0; s < PAIRS; s++)
            if (f.list[s] && !forward_pair(&f, s, nf, count, median)) alive &= ~(1u << (2 * s));
    }
    return f.pairs;
}

INLINE long forward_of(const RasterTile *tile, float *feature, float *transmittance, const int nf)
{
    if (tile->median) {
        long pairs = forward_n(tile, feature, transmittance, nf, true, true);
        return tile->count ? pairs : 0;
    }
    return tile->count ? forward_n(tile, feature, transmittance, nf, true, false)
                       : forward_n(tile, feature, transmittance, nf, false, false);
}

static long forward(const RasterTile *tile, float *feature, float *transmittance)
{
    switch (tile->features) {
    case 1: return forward_of(tile, feature, transmittance, 1);
    case 2: return forward_of(tile, feature, transmittance, 2);
    case 3: return forward_of(tile, feature, transmittance, 3);
    default: return forward_of(tile, feature, transmittance, 4);
    }
}

// ---- backward: splat by splat ----

typedef struct Pixels { // of one vector
    vf T, behind, d[FS_FEATURES_MAX];
} Pixels;

INLINE void fill_pixels(const float *feature, const float *transmittance, const float *d_feature,
                        const float *d_transmittance, Pixels *pixels, const int nf)
{
    for (int i = 0; i < STEPS * STEP_VECTORS; i++) {
        const int p = i * VW;
        vf s = d_transmittance ? v_load(d_transmittance + p) * v_load(transmittance + p) : v_set(0);
        for (int k = 0; k < nf; k++) {
            pixels[i].d[k] = v_load(d_feature + k * FS_TILE_PIXELS + p);
            s = v_fma(pixels[i].d[k], v_load(feature + k * FS_TILE_PIXELS + p), s);
        }
        pixels[i].behind = s;
        pixels[i].T = v_set(1);
    }
}

typedef struct Reach { // of a splat
    const Batched *s;
    int first, last; // steps
} Reach;

typedef struct Falloff { // alpha, 0 where t < t_min, and -alpha / (1 - alpha)
    vf alpha, odds;
} Falloff;

INLINE Falloff falloff_at(const Batched *s, int v, vf y, vf t_min, const bool clamp)
{
    vf alpha = alpha_at(s, v, y, t_min);
    if (clamp) alpha = v_min(alpha, v_set(FS_ALPHA_MAX));
    return (Falloff){alpha, odds_of(alpha)};
}

// One splat over the pixels of the steps in its reach, of each step vector v: adds to the record's sums. Returns the
// steps that turned out to be closed. The moments in y need no multiplication in the loop: with j = 1 for the last
// step, 2 for the one before it, ..., sums of sums are sum d t, sum j d t, sum j (j + 1) / 2 d t.
INLINE uint32_t backward_vectors(const RasterTile *tile, Reach reach, int v, Pixels *pixels, vf sum[FS_RECORD],
                                 const int nf, const bool clamp)
{
    const Batched *s = reach.s;
    const int first = reach.first, last = reach.last;
    const vf t_min = v_set(tile->t_min), T_min = v_set(tile->transmittance_min);
    vf f[FS_FEATURES_MAX], d_f[FS_FEATURES_MAX];
    for (int k = 0; k < nf; k++) {
        f[k] = v_set(s->feature[k]);
        d_f[k] = v ? sum[6 + k] : v_set(0);
    }
    Falloff ready[STEPS];
    vf y = lane_y(first);
    for (int step = first; ALPHAS_FIRST && step <= last; step++, y = y + v_set(STEP_ROWS))
        ready[step] = falloff_at(s, v, y, t_min, clamp);
    uint32_t closed = 0;
    vf n0 = v_set(0), n1 = n0, n2 = n0;
    for (int step = first; step <= last; step++, y = y + v_set(STEP_ROWS)) {
        Pixels *p = &pixels[step * STEP_VECTORS + v];
        const vf T = p->T;
        const vm open = v_le(T_min, T);
        if (vm_any(open)) {
            const Falloff e = ALPHAS_FIRST ? ready[step] : falloff_at(s, v, y, t_min, clamp);
            vf w = v_where(open, e.alpha * T), g = p->d[0] * f[0];
            for (int k = 1; k < nf; k++) g = v_fma(p->d[k], f[k], g);
            for (int k = 0; k < nf; k++) d_f[k] = v_fma(w, p->d[k], d_f[k]);
            g = w * g;
            vf rest = p->behind - g;
            vf d_t = v_where(clamp ? vm_and(open, v_lt(e.alpha, v_set(FS_ALPHA_MAX))) : open, v_fma(e.odds, rest, g));
            p->behind = rest;
            p->T = T - w;
            n0 = n0 + d_t;
        } else {
            closed |= 1u << (step * STEP_ROWS);
        }
        n1 = n1 + n0;
        n2 = n2 + n1;
    }
    const vf h = v_set(STEP_ROWS), ln2 = v_set(0.69314718f);
    n0 = n0 * ln2;
    n1 = n1 * (h * ln2);
    n2 = n2 * (2 * h * h * ln2);
    const vf dy = lane_y(last + 1) - v_set(s->my), dx = lane_x(v) - v_set(s->mx), gx = n0 * dx;
    vf gy = v_fma(dy, n0, v_set(0) - n1);
    const vf m[6] = {n0, gx, gy, gx * dx, gy * dx, v_fma(dy, gy - n1, n2 - h * n1)};
    for (int k = 0; k < 6; k++) sum[k] = v ? sum[k] + m[k] : m[k];
    for (int k = 0; k < nf; k++) sum[6 + k] = d_f[k];
    return closed;
}

INLINE void backward_n(const RasterTile *tile, const float *feature, const float *transmittance, const float *d_feature,
                       const float *d_transmittance, float *records, const int nf)
{
    Pixels pixels[STEPS * STEP_VECTORS];
    Batch batch;
    vf sums[BACKWARD_BATCH][FS_RECORD];
    memset(sums, 0, sizeof sums);
    fill_pixels(feature, transmittance, d_feature, d_transmittance, pixels, nf);
    uint32_t alive = steps_of(0xffffffffu, STEP_ROWS);
    for (batch.next = 0; batch.next < tile->n;) {
        fill_batch(tile, alive, STEP_ROWS, BACKWARD_BATCH, &batch, records);
        for (int i = 0; i < batch.n; i++) {
            const Batched *s = &batch.splat[i];
            const uint32_t steps = batch.mask[i] & alive;
            if (!steps) {
                memset(sums[i], 0, sizeof sums[i]);
                continue;
            }
            const Reach reach = {s, __builtin_ctz(steps) / STEP_ROWS, (31 - __builtin_clz(steps)) / STEP_ROWS};
            uint32_t closed = steps;
            for (int v = 0; v < STEP_VECTORS; v++)
                closed &= s->clamped ? backward_vectors(tile, reach, v, pixels, sums[i], nf, true)
                                     : backward_vectors(tile, reach, v, pixels, sums[i], nf, false);
            alive &= ~closed;
        }
        for (int i = 0; i < batch.n; i++) sum_record(sums[i], records + (size_t)batch.splat[i].slot * FS_RECORD);
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
