// What the faults of --field come to in a capture: its lens and its camera's ways, and each photo's own values.
#pragma once

#include "model/lens.h"
#include "synth/path.h"
#include "synth/photo_file.h"
#include "synth/style.h"
#include "synth/trace.h"

typedef struct PhotoNuisance {
    float gain_flash, gain_behind, gain_room; // of the flash's power, of the light behind the pane and of the room's
    float ambient, flash;                     // what shutter, aperture and ISO make of both lights, of the usual
    Exposure exposure;                        // what the camera says
    float blur_px, blur_degrees;              // smear of what the ambient light shows
    float focus_m;                            // distance that is sharp; 0: all are
    Figure figure[2];                         // who stands in the mirrored room
    float flash_px[3]; // x, y, radius of the flash's mirror image, in the photo or beside it; radius 0: behind the camera
    double clipped;    // share of the sensor's pixels that are full
} PhotoNuisance;

typedef struct Nuisance {
    Field field;
    float vignetting[3]; // light kept: 1 + [0] r^2 + [1] r^4 + [2] r^6, r = 1 in the corner
    Lens lens;           // width 0: none
    float aperture;      // the opening's radius, metres; 0: a pinhole
    CameraStyle style;
    Vec tint;  // of the pane
    float gap; // to a second one, metres
    uint32_t dirt_seed;
    PhotoNuisance *photo; // (n)
    int n;
} Nuisance;

// shot: those of the spec's photos. The same numbers for the same seed.
int fs_nuisance_draw(Nuisance *nuisance, const Spec *spec, const Layout *layout, const Shot *shot, FsError *err);
void fs_nuisance_free(Nuisance *nuisance);
// How light gets to the photo's sensor where that needs tracing; NULL: as a pinhole camera sees it.
const Optics *fs_nuisance_optics(const Nuisance *nuisance, int photo, Optics *optics);
// The sum of a photo's layers as its sensor gets it: gains, shake, vignetting.
int fs_nuisance_gather(const Nuisance *nuisance, int photo, bool flash, const Traced *traced, Image *light,
                       FsError *err);
// <dir>/nuisance.json
int fs_nuisance_write(const Nuisance *nuisance, const char *dir, const char *scene, const Shot *shot, unsigned seed,
                      FsError *err);
