// The one seam to compute. An engine holds a scene and the photos where it computes, on a device that the setting
// "device" names; what the caller has in host memory goes up, what it wants to see comes down. A device is one table
// (engine/device.h); docs/how-to-add.md says how to add one.
#ifndef FS_ENGINE_ENGINE_H
#define FS_ENGINE_ENGINE_H

#include "engine/loss.h"
#include "image/image.h"
#include "kernels/occlusion.h"
#include "model/camera.h"
#include "model/scene.h"

typedef struct Engine Engine;

// device: the setting "device", "auto" for the best at hand. cpu, threads: the settings of those names.
int fs_engine_new(Engine **engine, const char *device, const char *cpu, int threads, FsError *err);
void fs_engine_free(Engine *engine);
const char *fs_engine_device(const Engine *engine); // "cpu", "reference"

// ---- the scene, up and down ----

// Copies the scene to the device. What training keeps beside it begins anew.
int fs_engine_scene_up(Engine *engine, const Scene *scene, FsError *err);
// Brings back the numbers of the whole scene and the clouds of `layers` (bits 1 << Layer; radiance fields and the veil
// with any); the rest of `scene`, which is the caller's and may be {0}, stays.
int fs_engine_scene_down(Engine *engine, unsigned layers, Scene *scene, FsError *err);

// What training keeps beside the scene.
typedef struct CloudState {
    Cloud m, v;    // Adam's moments, fields like the cloud's
    float *screen; // (N, 2) since the last edit: sum of screen-space gradients (RasterTask.d_screen), steps in view
} CloudState;
// Numbers of the whole scene that are learned: see engine/update_numbers.c.
enum { ENGINE_NUMBERS = 8 + FS_OPTICS_VIGNETTING + FS_OPTICS_KNOTS + 3 };
typedef struct TrainState {
    CloudState cloud[LAYERS];
    float m[ENGINE_NUMBERS], v[ENGINE_NUMBERS];
    float *field_m, *field_v; // like Radiance.x; NULL for scenes of clouds
    float *veil_m, *veil_v;   // like Veil.light; NULL for scenes without a veil
} TrainState;
int fs_engine_state_up(Engine *engine, const TrainState *state, FsError *err); // of the scene that is up
int fs_engine_state_down(Engine *engine, TrainState *state, FsError *err);     // `state`: the caller's, may be {0}
void fs_engine_state_free(TrainState *state);
void fs_engine_cloud_state_free(CloudState *state);

// A layer's cloud as it shall be from now on. Statistics begin anew.
typedef struct CloudEdit {
    Layer layer;
    const Cloud *cloud;
    const int *from; // (N) the row whose moments each Gaussian goes on with; -1: it begins with none
    unsigned forget; // fields (bits 1 << CloudField) that lose their moments in all rows
} CloudEdit;
int fs_engine_edit(Engine *engine, const CloudEdit *edit, FsError *err);

// Whose gains the term gain_smooth compares, for the transmitted cloud as it is now: neighbour (N, ENGINE_NEIGHBOURS),
// rows. Holds until that cloud's next edit.
enum { ENGINE_NEIGHBOURS = 8 };
int fs_engine_neighbours(Engine *engine, const int *neighbour, FsError *err);

// ---- rendering ----

// Renders all layers, in linear light, each (camera height, camera width, channels). The images are the caller's
// (fs_engine_renders_free); they are reused when they have the right size.
typedef struct Renders {
    Image layer[RENDER_LAYERS];
} Renders;
int fs_engine_render(Engine *engine, const Camera *camera, Renders *renders, FsError *err);
void fs_engine_renders_free(Renders *renders);

// ---- training ----

// How a photo's light differs from the capture's: logarithms of factors on tau T, beta R and the flash's part of T, and
// on the three channels (exposure and white balance). Their means over the photos are 0, so that the scene keeps its
// brightness.
enum { PHOTO_T, PHOTO_R, PHOTO_FLASH, PHOTO_WHITE, PHOTO_NUMBERS = PHOTO_WHITE + 3 };
typedef struct PhotoState {
    float x[PHOTO_NUMBERS];
    float m[PHOTO_NUMBERS], v[PHOTO_NUMBERS]; // Adam's moments
} PhotoState;

