// The terms of the loss, as rows of one table: a new term is a row and its function. A term that works on an image is
// called for strips of rows, one that works on parameters for ranges of a cloud's Gaussians.
#ifndef FS_ENGINE_LOSS_H
#define FS_ENGINE_LOSS_H

#include "model/scene.h"
#include "model/settings.h"

typedef enum LossTerm {
    LOSS_L1, // of the photo against the composite, tone-mapped (Flash-Splat, section 4)
    LOSS_DSSIM,
    LOSS_CONTRAST, // these three are found in one pass over the image (kernels/photometric.h)
    LOSS_LINEARITY,
    LOSS_DEPTH_SMOOTH,
    LOSS_BETA_SMOOTH,
    LOSS_OPAQUE,
    LOSS_UNSEEN,
    LOSS_GAIN_SMOOTH,
    LOSS_GAIN_PUSH,
    LOSS_OPACITY_REG,
    LOSS_SCALE_REG,
    LOSS_MIRRORED_LIGHT,
    LOSS_SPREAD,
    LOSS_WAY_SMOOTH,
    LOSS_WAY_BOTH,
    LOSS_PHOTO_REG,
    LOSS_RESPONSE_SMOOTH,
    LOSS_TERMS
} LossTerm;

// What a scene must have for a term to mean anything.
enum {
    LOSS_NEEDS_TWO_T = 1 << 0, // T_N and T_F as clouds of their own; both are rendered in every step
    LOSS_NEEDS_BETA = 1 << 1,  // as a cloud or field
    LOSS_NEEDS_GAINS = 1 << 2, // flash gains that are learned
    LOSS_NEEDS_FIELD = 1 << 3, // radiance fields
    LOSS_NEEDS_MUCH = 1 << 4,  // more than little that is mirrored (Scene.rare)
    LOSS_NEEDS_LITTLE = 1 << 5,
};

struct PhotoState;

// How much a photo's light may differ, by what the others' does: PHOTO_T, PHOTO_R, PHOTO_FLASH and the exposure.
typedef struct PhotoGuess {
    double along[4];      // what of the number goes along with the photo's place
    double held[4];       // factor on the square of the number,
    double held_along[4]; // and on that of this part
} PhotoGuess;

struct ViewLoss;  // engine/view_loss.h: a view's images, for terms on images
struct CloudLoss; // and a range of Gaussians

typedef struct LossInfo {
    const char *name;    // in log.jsonl, on the progress line and on the page
    const char *setting; // its weight
    unsigned needs;      // of the scene
    double begin, full;  // the weight rises between these shares of the steps; 0, 0: whole from the start
    double until, after; // from that share on it is so many times itself; 0, 0: to the end
    unsigned layers;     // bits 1 << Layer: whose renders or Gaussians it looks at
    bool depth;          // it looks at the depth of those layers
    bool transmittance;  // and at what light passes all of their splats
    // Adds a strip's gradient, and the strip's part of the term (not weighted) to sum. NULL: the row above does it.
    void (*rows)(const struct ViewLoss *view, int y0, int y1, double sum[LOSS_TERMS]);
    // The same for the numbers of the photo (engine.h: PhotoState); returns the term.
    double (*photo)(const struct PhotoState *photo, const PhotoGuess *guess, double weight, double gradient[]);
    double (*response)(const double response[], double weight, double gradient[]); // and for Scene.response
    void (*gaussians)(const struct CloudLoss *cloud, double sum[LOSS_TERMS]);      // the same for a range of Gaussians
} LossInfo;

extern const LossInfo fs_loss_terms[LOSS_TERMS];

// Whether a term with a weight looks at a layer's depth or transmittance.
typedef struct LossLooks {
    bool depth, transmittance;
} LossLooks;
LossLooks fs_loss_looks(const double weight[LOSS_TERMS], Layer layer);

// Each term's weight at a share of the steps (0..1); 0 where the scene lacks what the term needs.
void fs_loss_weights(const Settings *set, const Scene *scene, double progress, double weight[LOSS_TERMS]);

#endif
