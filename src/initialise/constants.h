// The constants of the method: what each is, and what it was chosen by:
//   paper, glass   given by the 3DGS paper, or by what glass does
//   program        given by what the Flash-Splat paper's authors published as their program
//   experiment     compared with others by quality on the shared scenes (docs/experiments.md)
//   captures       lies between the figures of captures that come apart and of those that do not (advise.c)
//   -              not measured by itself; the start as a whole is what docs/experiments.md compares
#ifndef FS_INITIALISE_CONSTANTS_H
#define FS_INITIALISE_CONSTANTS_H

enum {
    INPUT_LONG_EDGE = 300,        // -          pixels of the photos the stage works on
    INPUT_FEWEST = 20,            // -          points of a given cloud below which nothing can be told
    GIVEN_CUES = 20000,           // -          points of a dense cloud of the user's that get a cue
    CUE_SIDE = 9,                 // -          samples along a side of the patch, a pixel apart
    CUE_GROUP_MAX = 24,           // -          photos of one lighting looked at
    CUE_VIEWS_MIN = 3,            // -          of each lighting
    GRAPH_NEAR = 16,              // -          neighbours in space,
    GRAPH_FIELD = 48,             // -          those that tell how much the flash lights the place,
    GRAPH_RAY = 32,               // -          and those in the same direction
    GRAPH_ROUNDS = 25,            // -          of the mean field
    DEPTH_ODDS_STEPS = 64,        // -          of the table of depths
    CLASSIFY_RARE_STEPS = 12,     // -          tried at most
    MIRRORED_FEWEST = 20,         // -          points called mirrored whose growth tells whether they are,
    MIRRORED_LEFT = 10,           // captures   and that tell it where they were held for rare
    LIGHT_NEIGHBOURS = 12,        // -          that a place's gain is carried over from
    LIGHT_ENOUGH = 10,            // -          clear points that the flash's colour is fitted to at least
    SWEEP_GROUP_T = 8,            // experiment photos of one lighting looked at, the nearest
    SWEEP_GROUP_R = 16,           // experiment
    SWEEP_SLOW_SIGMA_T = 2,       // experiment pixels; slower parts of the photos are left out
    SWEEP_SLOW_SIGMA_R = 3,       // experiment
    SWEEP_BLUR_RADIUS = 3,        // -          grid pixels
    SWEEP_DIVIDE = 2,             // -          grid pixels per photo pixel, a side
    STEREO_VIEWS = 8,             // -          swept at most
    STEREO_STEPS_MIN = 32,        // -          of depth
    STEREO_STEPS_MAX = 128,       // -
    STEREO_VOTES = 2,             // -          of other views that a point needs
    COLORS_TURNS = 3,             // -          in which the two scenes are freed from each other
    BEFORE_NEIGHBOURS = 16,       // -          points of the transmitted surface in the direction of a mirrored seed
    BEFORE_FARTHER = 2,           // experiment of them are farther than a seed that is left out
    REAR_PLANES = 3,              // -          at most (rear.h)
    REAR_POINTS = 8000,           // -          that they are found by at most,
    REAR_FEWEST = 100,            // -          and at least
    REAR_TRIALS = 3000,           // -          a plane
    REAR_ROUNDS = 5,              // -          of least squares
    SEEDS_SURFACE_POINTS = 25000, // -          that a surface is drawn from at most
    SEEDS_ATTEMPTS = 25,          // -          to cover all photos, with larger cells each time
    SEEDS_LEAST = 3,              // -          no seed shows smaller than a pixel over this,
    SEEDS_MOST = 20,              // -          or larger than a photo over this
    COLORED_FEWEST = 8,           // -          points of a kind below which its depth is guessed
    ADVISE_FEW_POINTS = 50,       // captures
    ADVISE_FEW_PHOTOS = 5,        // captures   of either kind
    DEPTH_CUE_BINS = 80,          // program    a side of the histograms (depth_cue.h)
    DEPTH_CUE_SIGHTINGS = 2,      // -          photos of a lighting that make a point one of its points
    CUE_MEANS_ROUNDS = 100,       // -          of the two means of either cue, which settle in ten
};

