#include "base/cpu.h"

#include <string.h>

static const char *const names[CPU_LEVELS] = {"scalar", "avx2", "avx512", "neon"};

const char *fs_cpu_name(CpuLevel level)
{
    return names[level];
}

bool fs_cpu_has(CpuLevel level)
{
    switch (level) {
    case CPU_SCALAR: return true;
#if defined(__x86_64__)
    case CPU_AVX2: return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    case CPU_AVX512:
        return fs_cpu_has(CPU_AVX2) && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
#elif defined(__aarch64__)
    case CPU_NEON: return true;
#endif
    default: return false;
    }
}

CpuLevel fs_cpu_best(void)
{
    CpuLevel best = CPU_SCALAR;
    for (int i = 0; i < CPU_LEVELS; i++)
        if (fs_cpu_has((CpuLevel)i)) best = (CpuLevel)i;
    return best;
}

int fs_cpu_choose(const char *name, CpuLevel *level, FsError *err)
{
    *level = fs_cpu_best();
    if (!name || !*name || strcmp(name, "best") == 0) return 0;
    for (int i = 0; i < CPU_LEVELS; i++)
        if (strcmp(name, names[i]) == 0) {
            *level = (CpuLevel)i;
            if (fs_cpu_has(*level)) return 0;
            return fs_error_set(err, FS_ERR_USAGE, "--cpu %s: this machine has no %s (best: %s)", name, name,
                                names[fs_cpu_best()]);
        }
    return fs_error_set(err, FS_ERR_USAGE, "--cpu %s: unknown; use best, scalar, avx2, avx512 or neon", name);
}
