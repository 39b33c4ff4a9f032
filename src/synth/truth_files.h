// The truth folder of a capture: cameras, and the layers of some views.
#pragma once

#include "synth/trace.h"

// <dir>/cameras.json, <dir>/sparse and the layers' folders; disturbed: the poses of sparse carry the usual error of
// structure-from-motion.
int fs_truth_files_cameras(const char *dir, const char *scene, const Shot *shot, int n, const Spec *spec, FsError *err);
// The photos and held-out views as a COLMAP text model: <dir>/sparse of ideal cameras, <dir>/sparse_opencv with a lens.
int fs_truth_files_sparse(const char *dir, const Shot *shot, int n, const Spec *spec, const Lens *lens, FsError *err);
// T_N, T_F, R of a view; I_N and I_F too where it is held out.
int fs_truth_files_layers(const char *dir, const Shot *shot, const Traced *traced, FsError *err);
// <dir>/figures: white where a photo shows people in the mirrored room.
int fs_truth_files_mask(const char *dir, const Shot *shot, const Image *mask, FsError *err);
int fs_truth_files_geometry(const char *dir, const Shot *shot, const Geometry *geometry, FsError *err);
