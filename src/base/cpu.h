// Instruction sets of this machine.
#pragma once

#include "base/error.h"

typedef enum CpuLevel { CPU_SCALAR, CPU_AVX2, CPU_AVX512, CPU_NEON, CPU_LEVELS } CpuLevel;

CpuLevel fs_cpu_best(void);              // the highest that this machine has
const char *fs_cpu_name(CpuLevel level); // "scalar", "avx2", ...
bool fs_cpu_has(CpuLevel level);
// From the setting "cpu": "best" or a level's name; an error when this machine lacks it.
int fs_cpu_choose(const char *name, CpuLevel *level, FsError *err);
