// Accuracy of the vector functions of simd.h against libm in double.
#include "check.h"
#include "vmath.h"

enum { N = 1 << 16 };
static float x[N], y[N];

static const Vmath *at(CpuLevel level)
{
    switch (level) {
#if defined(__x86_64__)
    case CPU_AVX2: return &vmath_avx2;
    case CPU_AVX512: return &vmath_avx512;
#elif defined(__aarch64__)
    case CPU_NEON: return &vmath_neon;
#endif
    default: return NULL;
    }
}

static double worst(double (*f)(double), double floor)
{
    double most = 0;
    for (int i = 0; i < N; i++) {
        double want = f(x[i]), e = fabs(y[i] - want) / (fabs(want) + floor);
        if (!(e <= most)) most = e;
    }
    return most;
}
static double power(double v)
{
    return pow(v, (double)(1 / 0.22f));
}
static double gamma_of(double v)
{
    return pow(v, (double)0.22f);
}

static void check_level(CpuLevel level, const Vmath *k)
{
    const char *name = fs_cpu_name(level);
    CHECK(k->words() == 0, "%s: word %d", name, k->words());
    for (int i = 0; i < N; i++) x[i] = -87 + 175 * (float)i / N;
    k->exp(x, y, N);
    double e = worst(exp, 0);
    CHECK(e < 2e-7, "%s exp: %g", name, e);
    for (int i = 0; i < N; i++) x[i] = expf(-80 + 160 * (float)i / N);
    k->log(x, y, N);
    e = worst(log, 0);
    CHECK(e < 3e-7, "%s log: %g", name, e);
    for (int i = 0; i < N; i++) x[i] = 0.5f + 1.5f * (float)i / N; // near 1
    k->log(x, y, N);
    e = worst(log, 1e-30);
    CHECK(e < 3e-7, "%s log near 1: %g", name, e);
    for (int i = 0; i < N; i++) x[i] = 0.03f + 1.2f * (float)i / N;
    k->pow(x, 1 / 0.22f, y, N);
    e = worst(power, 0);
    CHECK(e < 2e-6, "%s pow 1/0.22: %g", name, e);
    for (int i = 0; i < N; i++) x[i] = 1e-7f + 2 * (float)i / N;
    k->pow(x, 0.22f, y, N);
    e = worst(gamma_of, 0);
    CHECK(e < 1e-6, "%s pow 0.22: %g", name, e);
    float edge[16] = {-1000, -88, 1000, 88.5f}, out[16];
    k->exp(edge, out, 16);
    for (int i = 0; i < 4; i++)
        CHECK(isfinite(out[i]) && out[i] >= 0, "%s exp(%g) = %g", name, (double)edge[i], (double)out[i]);
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    CHECK(fs_cpu_has(CPU_SCALAR), "scalar is everywhere");
    FOR_LEVELS(level)
    {
        if (at(level)) check_level(level, at(level));
    }
    return check_end();
}
