// The constants of training: what each is, and what it was chosen by:
//   3DGS, MCMC   Kerbl et al. 2023; Kheradmand et al. 2024
//   authors      the code of the paper's authors, for the preset `paper` and --densify fsgs
//   experiment   compared with others by quality on the shared scenes (docs/experiments.md)
//   -            not measured by itself
// What has a setting is in model/settings.c; within which parameters stay, in engine/update.c.
#ifndef FS_TRAIN_TRAIN_CONSTANTS_H
#define FS_TRAIN_TRAIN_CONSTANTS_H

// Learning rates per step; the setting rate-scale multiplies all here but the opacities'.
#define RATE_QUATS 1e-3     // 3DGS
#define RATE_OPACITIES 5e-2 // 3DGS
#define RATE_GAINS 5e-3     // -
#define MEANS_FALL 0.01     // 3DGS        of the means' rate, over the run
#define SETTLE_FALL 0.1     // experiment  of the other rates, over the share `settle` of the steps

// Lamps, as bright in either scene.
#define LAMPS_UNTIL 0.4  // experiment  of the steps: R has them by then

// Levels, from coarse to fine.
#define COARSE_UNTIL 0.5 // experiment  share of the steps before the full size
enum {
    COARSEST = 100, // -           pixels of the longer side
    STRIDE = 2,     // experiment  of rows and columns, where not all pixels are looked at
};

// --densify relocate
#define OPACITY_DEAD 0.005f // MCMC        of a Gaussian that shows nothing
#define SOLID 0.99f         // -           opacity of what was moved, at most
#define SPREAD 0.3          // experiment  share of a Gaussian's variance along its longest axis that parts its copies
#define GROWTH 1.15         // -           of a cloud in each round, at most
#define GROWN_BY 0.6        // experiment  share of the steps after which clouds have their budget
#define SPLATS_PER_SIDE 163 // experiment  budget of a cloud, by the root of a photo's pixels
#define RELOCATE_UNTIL 0.85 // -           of the steps: what was moved last settles
enum {
    RELOCATE_EVERY = 100, // MCMC
    RELOCATE_FROM = 500,  // MCMC        but at most a twentieth of the steps
};

// What hangs before the cameras (curtains.c).
#define CURTAIN_NEAREST 0.02 // -           what is nearest of T: this share of it;
#define CURTAIN_NEAR 0.5     // -           a curtain is nearer than so much of that,
#define CURTAIN_WIDE 0.3     // -           and so many times as wide (one sigma) as far
enum {
    CURTAIN_VIEWS = 16,   // -           that are asked what is nearest,
    CURTAIN_ASKED = 4000, // -           of so many Gaussians, about
};

// Radiance fields.
#define RATE_FIELD 1e-2       // Mueller et al. 2022; of each part: model/radiance.c
#define FIELD_FALLS_FROM 0.25 // -           share of the steps
#define FIELD_FALL 0.02       // -           of the rate, from there to the end
#define FIELD_COARSE 0.15     // -           share of the steps with a quarter of the samples, and again with a half
#define FIELDS_COARSE 0.35    // -           the same for two fields
#define FIELD_BLIND 0.6       // NeRFReN     share before colours know the direction of view; of two fields never
enum { FIELD_WARM_UP = 50 };  // -

// The look at the pane (pane_look.c).
#define PANE_SHARE 0.25 // -           of the steps, at most
enum {
    PANE_SIDE = 300,  // experiment  pixels of the longer side, at most
    PANE_STEPS = 312, // experiment
};

// What stands before the pane (bars.c).
#define RATE_COVERS 0.2   // experiment
#define BARS_EDGE 0.5f    // experiment  covers, evened out over neighbours, of what may belong to it,
#define BARS_SURE 0.8f    // experiment  and of what does
#define BARS_LEAST 0.009  // experiment  share of the Gaussians that are as sure
#define BARS_MOST 0.2     // captures    of all of them; more are none (4 to 11 % were bars, 24 to 36 % were none)
#define BARS_AROUND 0.1f  // -           widths of a photo, what is seen around,
#define BARS_BEHIND 1.05f // -           what is so many times as far is behind,
#define BARS_BEFORE 0.3   // experiment  of the rest there may be so much,
#define BARS_RARE 0.12    // captures    where little is mirrored (true ones 0.03 to 0.08, one 0.20; false 0.16 to 0.27)
#define BARS_NEAREST 0.02 // -           what is nearest of T: this share of it;
#define BARS_NEAR 1.6     // experiment  R's are near up to so many times as far;
#define BARS_LENT 0.02    // experiment  the share where R's were lent: more that is near is taken for bars there
enum {
    BARS_EVENED = 3,  // experiment  times
    BARS_VIEWS = 8,   // -           that are asked what is nearer,
    BARS_ASKED = 300, // -           of so many sure ones of a group, about
    BARS_SEEN = 8,    // -           Gaussians around, at least
};

