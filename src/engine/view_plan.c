#include "engine/view_plan.h"

#include <math.h>
#include <string.h>

#include "base/linalg.h"

static PaneView pane_of(const Pane *pane, const Camera *camera)
{
    const double *m = camera->w2c, *n = pane->normal;
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    PaneView v = {
        .f0 = (float)pane->f0, .dimming = (float)pane->dimming, .most = (float)FS_OPTICS_MOST, .T = 1, .R = 1};
    for (int k = 0; k < 3; k++) { // R^T K^-1 (x, y, 1)
        v.dx[k] = (float)(m[k] / camera->fx);
        v.dy[k] = (float)(m[4 + k] / camera->fy);
        v.base[k] =
            (float)(m[8 + k] + (0.5 - camera->cx) / camera->fx * m[k] + (0.5 - camera->cy) / camera->fy * m[4 + k]);
        v.normal[k] = (float)(n[k] / (length > 0 ? length : 1));
    }
    return v;
}

VeilView fs_view_plan_veil(const Veil *veil, const Camera *camera, const float flash[3])
{
    const double *m = camera->w2c, x = (0.5 - camera->cx) / camera->fx, y = (0.5 - camera->cy) / camera->fy;
    double axis[3][3], ahead[3], to_origin[3];
    memcpy(axis[0], veil->right, sizeof axis[0]);
    memcpy(axis[1], veil->down, sizeof axis[1]);
    v3_cross(axis[0], axis[1], axis[2]);
    fs_camera_centre(camera, to_origin);
    for (int k = 0; k < 3; k++) to_origin[k] = veil->origin[k] - to_origin[k];
    double distance = v3_dot(to_origin, axis[2]);
    if (!(distance > 0)) return (VeilView){.width = 0};
    VeilView v = {.per = (float)(distance / veil->cell), .width = veil->light.width, .height = veil->light.height};
    const float falloff = (float)(veil->distance * veil->distance / (distance * distance));
    for (int a = 0; a < 3; a++) {
        double on_x = v3_dot(axis[a], m), on_y = v3_dot(axis[a], m + 4); // of the camera's axes
        for (int k = 0; k < 3; k++) ahead[k] = m[8 + k] + x * m[k] + y * m[4 + k];
        v.base[a] = (float)v3_dot(axis[a], ahead);
        v.dx[a] = (float)(on_x / camera->fx);
        v.dy[a] = (float)(on_y / camera->fy);
        v.light[a] = flash[a] * falloff;
        v.ambient[a] = (float)veil->ambient[a];
        if (a < 2) v.at[a] = (float)(-v3_dot(to_origin, axis[a]) / veil->cell);
    }
    return v;
}

// Photos are balanced for the light of the rooms, in which dirt is grey; the flash is to that as on T. How strong the
// flash was, and of what colour, T and R say: the veil has no say in it.
VeilView fs_view_plan_scene_veil(const Scene *scene, const Camera *camera, float flash)
{
    const double *gain = scene->gain_color, mean = (gain[0] + gain[1] + gain[2]) / 3;
    float light[3];
    for (int k = 0; k < 3; k++) light[k] = flash * (float)(gain[k] / mean);
    return fs_view_plan_veil(&scene->veil, camera, light);
}

// The flash at a camera. share: of its light, on what is rendered.
static ShadeLight flash_at(const Scene *scene, const Camera *camera, float share)
{
    ShadeLight light = {.flash_distance = (float)scene->flash_distance, .even = scene->separation == SEPARATION_LINEAR};
    double centre[3];
    fs_camera_centre(camera, centre);
    for (int k = 0; k < 3; k++) {
        light.centre[k] = (float)centre[k];
        light.tint[k] = (float)scene->gain_color[k] * share;
    }
    return light;
}

static PlanPart part_of(const Scene *scene, Layer layer)
{
    const Cloud *cloud = &scene->cloud[layer];
    return (PlanPart){
        .there = cloud->n > 0, .cloud = cloud->n ? cloud : NULL, .layer = layer, .channels = fs_layers[layer].channels};
}

