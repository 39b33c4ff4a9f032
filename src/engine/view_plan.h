// What a view of a scene is made of: which clouds are rendered, by which light, with how many channels; and the pane as
// the camera sees it. Training, rendering and whatever else shows a scene ask here.
#ifndef FS_ENGINE_VIEW_PLAN_H
#define FS_ENGINE_VIEW_PLAN_H

#include "engine/engine.h"
#include "kernels/calibration.h"
#include "kernels/pane.h"
#include "kernels/shade.h"
#include "kernels/veil.h"
#include "model/camera.h"
#include "model/scene.h"

typedef struct PlanPart {
    bool there;         // else the view has no such part
    const Cloud *cloud; // NULL where it is of a radiance field:
    Volume volume;      // of this volume,
    int first;          // the channels from this one on
    Layer layer;        // whose cloud it is
    bool lit;           // colours are brightened by `light`
    ShadeLight light;
    int channels; // of its colours
} PlanPart;

// I = tau T + beta R (Flash-Splat, section 3).
typedef struct ViewPlan {
    PlanPart T, R;
    PlanPart beta;   // not there: beta and tau follow `pane`, or there is no R
    bool plain_beta; // beta's part is beta itself, else its logit
    bool pane_beta;
    bool covers; // T has some: nothing is mirrored before what they mark
    PaneView pane;
    bool calibrated; // the photo shows the light as `calibration` says; else as it is
    CalibrationView calibration;
} ViewPlan;

ViewPlan fs_view_plan(const Scene *scene, const Camera *camera, bool flash); // of a render; borrows the scene
// Of a photo: with its light, and what the camera made of it. learn: LEARN_*
// exposure: what its values were multiplied with; 0: 1. flash: factors on the flash's light on T and R.
void fs_view_plan_photo(ViewPlan *plan, const Scene *scene, const Camera *camera, const PhotoState *photo,
                        double exposure, const float flash[2], unsigned learn);
float fs_view_plan_per_px(const Camera *camera); // CalibrationView.per_px where all pixels are looked at
// flash: the flash's light, 0 of photos without. Of a camera on the pane or beyond it nothing is seen.
VeilView fs_view_plan_veil(const Veil *veil, const Camera *camera, const float flash[3]);
// The same in a scene, by the colour of its flash. flash: factor on its light.
VeilView fs_view_plan_scene_veil(const Scene *scene, const Camera *camera, float flash);

#define FS_NEAR 0.1 // near plane, in scene extents

#endif
