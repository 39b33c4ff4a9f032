// From a scene and a camera to the layers of a view: T without and with flash, R likewise.
#pragma once

#include "base/threads.h"
#include "image/image.h"
#include "model/lens.h"
#include "synth/figure.h"
#include "synth/path.h"

// How bright everything is; found by fs_trace_balance.
typedef struct Lighting {
    float behind, room; // scale of the baked ambient light of both worlds
    float flash;        // radiant intensity of the flash
    float even;         // flash light after many bounces behind the pane, as a share of the ambient light there
    float flash_back;   // of the flash's mirror image, as the room sees it
    float even_back;    // flash light that fills the room after many bounces, as a share of its ambient light
    float refraction;   // index that gives the pane its reflectance
} Lighting;

// Layers of a view, linear; any may be left out (px NULL).
typedef enum TraceLayer { TRACE_T_N, TRACE_T_F, TRACE_R_N, TRACE_R_F, TRACE_LAYERS } TraceLayer;
typedef struct Traced {
    Image layer[TRACE_LAYERS];
} Traced;
void fs_trace_free(Traced *traced);

// Fixes the lighting so that the spec's flash gain, mirrored share and flash return hold on average over the photos
// and the no-flash photos come out well exposed.
int fs_trace_balance(const Layout *layout, const Spec *spec, const Shot *shot, Threads *threads, Lighting *lighting,
                     FsError *err);
// What a photo sees otherwise than a pinhole camera.
typedef struct Optics {
    Lens lens;      // width 0: none
    float aperture; // the opening's radius, metres
    float focus;    // distance along the axis that is sharp, metres
    Figure figure[2];
    int n_figures;
    float dirt; // share of the pane that it covers
    uint32_t dirt_seed;
} Optics;
typedef struct TraceRequest {
    const Camera *camera;
    const Optics *optics; // NULL: a pinhole camera
    unsigned want;        // bit mask of 1 << TraceLayer
    int number;           // tells views apart: random numbers depend on it
} TraceRequest;
// The layers that the request wants; the caller's (fs_trace_free).
int fs_trace_view(const Layout *layout, const Spec *spec, const Lighting *lighting, TraceRequest request,
                  Threads *threads, Traced *traced, FsError *err);
// 1 where a photo shows one of the figures, at pixel centres.
int fs_trace_figures(const Layout *layout, TraceRequest request, Threads *threads, Image *mask, FsError *err);
// Where the pane mirrors the flash to.
Vec fs_trace_mirrored_flash(const Layout *layout, const Camera *camera);
// At pixel centres.
typedef struct Geometry {
    Image depth_T, depth_R; // z-depth, metres, 0: none; of the mirrored scene where one sees it, behind the pane
    Image beta;             // reflectance of the pane
} Geometry;
int fs_trace_geometry(const Layout *layout, const Lighting *lighting, const Camera *camera, Threads *threads,
                      Geometry *geometry, FsError *err);
void fs_trace_geometry_free(Geometry *geometry);
