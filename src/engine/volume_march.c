#include "engine/volume_march.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/rng.h"

#define EMPTY 0.02f // optical thickness of a step that is not worth a sample

VolumeMarch fs_volume_march(const Radiance *field, const Camera *camera, const uint32_t *occupied, uint64_t jitter,
                            int every)
{
    const RadianceFrame *frame = &field->frame;
    VolumeMarch m = {.near = (float)frame->near,
                     .closing = (float)(1 - frame->near / frame->far),
                     .samples = field->shape.samples,
                     .grid = field->shape.grid,
                     .occupied = occupied,
                     .every = every,
                     .jitter = jitter};
    double centre[3];
    fs_camera_centre(camera, centre);
    for (int i = 0; i < 3; i++) {
        const double *f = frame->w2c + 4 * i;
        double r[3] = {0}; // row i of (world to frame) (camera to world)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) r[j] += f[k] * camera->w2c[4 * j + k];
        m.origin[i] = (float)(f[0] * centre[0] + f[1] * centre[1] + f[2] * centre[2] + f[3]);
        m.dx[i] = (float)(r[0] / camera->fx);
        m.dy[i] = (float)(r[1] / camera->fy);
        m.base[i] = (float)(r[2] + (0.5 - camera->cx) / camera->fx * r[0] + (0.5 - camera->cy) / camera->fy * r[1]);
    }
    for (int k = 0; k < 2; k++) {
        m.low[k] = (float)frame->low[k];
        m.scale[k] = (float)(1 / (frame->high[k] - frame->low[k]));
    }
    return m;
}

static void direction_of(const VolumeMarch *m, int x, int y, float d[3])
{
    for (int k = 0; k < 3; k++) d[k] = m->base[k] + (float)x * m->dx[k] + (float)y * m->dy[k];
}

static float within(float x)
{
    return !(x > 0) ? 0 : x > 1 ? 1 : x; // NaN: 0
}

static bool is_occupied(const VolumeMarch *m, const float at[3])
{
    int cell[3];
    for (int k = 0; k < 3; k++) {
        cell[k] = (int)(at[k] * (float)m->grid);
        if (cell[k] >= m->grid) cell[k] = m->grid - 1;
    }
    unsigned bit = ((unsigned)cell[2] * (unsigned)m->grid + (unsigned)cell[1]) * (unsigned)m->grid + (unsigned)cell[0];
    return m->occupied[bit / 32] >> bit % 32 & 1;
}

int fs_volume_march_ray(const VolumeMarch *m, int x, int y, const VolumePlaces *places)
{
    float d[3], offset = 0.5f, way[4][RADIANCE_SAMPLES_MOST]; // x, y, disparity in the cube; depth
    int n = 0;
    direction_of(m, x, y, d);
    if (m->jitter) {
        Rng rng = fs_rng_new(m->jitter ^ (uint64_t)y << 32 ^ (uint64_t)x << 8);
        offset = fs_rng_uniform(&rng);
    }
    const int steps = (m->samples + m->every - 1) / m->every;
    const float length = (float)m->every / (float)m->samples;
    for (int k = 0; k < steps; k++) { // without branches: a compiler makes vectors of it
        float s = ((float)k + offset) * length, z = m->near / (1 - s * m->closing), depth = m->origin[2] + z * d[2];
        float per = 1 / depth;
        way[0][k] = ((m->origin[0] + z * d[0]) * per - m->low[0]) * m->scale[0];
        way[1][k] = ((m->origin[1] + z * d[1]) * per - m->low[1]) * m->scale[1];
        way[2][k] = depth > 0 && depth < FLT_MAX ? (1 - m->near * per) / m->closing : -1e30f;
        way[3][k] = z;
    }
    for (int k = 0; k < steps; k++) {
        if (!(way[2][k] > -1e30f)) continue; // behind the cube's camera
        const float at[3] = {within(way[0][k]), within(way[1][k]), within(way[2][k])};
        if (!is_occupied(m, at)) continue;
        if (places) {
            for (int i = 0; i < 3; i++) places->at[i][n] = at[i];
            places->z[n] = way[3][k];
            places->s[n] = ((float)k + offset) * length;
        }
        n++;
    }
    return n;
}

void fs_volume_march_direction(const VolumeMarch *m, int px, int py, float out[RADIANCE_DIRECTION])
{
    float d[3];
    direction_of(m, px, py, d);
    float per = 1 / sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    float x = d[0] * per, y = d[1] * per, z = d[2] * per, xx = x * x, yy = y * y, zz = z * z;
    const float basis[RADIANCE_DIRECTION] = {
        0.28209479f,
        0.48860251f * y,
        0.48860251f * z,
        0.48860251f * x,
        1.09254843f * x * y,
        1.09254843f * y * z,
        0.31539157f * (3 * zz - 1),
        1.09254843f * x * z,
        0.54627422f * (xx - yy),
        0.59004359f * y * (3 * xx - yy),
        2.89061144f * x * y * z,
        0.45704580f * y * (5 * zz - 1),
        0.37317633f * z * (5 * zz - 3),
        0.45704580f * x * (5 * zz - 1),
        1.44530572f * z * (xx - yy),
        0.59004359f * x * (xx - 3 * yy),
    };
    memcpy(out, basis, sizeof basis);
}

// Thinner than the mean is empty too, so that the fog that fields begin as thins out.
void fs_volume_march_occupied(const Radiance *field, Volume volume, uint32_t *bits)
{
    size_t n, at = fs_radiance_at(&field->shape, volume, RADIANCE_GRID, &n);
    const float *thickness = field->x + at;
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += fmax((double)thickness[i], 0);
    float least = fminf(EMPTY, (float)(sum / (double)n));
    memset(bits, 0, (n + 31) / 32 * sizeof *bits);
    for (size_t i = 0; i < n; i++)
        if (thickness[i] < 0 || thickness[i] > least) bits[i / 32] |= 1u << i % 32;
}