// T_F is the second half of T's channels where there are two; beta goes along with T (NeRFReN, section 3.2).
static ViewPlan plan_of_field(const Scene *scene, bool flash)
{
    const RadianceShape *shape = &scene->field.shape;
    bool mirrored = shape->colors[VOLUME_R] > 0, two = shape->colors[VOLUME_T] > 3;
    return (ViewPlan){.T = {.there = true,
                            .volume = VOLUME_T,
                            .first = two && flash ? 3 : 0,
                            .layer = two && flash ? LAYER_T_F : LAYER_T_N,
                            .channels = 3},
                      .R = {.there = mirrored, .volume = VOLUME_R, .layer = LAYER_R, .channels = 3},
                      .beta = {.there = mirrored,
                               .volume = VOLUME_T,
                               .first = RADIANCE_COLORS_MOST,
                               .layer = LAYER_BETA,
                               .channels = 1},
                      .plain_beta = true};
}

ViewPlan fs_view_plan(const Scene *scene, const Camera *camera, bool flash)
{
    if (fs_radiance_is(&scene->field)) return plan_of_field(scene, flash);
    ViewPlan plan = {.T = part_of(scene, flash && !scene->shared_geometry ? LAYER_T_F : LAYER_T_N),
                     .R = part_of(scene, LAYER_R),
                     .pane_beta = scene->pane_beta};
    if (scene->pane_beta)
        plan.pane = pane_of(&scene->pane, camera);
    else
        plan.beta = part_of(scene, LAYER_BETA);
    plan.covers = plan.T.there && plan.R.there && plan.pane_beta && plan.T.cloud->width[CLOUD_COVERS];
    if (flash && fs_scene_lit(scene)) {
        plan.T.lit = true;
        plan.T.light = flash_at(scene, camera, 1);
        plan.R.lit = scene->flash_return > 0; // what comes back by the room
        plan.R.light = flash_at(scene, camera, (float)scene->flash_return);
    }
    return plan;
}

float fs_view_plan_per_px(const Camera *camera)
{
    return (float)(2 / hypot(camera->width, camera->height));
}

static CalibrationView calibration_of(const Scene *scene, const Camera *camera, const PhotoState *photo,
                                      double exposure)
{
    CalibrationView v = {.cx = (float)camera->cx, .cy = (float)camera->cy};
    v.exposure = (float)pow(exposure > 0 ? exposure : 1, FS_OPTICS_GAMMA);
    v.per_px[0] = v.per_px[1] = fs_view_plan_per_px(camera);
    for (int k = 0; k < 3; k++) v.white[k] = photo->x[PHOTO_WHITE + k];
    for (int k = 0; k < FS_OPTICS_VIGNETTING; k++) v.vignetting[k] = (float)scene->vignetting[k];
    for (int k = 0; k < FS_OPTICS_KNOTS; k++) v.response[k] = (float)scene->response[k];
    return v;
}

static bool any(const float *x, int n)
{
    for (int i = 0; i < n; i++)
        if (x[i] != 0) return true;
    return false;
}

void fs_view_plan_photo(ViewPlan *plan, const Scene *scene, const Camera *camera, const PhotoState *photo,
                        double exposure, const float flash[2], unsigned learn)
{
    plan->pane.T = expf(photo->x[PHOTO_T]);
    plan->pane.R = expf(photo->x[PHOTO_R]);
    for (int k = 0; k < 3; k++) {
        plan->T.light.tint[k] *= flash[0];
        plan->R.light.tint[k] *= flash[1];
    }
    CalibrationView *v = &plan->calibration;
    *v = calibration_of(scene, camera, photo, exposure);
    v->curved = learn & LEARN_RESPONSE || any(v->response, FS_OPTICS_KNOTS);
    plan->calibrated = learn & (LEARN_WHITE | LEARN_VIGNETTING) || v->curved || any(v->white, 3) ||
                       any(v->vignetting, FS_OPTICS_VIGNETTING);
}
