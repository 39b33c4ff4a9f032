// A separated scene: the clouds of the four layers, or radiance fields, and what ties them together. Layout on disk,
// both of OUT/start (before training) and OUT/clouds (after): <layer>.ply per cloud or field.bin, veil.tif where there
// is one, and model.json.
#pragma once

#include "base/linalg.h"
#include "base/optics.h"
#include "model/cloud.h"
#include "model/layers.h"
#include "model/radiance.h"
#include "model/pane_veil.h"
#include "model/settings.h"

// The pane. Both its surfaces lumped, its reflectance follows Schlick's form of Fresnel's law for glass,
//   beta(ray) = f0 rho(ray),   rho = 1 + 22 (1 - |normal . ray|)^5,   dimming rho at most FS_OPTICS_MOST,
// and what it lets through, in units of normal incidence, tau(ray) = (1 - dimming rho) / (1 - dimming).
// Both are the reflectance at normal incidence: f0 is only a unit of R's brightness (beta R is what photos show), while
// dimming is seen in how T darkens towards grazing rays. At the end of training they are made equal.
typedef struct Pane {
    double normal[3]; // unit, world
    double f0, dimming;
} Pane;

// beta and tau of a ray whose cosine with the normal is given.
static inline double fs_pane_rho(double cosine)
{
    double u = 1 - (cosine < 0 ? -cosine : cosine), u2 = u * u;
    return 1 + FS_OPTICS_GRAZING * u2 * u2 * u;
}
static inline double fs_pane_beta(const Pane *pane, double cosine)
{
    double rho = fs_pane_rho(cosine);
    return pane->f0 * (pane->dimming * rho < FS_OPTICS_MOST ? rho : FS_OPTICS_MOST / pane->dimming);
}
// beta of the ray from a place to a point.
static inline double fs_pane_beta_towards(const Pane *pane, const double from[3], const float to[3])
{
    const double ray[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]}, length2 = v3_dot(ray, ray);
    return fs_pane_beta(pane, length2 > 0 ? fmin(fabs(v3_dot(ray, pane->normal)) / sqrt(length2), 1) : 1);
}

// What is told apart: everything, or less for comparisons, which have one T and so shared geometry.
typedef enum Separation {
    SEPARATION_FULL,
    SEPARATION_FLASHLESS, // T_F is T_N: one T for all photos
    SEPARATION_LINEAR,    // T_F = c T_N, one constant per channel (gain_color); gains are 0 and nothing falls off
    SEPARATION_NONE,      // T holds the photos as they are; there is no R, no beta, and the pane does nothing
    SEPARATIONS
} Separation;
extern const char *const fs_scene_separations[SEPARATIONS]; // as the setting names them

typedef struct Scene {
    Separation separation;
    bool shared_geometry; // T_F has no cloud: it is T_N's Gaussians, brightened by gains and distance to the flash
    bool pane_beta;       // beta has no cloud: it follows `pane`
    Cloud cloud[LAYERS];  // n = 0 where a layer has no cloud of its own
    Radiance field;       // in place of clouds; then geometry is shared and beta a field
    Pane pane;
    double gain_color[3];   // shared geometry: alpha_c = gain_color[c] * exp(gain) * (flash_distance / distance)^2
    double flash_distance;  // world units; distance at which the falloff is 1
    double extent;          // fs_camera_extent of the cameras, and some, world units (learning rates, pruning)
    double metres_per_unit; // 0 when unknown
    double flash_return;    // shared geometry behind a pane: flash light that comes back by the mirrored room brightens
                            // R like T, with gain_color times this and no gains
    double rare;            // log of the odds by which mirrored points were held for rare (DepthOdds): above 0 where
                            // little is mirrored
    // The camera's, where they were learned (kernels/calibration.h); renders are without them. 0: none.
    double vignetting[FS_OPTICS_VIGNETTING], response[FS_OPTICS_KNOTS];
    Veil veil; // of a scene that is lit; renders are without it
} Scene;

void fs_scene_free(Scene *scene);
// What OUT/start and OUT/clouds hold (project.h): clouds or field, model.json, the veil. Reading checks all of it.
int fs_scene_write(const Scene *scene, const char *dir, FsError *err);
int fs_scene_read(Scene *scene, const char *dir, FsError *err);
// Light that a response (kernels/calibration.h; FS_OPTICS_KNOTS) brings to the photos' white, at least 1: scenes hold
// highlights as bright as that, which a camera's curve has pressed together.
float fs_scene_white(const double response[]);
// Multiplies the light of the clouds and the veil; nothing of a radiance field.
void fs_scene_lift(Scene *scene, double factor);
int fs_scene_copy(Scene *to, const Scene *from, FsError *err);
// What training found of each photo (OUT/clouds/photos.json), to be released; NULL: there is none, as beside fields and
// given clouds.
struct json_t;
int fs_scene_photos(const char *out, struct json_t **photos, FsError *err);
Separation fs_scene_separation(const char *name); // SEPARATIONS when there is none of that name
// Sets separation, shared_geometry and pane_beta as settings ask for them.
void fs_scene_set_kind(Scene *scene, const Settings *set);

// T_F is T_N's Gaussians brightened by the flash, and not just T_N.
static inline bool fs_scene_lit(const Scene *scene)
{
    return scene->shared_geometry && !fs_radiance_is(&scene->field) &&
           (scene->separation == SEPARATION_FULL || scene->separation == SEPARATION_LINEAR);
}
