#include "kernels/kernels.h"

// One row per instruction set: a new kernel adds one line here and one member to Kernels.
#define TABLES(isa)                                                                                                    \
    .compose = &fs_compose_##isa, .photometric = &fs_photometric_##isa, .pearson = &fs_pearson_##isa,                  \
    .smooth = &fs_smooth_##isa, .adam = &fs_adam_##isa, .project = &fs_project_##isa, .raster = &fs_raster_##isa,      \
    .shade = &fs_shade_##isa, .pane = &fs_pane_##isa, .regularise = &fs_regularise_##isa,                              \
    .pixelwise = &fs_pixelwise_##isa, .gain = &fs_gain_##isa, .calibration = &fs_calibration_##isa,                    \
    .occlusion = &fs_occlusion_##isa, .hashgrid = &fs_hashgrid_##isa, .mlp = &fs_mlp_##isa, .veil = &fs_veil_##isa,    \
    .volume = &fs_volume_##isa

static const Kernels tables[CPU_LEVELS] = {
    [CPU_SCALAR] = {.level = CPU_SCALAR, TABLES(scalar)},
#if defined(__x86_64__)
    [CPU_AVX2] = {.level = CPU_AVX2, TABLES(avx2)},
    [CPU_AVX512] = {.level = CPU_AVX512, TABLES(avx512)},
#elif defined(__aarch64__)
    [CPU_NEON] = {.level = CPU_NEON, TABLES(neon)},
#endif
};

Kernels fs_kernels_at(CpuLevel level)
{
    return tables[level];
}

int fs_kernels_choose(const char *cpu, Kernels *kernels, FsError *err)
{
    CpuLevel level;
    int rc = fs_cpu_choose(cpu, &level, err);
    if (rc < 0) return rc;
    *kernels = fs_kernels_at(level);
    return 0;
}
