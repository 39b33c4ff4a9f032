#include "model/radiance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/rng.h"

// Rates and first values as in Mueller et al. 2022, section 4; the networks' a little slower.
const RadiancePartInfo fs_radiance_parts[RADIANCE_PARTS] = {
    [RADIANCE_TABLE] = {"table", 1, 1e-4, false},   [RADIANCE_DENSITY] = {"density", 0.3, 1, true},
    [RADIANCE_BODY] = {"body", 0.3, 1, true},       [RADIANCE_COLOR_1] = {"color_1", 0.3, 1, true},
    [RADIANCE_COLOR_2] = {"color_2", 0.3, 1, true}, [RADIANCE_COLOR_3] = {"color_3", 0.3, 1, true},
    [RADIANCE_GRID] = {"grid", 0, 0, false},        [RADIANCE_PACE] = {"pace", 0, 0, false},
};

// Chosen on small made captures by quality and time (docs/fields.md).
RadianceShape fs_radiance_shape(bool lit, bool mirrored, int long_edge)
{
    return (RadianceShape){.levels = 12,
                           .log2_rows = 17,
                           .coarsest = 16,                           // Mueller et al. 2022
                           .finest = (int)fmax(16, 1.7 * long_edge), // cells a pixel
                           .hidden = 32,                             // half of Mueller et al.
                           .grid = 64,                               // half of Mueller et al. along an axis
                           .samples = mirrored ? 128 : 256,          // a step is a pixel of parallax or less
                           .colors = {lit ? 6 : 3, mirrored ? 3 : 0}};
}

RadianceLevel fs_radiance_level(const RadianceShape *shape, int level)
{
    RadianceLevel l = {0};
    double growth = shape->levels > 1 ? log((double)shape->finest / shape->coarsest) / (shape->levels - 1) : 0;
    for (int k = 0; k <= level; k++) {
        l.first += l.rows;
        l.resolution = (int)(shape->coarsest * exp(growth * k) + 0.5);
        double side = l.resolution + 1.0, most = (double)(1u << shape->log2_rows);
        l.hashed = side * side * side > most;
        l.rows = (uint32_t)(l.hashed ? most : side * side * side);
    }
    return l;
}

int fs_radiance_color_rows(const RadianceShape *shape, Volume volume)
{
    return (shape->colors[volume] + 3) / 4 * 4; // kernels/mlp.h
}

static size_t part_floats(const RadianceShape *s, Volume volume, RadiancePart part)
{
    size_t hidden = (size_t)s->hidden, grid = (size_t)s->grid;
    if (!s->colors[volume]) return 0;
    switch (part) {
    case RADIANCE_TABLE: {
        RadianceLevel last = fs_radiance_level(s, s->levels - 1);
        return (last.first + last.rows) * RADIANCE_FEATURES;
    }
    case RADIANCE_DENSITY: return hidden * (size_t)s->levels * RADIANCE_FEATURES;
    case RADIANCE_BODY: return RADIANCE_BODY_WIDTH * hidden;
    case RADIANCE_COLOR_1: return hidden * (RADIANCE_BODY_WIDTH + RADIANCE_DIRECTION);
    case RADIANCE_COLOR_2: return hidden * hidden;
    case RADIANCE_COLOR_3: return (size_t)fs_radiance_color_rows(s, volume) * hidden;
    case RADIANCE_GRID: return grid * grid * grid;
    default: return 1;
    }
}

size_t fs_radiance_at(const RadianceShape *shape, Volume volume, RadiancePart part, size_t *n)
{
    size_t at = 0;
    for (int v = 0; v <= (int)volume; v++)
        for (int p = 0; p < (v == (int)volume ? (int)part : RADIANCE_PARTS); p++)
            at += part_floats(shape, (Volume)v, (RadiancePart)p);
    if (n) *n = part_floats(shape, volume, part);
    return at;
}

size_t fs_radiance_floats(const RadianceShape *shape)
{
    size_t last, at = fs_radiance_at(shape, VOLUMES - 1, RADIANCE_PARTS - 1, &last);
    return at + last;
}

static int columns_of(const RadianceShape *s, RadiancePart part)
{
    return part == RADIANCE_DENSITY   ? s->levels * RADIANCE_FEATURES
           : part == RADIANCE_COLOR_1 ? RADIANCE_BODY_WIDTH + RADIANCE_DIRECTION
                                      : s->hidden;
}

