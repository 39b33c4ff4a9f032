// A separated scene: the clouds of the four layers and what ties them together. Layout on disk, both of OUT/start
// (before training) and OUT/clouds (after): <layer>.ply per cloud and model.json.
#ifndef FS_MODEL_SCENE_H
#define FS_MODEL_SCENE_H

#include "model/cloud.h"
#include "model/layers.h"

// Reflectance of the pane as Schlick's form of Fresnel's law: beta(ray) = f0 + (1 - f0) (1 - |normal . ray|)^5.
typedef struct Pane {
    double normal[3]; // unit, world
    double f0;        // at normal incidence
} Pane;

typedef struct Scene {
    bool shared_geometry; // T_F has no cloud: it is T_N's Gaussians, brightened by gains and distance to the flash
    bool pane_beta;       // beta has no cloud: it follows `pane`
    Cloud cloud[LAYERS];  // n = 0 where a layer has no cloud of its own
    Pane pane;
    double gain_color[3];  // shared geometry: alpha_c = gain_color[c] * exp(gain) * (flash_distance / distance)^2
    double flash_distance; // world units; distance at which the falloff is 1
    double extent;         // radius of the cameras' centres around their mean, world units (learning rates, pruning)
    double metres_per_unit; // 0 when unknown
} Scene;

void fs_scene_free(Scene *scene);
int fs_scene_write(const Scene *scene, const char *dir, FsError *err);
int fs_scene_read(Scene *scene, const char *dir, FsError *err);

#endif