// Dirt on the pane.
#define RATE_VEIL 0.1         // experiment  in the veil's units
#define VEIL_AMBIENT_FROM 0.4 // experiment  of the steps: before, it takes what scenes lack that are not yet found

// The photographer's mirror image (photographer.c).
#define OCCLUSION_COST 0.01f     // experiment
#define PORTRAIT_DSSIM 0.25      // experiment  share in the photo term
#define OCCLUSION_NEVER 1e3f     // -           more than any photo gains by it
#define PORTRAIT_RATE 0.3f       // experiment  of what a photo changes there
#define PORTRAIT_STANDS_OUT 0.3f // experiment  of what is around it, so much
#define PORTRAIT_OUTLINE 0.3f    // experiment  where they end
#define PORTRAIT_SURE 0.45f      // experiment  and at last, when more of them shows
#define PORTRAIT_MOVES 0.03      // captures    of the misfit, less than with what stands still (false 0.014, true 0.05)
#define PORTRAIT_PASSES 0.12     // captures    tangent, rms: so much does that move in the photos
#define PORTRAIT_TILT 0.35       // -           sine of how far photos look down or up through an upright pane, at most
#define PORTRAIT_PULL 0.3f       // experiment  of that cost, towards what is hidden within, while training
#define PORTRAIT_MOST 0.35       // -           of the photos' area; more is what the scenes do not explain
#define PORTRAIT_REACH 1.1       // -           tangent of how far to the sides it goes
#define PORTRAIT_HEIGHT 3.0      // -           of the figure, in its widths
#define PORTRAIT_SHARE 0.25      // -           of the steps, at most, in the first round
enum {
    PORTRAIT_SIDE = 100,  // -           pixels of the longer side, at most
    PORTRAIT_VISITS = 16, // experiment  of each photo in a round
    PORTRAIT_ROUNDS = 2,  // experiment
    PORTRAIT_GAP = 2,     // experiment  cells
    PORTRAIT_NEAR = 3,    // -           cells around the outline, where photos may differ
    PORTRAIT_LEAST = 20,  // -           cells of 16384
};

// Who walks by (passers_by.c).
#define PASSERS_OUTLINE 0.04f     // experiment  tone-mapped: so much of a photo that the scenes do not explain,
#define PASSERS_STANDS_OUT 0.035f // experiment  and so much more of it than around
#define PASSERS_MOST 0.25         // -           of a photo; more is something else
#define PASSERS_PHOTOS 0.85       // captures    of the photos of a lighting; likewise
enum {
    PASSERS_STEPS = 1000, // -           of the training, at least
    PASSERS_VISITS = 2,   // -           of each photo, before the full size
    PASSERS_GAP = 1,      // experiment  cells
    PASSERS_LEAST = 40,   // experiment  cells of 3072
    PASSERS_NEAR = 1,     // -           cells around that are left out, too
};

// --densify fsgs
enum {
    FSGS_FROM = 500,          // authors
    FSGS_UNTIL = 10000,       // authors
    FSGS_EVERY = 100,         // authors
    FSGS_MEANS_OVER = 10000,  // authors     steps over which the means' rate falls
    FSGS_RESET_EVERY = 3000,  // authors     of opacities
    FSGS_RESET_FROM = 2000,   // authors
    FSGS_UNPOOL_UNTIL = 2000, // authors
    FSGS_NEIGHBOURS = 3,      // authors     of unpooling
};
#define FSGS_GRADIENT 5e-4f      // authors     mean screen-space gradient, NDC units
#define FSGS_DENSE 0.01f         // authors     of the extent: larger ones split, smaller ones are cloned
#define FSGS_OPACITY_MIN 0.005f  // authors
#define FSGS_RESET_OPACITY 0.05f // authors
#define FSGS_SPLIT_SHRINK 1.6f   // 3DGS
#define FSGS_GROWTH 2            // experiment  of a cloud in each round, as far as it may: for estimates

#endif
