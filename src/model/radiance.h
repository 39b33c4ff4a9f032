// Radiance fields, which a scene may be made of in place of clouds (docs/fields.md): a volume for T and, where R is
// told apart, one for R. Each is a multiresolution hash encoding of places and two small networks: one tells density
// (and beta), the other, by what the first one says and the direction of view, tone-mapped colours. All of it is one
// array of floats; one table of its parts drives first values, Adam, files and checkpoints.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "model/camera.h"

typedef enum Volume { VOLUME_T, VOLUME_R, VOLUMES } Volume;

typedef enum RadiancePart {
    RADIANCE_TABLE,   // (rows of all levels, RADIANCE_FEATURES)
    RADIANCE_DENSITY, // (hidden, features of all levels)
    RADIANCE_BODY,    // (RADIANCE_BODY_WIDTH, hidden): row 0 is the logarithm of density, 1 the logit of beta
    RADIANCE_COLOR_1, // (hidden, RADIANCE_BODY_WIDTH + RADIANCE_DIRECTION); directions say nothing at first
    RADIANCE_COLOR_2, // (hidden, hidden)
    RADIANCE_COLOR_3, // (colour rows, hidden): logits
    RADIANCE_LEARNED, // the parts before are learned
    RADIANCE_GRID = RADIANCE_LEARNED, // (grid, grid, grid), x fastest: the thickest met of late in a cell; < 0: unknown
    RADIANCE_PACE,                    // (1) mean samples of a ray, of the last steps; 0: none yet
    RADIANCE_PARTS
} RadiancePart;

enum {
    RADIANCE_FEATURES = 2, // of a row of a table
    RADIANCE_BODY_WIDTH = 16,
    RADIANCE_DIRECTION = 16,
    RADIANCE_LEVELS_MOST = 16,
    RADIANCE_COLORS_MOST = 6,
    RADIANCE_SAMPLES_MOST = 1024
};

typedef struct RadianceShape {
    int levels, log2_rows; // of the tables, at most so many rows a level
    int coarsest, finest;  // cells of the first and the last level along an axis
    int hidden, grid;      // width of the networks; cells of the grid along an axis
    int samples;           // that a ray has where nothing is empty
    int colors[VOLUMES];   // channels: 3, or 6 (T_N, T_F); 0: there is no such volume
} RadianceShape;

// The unit cube that a field lives in: the view of a middle camera, by disparity (NeRF's normalised device
// coordinates). x = (X / Z - low_x) / (high_x - low_x), y likewise, s = (1 - near / Z) / (1 - near / far).
typedef struct RadianceFrame {
    double w2c[12];
    double low[2], high[2];
    double near, far;
    double parts; // s between the near and the far one of two scenes, of which nothing else is known at first
} RadianceFrame;

typedef struct Radiance {
    RadianceShape shape; // levels 0: the scene has no fields
    RadianceFrame frame;
    size_t n;
    float *x; // (n) all parts of all volumes
} Radiance;

typedef struct RadiancePartInfo {
    const char *name;
    double rate;  // of Adam, times that of the schedule
    double first; // first values: uniform within -+ this
    bool fan;     // by the root of the columns (He et al. 2015, for rectified inputs)
} RadiancePartInfo;
extern const RadiancePartInfo fs_radiance_parts[RADIANCE_PARTS];

// What training makes them of, for photos of `long_edge` pixels. lit: T has a colour with flash too; mirrored: there is
// R.
RadianceShape fs_radiance_shape(bool lit, bool mirrored, int long_edge);
int fs_radiance_new(Radiance *field, const RadianceShape *shape, const RadianceFrame *frame, uint64_t seed,
                    FsError *err);
void fs_radiance_free(Radiance *field);
int fs_radiance_copy(Radiance *to, const Radiance *from, FsError *err);
int fs_radiance_check(const RadianceShape *shape, const RadianceFrame *frame, const char *path, FsError *err);
size_t fs_radiance_floats(const RadianceShape *shape);
// Where a part begins in x, and how many floats it has.
size_t fs_radiance_at(const RadianceShape *shape, Volume volume, RadiancePart part, size_t *n);
typedef struct RadianceLevel {
    int resolution; // cells along an axis
    uint32_t rows;  // of the table; one a vertex unless hashed
    bool hashed;
    size_t first; // row
} RadianceLevel;
RadianceLevel fs_radiance_level(const RadianceShape *shape, int level);
int fs_radiance_color_rows(const RadianceShape *shape, Volume volume); // colours, as many as layers ask for

static inline bool fs_radiance_is(const Radiance *field)
{
    return field->shape.levels > 0;
}
static inline float *fs_radiance_part(const Radiance *field, Volume volume, RadiancePart part)
{
    return field->x + fs_radiance_at(&field->shape, volume, part, NULL);
}

// Files: x as it lies in memory, little-endian; its size and that all are numbers is checked.
int fs_radiance_write(const Radiance *field, const char *path, FsError *err);
int fs_radiance_read(Radiance *field, const RadianceShape *shape, const RadianceFrame *frame, const char *path,
                     FsError *err);
