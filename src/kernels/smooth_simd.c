// Written once for AVX2, AVX-512 and NEON; see simd.h.
//
// Every pair's exponential is taken once: the slopes of the pairs from a row to the next are kept until the next row
// has used them. Works through blocks of columns, so that these rows live on the stack.
#include "kernels/smooth.h"
#include "kernels/simd.h"

enum { BLOCK = 256, PAD = 32, PITCH = BLOCK + 2 * PAD, RIGHT = 0, DOWN, FALLING, RISING, PAIRS };

typedef struct Block {
    int x0, n;                    // columns x0 .. x0 + n - 1
    float u[2][PITCH];            // map rows y and y + 1 (slot y & 1), column x0 at PAD
    float slope[2][PAIRS][PITCH]; // scaled slopes of the pairs that start at rows y - 1 and y
} Block;

// Columns x0 - PAD .. x0 + BLOCK + PAD - 1 of a row; 0 outside the map.
INLINE void load_row(Block *b, const Planes *map, int y)
{
    float *to = b->u[y & 1];
    int first = b->x0 - PAD < 0 ? 0 : b->x0 - PAD, end = b->x0 + BLOCK + PAD;
    if (end > map->width) end = map->width;
    memset(to, 0, sizeof b->u[0]);
    memcpy(to + (first - (b->x0 - PAD)), fs_planes_row(map, 0, y) + first, (size_t)(end - first) * sizeof(float));
}

// f and f' of a difference; lanes outside `lanes` give 0.
INLINE vf pair_v(vf d, vf minus_1_g, vf scale, vm lanes, vf *slope)
{
    vf t = v_abs(d), z = t * minus_1_g, w = v_where(lanes, scale * v_exp(z)), s = v_fma(w, z, w);
    vi sign = (vi)d & v_seti((int32_t)0x80000000);
    *slope = v_where(v_lt(v_set(0), t), (vf)((vi)s ^ sign));
    return t * w;
}

// Slopes and sum of the pairs that start in row y, columns x0 - 1 .. x0 + n; the sum counts x0 .. x0 + n - 1.
INLINE float pairs_of_row(Block *b, const SmoothArgs *args, SmoothScales scales, int y)
{
    int width = args->map->width, down = y + 1 < args->map->height;
    const float *u = b->u[y & 1] + PAD, *below = b->u[(y + 1) & 1] + PAD;
    vf minus_1_g = v_set(-1 / args->g), sum = v_set(0), slope;
    for (int i = -VW; i < b->n + VW; i += VW) {
        float(*out)[PITCH] = b->slope[y & 1];
        int x = b->x0 + i; // of lane 0
        vm inside = vm_andnot(vm_first(width - x), vm_first(-x));
        vm has_right = vm_andnot(vm_first(width - 1 - x), vm_first(-x));
        vm has_left = vm_andnot(vm_first(width - x), vm_first(1 - x));
        vf here = v_load(u + i);
        vf value = pair_v(here - v_load(u + i + 1), minus_1_g, v_set(scales.right), has_right, &slope);
        v_store(out[RIGHT] + PAD + i, slope);
        if (down) {
            value += pair_v(here - v_load(below + i), minus_1_g, v_set(scales.down), inside, &slope);
            v_store(out[DOWN] + PAD + i, slope);
            value += pair_v(here - v_load(below + i + 1), minus_1_g, v_set(scales.diagonal), has_right, &slope);
            v_store(out[FALLING] + PAD + i, slope);
            value += pair_v(here - v_load(below + i - 1), minus_1_g, v_set(scales.diagonal), has_left, &slope);
            v_store(out[RISING] + PAD + i, slope);
        }
        if (i >= 0 && i < b->n) sum += v_where(vm_first(b->n - i), value);
    }
    if (!down) memset(b->slope[y & 1][DOWN], 0, 3 * sizeof b->slope[0][0]);
    return v_sum(sum);
}

INLINE void gather_row(const Block *b, const SmoothArgs *args, int y)
{
    const float(*at)[PITCH] = b->slope[y & 1], (*above)[PITCH] = b->slope[(y + 1) & 1];
    float *d_map = fs_planes_row(args->d_map, 0, y) + b->x0;
    for (int i = 0; i < b->n; i += VW) {
        int p = PAD + i;
        vf g = v_load(at[RIGHT] + p) - v_load(at[RIGHT] + p - 1) + v_load(at[DOWN] + p) - v_load(above[DOWN] + p) +
               v_load(at[FALLING] + p) - v_load(above[FALLING] + p - 1) + v_load(at[RISING] + p) -
               v_load(above[RISING] + p + 1);
        v_store(d_map + i, v_fma(v_set(args->weight), v_where(vm_first(b->n - i), g), v_load(d_map + i)));
    }
}

static double loss(const SmoothArgs *args, int y0, int y1)
{
    const Planes *map = args->map;
    SmoothScales scales = fs_smooth_scales(map->width, map->height);
    Block b;
    double sum = 0;
    for (b.x0 = 0; b.x0 < map->width; b.x0 += BLOCK) {
        b.n = map->width - b.x0 < BLOCK ? map->width - b.x0 : BLOCK;
        load_row(&b, map, y0);
        if (y0 > 0) { // the pairs from above
            load_row(&b, map, y0 - 1);
            pairs_of_row(&b, args, scales, y0 - 1);
        } else {
            memset(b.slope[1], 0, sizeof b.slope[1]);
        }
        for (int y = y0; y < y1; y++) {
            if (y + 1 < map->height) load_row(&b, map, y + 1);
            sum += pairs_of_row(&b, args, scales, y);
            if (args->d_map) gather_row(&b, args, y);
        }
    }
    return sum;
}

#include "kernels/smooth_guided.h"

const SmoothKernels FS_SIMD_SUFFIX(fs_smooth) = {loss, guided};
