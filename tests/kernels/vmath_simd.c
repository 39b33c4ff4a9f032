#include "kernels/simd.h"
#include "vmath.h"

static void exps(const float *x, float *out, int n)
{
    for (int i = 0; i < n; i += VW) v_store(out + i, v_exp(v_load(x + i)));
}
static void logs(const float *x, float *out, int n)
{
    for (int i = 0; i < n; i += VW) v_store(out + i, v_log(v_load(x + i)));
}
static void pows(const float *x, float exponent, float *out, int n)
{
    for (int i = 0; i < n; i += VW) v_store(out + i, v_pow(v_load(x + i), exponent));
}

// Lane i of the vector is i - 2.5.
static int words(void)
{
    float in[VW], out[VW];
    for (int i = 0; i < VW; i++) in[i] = (float)i - 2.5f;
    vf a = v_load(in), two = v_set(2);
    if (v_sum(a) != VW * (VW - 1) / 2 - 2.5f * VW) return 1;
    for (int n = -1; n <= VW + 1; n++) {
        int count = n < 0 ? 0 : n > VW ? VW : n;
        if (vm_bits(vm_first(n)) != (unsigned)((1ull << count) - 1)) return 2;
        if (vm_any(vm_first(n)) != (count > 0)) return 3;
    }
    unsigned all = (unsigned)((1ull << VW) - 1);
    if (vm_bits(v_lt(a, v_set(-1.5f))) != 1 || vm_bits(v_le(a, v_set(-1.5f))) != 3) return 4;
    if (vm_bits(vm_and(vm_first(3), vm_first(2))) != 3 || vm_bits(vm_or(vm_first(3), vm_first(2))) != 7) return 5;
    if (vm_bits(vm_andnot(vm_first(VW), vm_first(2))) != (all & ~3u)) return 6;
    v_store(out, v_sel(vm_first(2), two, a));
    for (int i = 0; i < VW; i++)
        if (out[i] != (i < 2 ? 2 : in[i])) return 7;
    v_store(out, v_where(vm_first(3), a));
    for (int i = 0; i < VW; i++)
        if (out[i] != (i < 3 ? in[i] : 0)) return 8;
    v_store(out, v_max(v_min(a, two), v_set(-1)));
    for (int i = 0; i < VW; i++)
        if (out[i] != (in[i] < -1 ? -1 : in[i] > 2 ? 2 : in[i])) return 9;
    v_store(out, v_copysign(two, a));
    for (int i = 0; i < VW; i++)
        if (out[i] != (in[i] < 0 ? -2 : 2)) return 10;
    v_store(out, v_sqrt(v_abs(a) * v_abs(a)) - v_abs(a) + v_fma(a, two, v_set(1)));
    for (int i = 0; i < VW; i++)
        if (out[i] != 2 * in[i] + 1) return 11;
    v_store(out, v_round(a + v_set(0.75f)) + v_from_int(v_to_int(a + v_set(0.25f))));
    for (int i = 0; i < VW; i++)
        if (out[i] != (float)(i - 2 + i - 2)) return 12;
    v_store(out, v_from_int(v_shift_right(v_shift_left(v_seti(-3), 4), 2)));
    for (int i = 0; i < VW; i++)
        if (out[i] != -12) return 13;
    return 0;
}

const Vmath FS_SIMD_SUFFIX(vmath) = {exps, logs, pows, words};