int fs_radiance_new(Radiance *field, const RadianceShape *shape, const RadianceFrame *frame, uint64_t seed,
                    FsError *err)
{
    Rng rng = fs_rng_new(seed);
    *field = (Radiance){*shape, *frame, fs_radiance_floats(shape), NULL};
    if (!(field->x = calloc(field->n, sizeof *field->x))) return fs_error_memory(err);
    for (int v = 0; v < VOLUMES; v++)
        for (int p = 0; p < RADIANCE_PARTS; p++) {
            size_t n, at = fs_radiance_at(shape, (Volume)v, (RadiancePart)p, &n);
            const RadiancePartInfo *info = &fs_radiance_parts[p];
            float reach = (float)(info->fan ? info->first * sqrt(6.0 / columns_of(shape, p)) : info->first);
            for (size_t i = 0; i < n; i++) {
                bool direction =
                    p == RADIANCE_COLOR_1 && i % (RADIANCE_BODY_WIDTH + RADIANCE_DIRECTION) >= RADIANCE_BODY_WIDTH;
                float first = reach * (2 * fs_rng_uniform(&rng) - 1);
                field->x[at + i] = p == RADIANCE_GRID ? -1 : direction ? 0 : first;
            }
        }
    return 0;
}

void fs_radiance_free(Radiance *field)
{
    free(field->x);
    *field = (Radiance){0};
}

int fs_radiance_copy(Radiance *to, const Radiance *from, FsError *err)
{
    *to = *from;
    to->x = NULL;
    if (!from->n) return 0;
    if (!(to->x = malloc(from->n * sizeof *to->x))) {
        *to = (Radiance){0};
        return fs_error_memory(err);
    }
    memcpy(to->x, from->x, from->n * sizeof *to->x);
    return 0;
}

static bool within(int x, int least, int most)
{
    return x >= least && x <= most;
}

int fs_radiance_check(const RadianceShape *s, const RadianceFrame *f, const char *path, FsError *err)
{
    bool shape = within(s->levels, 2, RADIANCE_LEVELS_MOST) && s->levels % 2 == 0 && within(s->log2_rows, 4, 24) &&
                 within(s->coarsest, 2, 1024) && within(s->finest, s->coarsest, 1 << 16) && within(s->hidden, 4, 128) &&
                 s->hidden % 4 == 0 && within(s->grid, 2, 256) && within(s->samples, 2, RADIANCE_SAMPLES_MOST) &&
                 (s->colors[VOLUME_T] == 3 || s->colors[VOLUME_T] == 6) &&
                 (s->colors[VOLUME_R] == 0 || s->colors[VOLUME_R] == 3);
    if (!shape) return fs_error_input(err, "%s: field: not the shape of radiance fields that this program makes", path);
    bool frame = fs_camera_is_rotation(f->w2c, 1e-3) && f->near > 1e-12 && f->far > f->near && f->far < 1e15 &&
                 f->parts > 0 && f->parts < 1;
    for (int k = 0; k < 2; k++)
        frame = frame && fabs(f->low[k]) < 1e6 && fabs(f->high[k]) < 1e6 && f->low[k] < f->high[k];
    for (int k = 0; k < 3; k++) frame = frame && fabs(f->w2c[4 * k + 3]) < 1e15;
    if (!frame)
        return fs_error_input(err, "%s: field: expected a rotation, low < high, 0 < near < far and 0 < parts < 1",
                              path);
    return 0;
}

int fs_radiance_write(const Radiance *field, const char *path, FsError *err)
{
    return fs_file_write(path, field->x, field->n * sizeof *field->x, err);
}

int fs_radiance_read(Radiance *field, const RadianceShape *shape, const RadianceFrame *frame, const char *path,
                     FsError *err)
{
    size_t n = fs_radiance_floats(shape), size = 0;
    char *data = NULL;
    MUST(fs_file_read(path, n * sizeof(float), &data, &size, err)); // asks the file first, then for memory
    *field = (Radiance){*shape, *frame, n, (float *)(void *)data};
    bool ok = size == n * sizeof(float);
    for (size_t i = 0; i < n && ok; i++) ok = isfinite(field->x[i]);
    if (ok) return 0;
    fs_radiance_free(field);
    return fs_error_input(err, "%s: %zu bytes, expected %zu of finite numbers, as model.json beside it says", path,
                          size, n * sizeof(float));
}