#define GIVEN_SEEN 0.1f             // -          least share of the points of a given cloud that photos see
#define CUE_COHERENCE_MIN 0.08f     // -
#define CUE_SLOPE_MAX 20.0          // -          what is black without flash has no slope; this stands for it
#define CLASSIFY_DEPTH_SCALE 2.0f   // -          log depth against tangent of angle in distances between points
#define CLASSIFY_NEAR_RADIUS 0.06f  // -          all three: tangents of angle in the middle view
#define CLASSIFY_FIELD_RADIUS 0.1f  // -
#define CLASSIFY_RAY_RADIUS 0.04f   // -
#define CLASSIFY_RAY_APART 0.06f    // -          in log depth; nearer than this it is the same place,
#define CLASSIFY_RAY_RAMP 0.1f      // -          and this much farther another one for sure
#define CLASSIFY_RAY_MOST 4         // -          of such neighbours that count, all told
#define CLASSIFY_NEAR_WEIGHT 0.5f   // -
#define CLASSIFY_RAY_WEIGHT 0.5f    // -
#define CLASSIFY_DEPTH_MOST 1.5f    // captures   most that the depth alone may say, log of odds
#define CLASSIFY_DEPTH_KERNEL 0.15f // -          in log depth
#define CLASSIFY_DULL_SLOPE 0.3f    // -          log; what grows less tells nothing, at first, of lit depths
#define CLASSIFY_DULL 0.3f          // -          probability of "transmitted" below which a point is dull,
#define CLASSIFY_ALONE 0.1f         // -          and how rare lit things are where they have no business
#define CLASSIFY_ALONE_SHARE 0.02   // -          of the points that such are, or nothing is known of mirrored depths
#define CLASSIFY_ANY_DEPTH 0.1f     // -          share of either kind that lies at any depth
#define CLASSIFY_STEP 0.5f          // -          of the mean field in a round
#define MIRRORED_SLOPE 0.04f        // -          log; a little of the flash comes back by the room
#define MIRRORED_SPREAD 0.08f       // -
#define MIRRORED_SLOPE_MOST 0.3f    // captures   log; where a quarter of the mirrored points grow by more, some are not
#define CLASSIFY_RARE_STEP 0.5f     // -          log of the odds; mirrored points are that much rarer then,
#define LITTLE_POINTS 0.15          // captures   share of the points that are mirrored, below which
#define LITTLE_LIGHT 0.35           // captures   and of the first colours' light, below which little is mirrored,
#define LITTLE_LAMPS 0.002          // captures   where no more than that of the photos without the flash is clipped
#define LIT_SLOPE 0.7f              // captures   log; where no transmitted point is near (a growth of 2)
#define LIT_SPREAD 0.4f             // -
#define LIT_FIELD_SPREAD 0.25f      // -          where some are
#define LIT_SUPPORT 2               // -          weight of LIT_SLOPE beside the points around
#define LIT_VARIANCE 0.01f          // -          added to the variance that each of them is weighed by
#define LIT_FIELD_SUPPORT 12        // -          weight of them from which on there are some
#define LIT_LEAST 0.05f             // -          log; transmitted points grow by that at least
#define CLASSIFY_OUTLIERS 0.02f     // -
#define CLASSIFY_SIGMA_MIN 0.03f    // -
#define DEPTH_CUE_WITHIN 0.99       // -          share of the points, in depth
#define DEPTH_CUE_REACH 3.0         // experiment times that depth: the program's window reaches far beyond a scene
#define DEPTH_CUE_POWER 0.8         // program    of the difference in each bin
#define DEPTH_CUE_SIGMA 3.0         // program    bins
#define CLASSIFY_SURE 1.0f          // -          log of odds
#define LIGHT_SIGMA_MOST 0.3f       // -          of a clear cue
#define LIGHT_ALPHA_MIN 0.05        // -
#define LIGHT_ALPHA_MAX 50          // -
#define LIGHT_VARIANCE 0.04         // -          of a cue's log alpha, beside its own error's
#define LIGHT_GAIN_MAX 1.5f         // -          the logarithm of the gain stays within this
#define SWEEP_WINDOW_SIGMA 1.1f     // -          grid pixels
#define SWEEP_EVEN_FLOOR 1e-6f      // -          of a pixel's contrast, squared, in the light that the photo shows
#define EDGE_TONE 0.3f              // -          power of the light at which colours are compared,
#define EDGE_RANGE 0.1f             // experiment and how unlike those are that count little for the slow part,
#define EDGE_LIKE 0.06f             // experiment and in a window, per channel
#define EDGE_LEAST 1e-3f            // -          weight that counts
#define SWEEP_AXIS_MIN 0.5          // -          cosine between the optical axes of photos looked at together
#define SWEEP_SIGMA_SURE 0.15f      // -          uncertainty of the contrast's growth where the photos agree
#define SWEEP_SIGMA_UNSURE 0.45f    // -
#define SWEEP_SURE_COHERENCE 0.3f   // -
#define STEREO_STEP_PX 1.2f         // -          what a step of depth moves in a photo at the photos' usual distance
#define STEREO_RANGE_MARGIN 0.15f   // -
#define STEREO_RANGE_SHARE 0.01f    // -          of the points may lie outside the swept range at either end
#define STEREO_SMALL_T 0.05f        // -          costs of a change of depth (semiglobal.h)
#define STEREO_LARGE_T 0.3f         // -
#define STEREO_SMALL_R 0.03f        // -
#define STEREO_LARGE_R 0.2f         // -
#define STEREO_SURE_T 0.1f          // -          least scores
#define STEREO_SURE_R 0.1f          // -
#define STEREO_SAME_DEPTH 0.04f     // -          relative; within this two views agree
#define STEREO_APART 0.08f          // -          relative; how much nearer or farther the mirrored surface of a ray is
#define NEAR_DULL 0.7f              // experiment log of the odds by which a point's own cue calls it mirrored
#define NEAR_LIT_ODDS 0.4f          // experiment share of what depths tell for "transmitted"
#define NEAR_AGREE 0.85f            // experiment of the swept views
#define NEAR_DEPTH 0.5f             // -          log of the odds for "transmitted" at depths where lit things lie
#define OUTLIERS_FARTHER_T 1.5f     // experiment times as far from points of its own scene as from the other's
#define OUTLIERS_FARTHER_R 6.0f     // experiment
#define BEFORE_MOST 0.2f            // -          share of the mirrored seeds; were it more, they would all stay
#define REAR_SAME 0.015             // -          relative depth within which a point is on a plane
#define REAR_BEHIND 3.0             // -          points on a plane that one behind it is worth
#define REAR_LEAST 0.03             // -          of all points that a plane needs
#define REAR_MOST 3.0               // -          times as far as a seed before it
#define SURFACE_SAME 0.05f          // -          relative depth within which points are of one surface
#define SEEDS_COVERED 0.15f         // -          a cell is covered by a seed this near to its surface, relative depth
#define SEEDS_SURFACE_SHARE 0.7f    // -          of what is left after the points; the rest are copies
#define SEEDS_POINT_SHARE 0.6f      // -          of the count at most
#define SEEDS_COPY_STEP 0.5f        // -          that copies are moved by, of the distance to the neighbours
#define SEEDS_CELL_MIN_PX 1.0f      // -
#define SEEDS_CELL_GROWTH 1.15f     // -          from one attempt to cover all photos to the next
#define COLORS_DARKEST 0.01f        // -          share of the light at its place that a seed has at least
#define COLORS_HIDDEN 0.93f // -          a seed this much farther (inverse depth) than the drawn surface is hidden
#define COLORS_HIDDEN_WEIGHT 0.01f // -          what a hidden seed's photo counts
#define COLORS_USUAL_SHARE 0.6f    // -          of the light that is T's, where gains tell nothing
#define COLORS_UNSEEN 0.1f         // -          light of a seed that no photo shows
#define COLORS_UNSEEN_LEFT 0.5f    // -          share of it that is R's
#define COLORS_ENOUGH_SEEDS 0.6f   // -          seeds per pixel from which on every pixel is drawn, not every other
#define COLORS_ALPHA_NOISE 0.15f   // -          gains near or below this tell little
#define COLORS_BLACK 1e-4f         // -          light too dark to tell a colour by
#define COLORS_DARK_PHOTOS 0.15f   // experiment share of the photos that may be darker than T_N there
#define COLORS_ROOM_TAKEN 0.4f     // experiment of the light that photos leave room for, T_N is at least
#define COLORS_ROOM_MOST 20.0f     // -          factor
#define COLORS_GAIN_MOST 2.0f      // -          that gains (logarithms) change by
#define COLORED_GUESS_FARTHER 2.0f // -          a mirrored scene without points is this many times as far as the other
#define RESIDUAL_SEEDS_PER_PIXEL 1.0f // -          of the scene that is subtracted
#define BLOB_OPACITY 0.5f             // experiment at the start; faint blobs that hide each other hold the start up
#define BLOB_SIZE 0.6f                // experiment in distances to the neighbours
#define BLOB_PAPER_OPACITY 0.1f       // paper      with separate geometry
#define BLOB_PAPER_SIZE 1             // paper
#define PANE_GLASS 0.08               // glass      reflectance of a clean pane, both surfaces
#define PANE_BRIGHT_SCENE 0.8         // -          the mirrored room's own light at its bright places: fixes f0
#define PANE_BRIGHT_SHARE 0.95        // -
#define PANE_F0_MIN 0.04              // glass      of one surface
#define PANE_F0_MAX 0.5               // -
#define PANE_RETURN 0.2               // -          of the flash comes back by the mirrored room; learned
// Lamps (lamp_depth.c).
#define LAMP_BRIGHT 1.5f  // -   times the photo's mean is what counts as clipped and not as masked
#define LAMP_NEAREST 0.05 // -   of a scene's points that a view sees lie before where it begins
#define LAMP_NEARER 0.8   // -   of the depth at which the things begin, lamps may hang before them
#define LAMP_MARGIN 1.1   // -   so much nearer than the room is before it
#define LAMP_AGREE 0.6    // -   of the photos that see a place, at least
#define LAMP_BETTER 0.1   // -   so much more of them must agree on a place before the room
enum {
    LAMP_DEPTHS = 64,  // -   that are tried
    LAMP_CELL = 16,    // -   pixels a side, of which those around tell which scene is there
    LAMP_PIXELS = 400, // -   of a photo that are looked at
    LAMP_POINTS = 20,  // -   of a scene that a view sees, at least
    LAMP_OTHERS = 64,  // -   photos of all that a place is looked for in
    LAMP_VIEWS = 3,    // -   that see a place, at least
};
// Radiance fields (first_field.c).
#define FIELD_POINTS_OUT 0.005    // -   share of the points that may lie out of the fields at either end
#define FIELD_NEARER 0.6          // -   the fields begin so much nearer than the points,
#define FIELD_FARTHER 3.0         // -   and end so much farther
#define ADVISE_SLOPE_MIN 1.15     // captures   median contrast growth of the transmitted points
#define ADVISE_SEPARATION_MIN 1.5 // captures   distance between the kinds' median growth, in errors of a point's
#define ADVISE_ERROR_MIN 0.02     // -          of the growth's logarithm
#define ADVISE_FAR_SHARE 0.15     // captures   distance to the nearest photo of the other kind, of the scene's

#endif
