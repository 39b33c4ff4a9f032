// All kernel tables of one instruction set.
#ifndef FS_KERNELS_KERNELS_H
#define FS_KERNELS_KERNELS_H

#include "base/cpu.h"
#include "kernels/adam.h"
#include "kernels/calibration.h"
#include "kernels/compose.h"
#include "kernels/gain.h"
#include "kernels/hashgrid.h"
#include "kernels/mlp.h"
#include "kernels/occlusion.h"
#include "kernels/pane.h"
#include "kernels/pearson.h"
#include "kernels/photometric.h"
#include "kernels/pixelwise.h"
#include "kernels/projection.h"
#include "kernels/raster.h"
#include "kernels/regularise.h"
#include "kernels/shade.h"
#include "kernels/smooth.h"
#include "kernels/veil.h"
#include "kernels/volume.h"

typedef struct Kernels {
    CpuLevel level;
    const ComposeKernels *compose;
    const PhotometricKernels *photometric;
    const PearsonKernels *pearson;
    const SmoothKernels *smooth;
    const AdamKernels *adam;
    const ProjectKernels *project;
    const RasterKernels *raster;
    const ShadeKernels *shade;
    const PaneKernels *pane;
    const RegulariseKernels *regularise;
    const PixelwiseKernels *pixelwise;
    const GainKernels *gain;
    const CalibrationKernels *calibration;
    const OcclusionKernels *occlusion;
    const HashgridKernels *hashgrid;
    const MlpKernels *mlp;
    const VeilKernels *veil;
    const VolumeKernels *volume;
} Kernels;

// The tables of the setting "cpu" ("best" or a level's name); an error when this machine lacks it.
int fs_kernels_choose(const char *cpu, Kernels *kernels, FsError *err);
Kernels fs_kernels_at(CpuLevel level); // the level must be one this machine has (fs_cpu_has)

#endif