// A photo to train on, numbered from 0 in the order of loading; photo and mask as fs_dataset_load_view gives them.
typedef struct EngineView {
    const Camera *camera;
    bool flash;
    const Image *photo, *mask;
    PhotoState state;           // to go on from; {0}: nothing is known
    float flash_gain;           // known beforehand, beside PHOTO_FLASH; 0: 1
    float exposure_gain;        // what the photo's values were multiplied with after they were linearised; 0: 1
    const unsigned char *lamps; // (OCCLUSION_CELLS) 0: what is clipped there is mirrored (StepArgs.lamps_mirrored);
                                // NULL: 0 everywhere
} EngineView;
int fs_engine_load_view(Engine *engine, const EngineView *view, FsError *err);
int fs_engine_photos_down(Engine *engine, PhotoState *states, FsError *err); // of all photos
void fs_engine_drop_views(Engine *engine);                                   // all photos; the next is number 0

// Who stands in the way of a photo's mirrored light, in scenes with a pane: a grid (kernels/occlusion.h) of the share
// that does not arrive, learned in every step at the photo, against what it costs:
// L + mean of cost q. A cell of a high cost stays 0.
typedef struct OcclusionState {
    float q[OCCLUSION_CELLS], cost[OCCLUSION_CELLS];
} OcclusionState;
int fs_engine_occlusion_up(Engine *engine, int view, const OcclusionState *state, FsError *err); // NULL: nobody, ever
int fs_engine_occlusion_down(Engine *engine, int view, OcclusionState *state, FsError *err);     // of one that is up

// What is learned of the camera beside the scene.
enum {
    LEARN_LIGHT = 1 << 0,      // PHOTO_T, PHOTO_R, PHOTO_FLASH of scenes with a pane
    LEARN_WHITE = 1 << 1,      // PHOTO_WHITE
    LEARN_VIGNETTING = 1 << 2, // Scene.vignetting
    LEARN_RESPONSE = 1 << 3,   // Scene.response
};

typedef struct StepArgs {
    int view;      // number of the photo
    int step;      // steps done before this one
    int stride[2]; // only every so many-th column and row of the photo is looked at, beginning anywhere; 0: all. Fields
                   // take what rays they have time for instead
    double weight[LOSS_TERMS];
    double slope_floor;        // kernels/compose.h
    double rate[CLOUD_FIELDS]; // Adam's learning rates (means: world units); 0: the field stays as it is
    double veil_rate;          // Adam's learning rate of the veil, in its units
    bool veil_ambient;         // what of it photos without the flash show is learned too
    double field_rate;         // Adam's learning rate of radiance fields (fs_radiance_parts); 0: they stay
    bool blind;                // colours of fields are taken to be the same from everywhere
    int every;                 // of the samples along a ray of fields, only one of so many; 0: all
    double darkest[LAYERS];    // least tone-mapped colour of a Gaussian; least beta of one of beta's
    bool lamps_mirrored;       // T learns nothing of what photos without the flash show clipped, but where
                               // EngineView.lamps says so, if both lightings are of the same Gaussians
                               // (Scene.shared_geometry)
    bool statistics;           // keep CloudState.screen
    unsigned learn;            // of the camera (LEARN_*)
    double settle;             // factor on the rates of what is learned of the camera
    uint64_t seed;
    float *residual; // (OCCLUSION_CELLS, 3), written: the photo less its render, tone-mapped, on average over the
                     // pixels of a cell that are trusted; NULL: nobody asks
} StepArgs;

typedef struct StepResult {
    double loss[LOSS_TERMS]; // not weighted; 0 where a term has no weight
    int visible[LAYERS];     // Gaussians in view
} StepResult;

// One step of training: render the photo's view, compare, go back, Adam. Needs a scene with a transmitted cloud for the
// photo's lighting.
int fs_engine_step(Engine *engine, const StepArgs *args, StepResult *result, FsError *err);

#endif
