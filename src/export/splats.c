#include "export/splats.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/order.h"

enum { ARRAYS = 5 };
static const int width_of[ARRAYS] = {3, 3, 4, 1, 3};

static float **array_of(Splats *splats, int a)
{
    float **const arrays[ARRAYS] = {&splats->mean, &splats->scale, &splats->rotation, &splats->opacity, &splats->srgb};
    return arrays[a];
}

void fs_splats_free(Splats *splats)
{
    for (int a = 0; a < ARRAYS; a++) free(*array_of(splats, a));
    *splats = (Splats){0};
}

static int allocate(Splats *splats, int n, FsError *err)
{
    *splats = (Splats){0};
    for (int a = 0; a < ARRAYS; a++) {
        *array_of(splats, a) = malloc(sizeof(float) * ((size_t)n + 1) * (size_t)width_of[a]);
        if (*array_of(splats, a)) continue;
        fs_splats_free(splats);
        return fs_error_memory(err);
    }
    splats->n = n;
    return 0;
}

static bool are_finite(const float *v, int n)
{
    for (int k = 0; k < n; k++)
        if (!isfinite(v[k])) return false;
    return true;
}

static bool is_sound(const float *const field[ARRAYS])
{
    for (int a = 0; a < ARRAYS; a++)
        if (!are_finite(field[a], width_of[a])) return false;
    for (int k = 0; k < 3; k++)
        if (fabsf(field[1][k]) > FS_SPLATS_SCALE) return false;
    return true;
}

static void make_unit(const float quat[4], float unit[4])
{
    double n = 0;
    for (int k = 0; k < 4; k++) n += (double)quat[k] * (double)quat[k];
    for (int k = 0; k < 4; k++) unit[k] = n > 0 ? (float)(quat[k] / sqrt(n)) : (k == 0 ? 1.0f : 0.0f);
}

static float farthest_coordinate(const float mean[3])
{
    return fmaxf(fmaxf(fabsf(mean[0]), fabsf(mean[1])), fabsf(mean[2]));
}

int fs_splats_reach(const Splats *splats, double share, double *reach, FsError *err)
{
    *reach = 0;
    if (splats->n == 0) return 0;
    float *farthest = malloc(sizeof(float) * (size_t)splats->n);
    if (!farthest) return fs_error_memory(err);
    for (size_t i = 0; i < (size_t)splats->n; i++) farthest[i] = farthest_coordinate(splats->mean + 3 * i);
    fs_order_floats(farthest, (size_t)splats->n);
    *reach = (double)farthest[(size_t)(share * (splats->n - 1))];
    free(farthest);
    return 0;
}

int fs_splats_spread(const Splats *splats, double share, double *spread, FsError *err)
{
    size_t n = (size_t)splats->n, tail = (size_t)ceil(0.5 * (1 - share) * fmax(splats->n - 1, 0));
    *spread = 0;
    if (n == 0) return 0;
    float *along = malloc(sizeof(float) * n);
    if (!along) return fs_error_memory(err);
    for (size_t a = 0; a < 3; a++) {
        for (size_t i = 0; i < n; i++) along[i] = splats->mean[3 * i + a];
        fs_order_floats(along, n);
        *spread = fmax(*spread, 0.5 * ((double)along[n - 1 - tail] - (double)along[tail]));
    }
    free(along);
    return 0;
}

static void put(Splats *splats, size_t at, const float *const field[ARRAYS])
{
    for (int a = 0; a < ARRAYS; a++)
        memmove(*array_of(splats, a) + at * (size_t)width_of[a], field[a], sizeof(float) * (size_t)width_of[a]);
}

static int drop_far(Splats *splats, FsError *err)
{
    double reach;
    size_t kept = 0;
    MUST(fs_splats_reach(splats, 0.9, &reach, err));
    for (size_t i = 0; i < (size_t)splats->n; i++) {
        const float *const field[ARRAYS] = {splats->mean + 3 * i, splats->scale + 3 * i, splats->rotation + 4 * i,
                                            splats->opacity + i, splats->srgb + 3 * i};
        if ((double)farthest_coordinate(field[0]) <= FS_SPLATS_FAR * reach) put(splats, kept++, field);
    }
    splats->n = (int)kept;
    return 0;
}

int fs_splats_make(const Cloud *cloud, const float *srgb, Splats *splats, FsError *err)
{
    MUST(allocate(splats, cloud->n, err));
    splats->n = 0;
    for (size_t i = 0; i < (size_t)cloud->n; i++) {
        const float *const field[ARRAYS] = {cloud->field[CLOUD_MEANS] + 3 * i, cloud->field[CLOUD_SCALES] + 3 * i,
                                            cloud->field[CLOUD_QUATS] + 4 * i, cloud->field[CLOUD_OPACITIES] + i,
                                            srgb + 3 * i};
        if (!is_sound(field)) continue;
        put(splats, (size_t)splats->n, field);
        make_unit(field[2], splats->rotation + 4 * (size_t)splats->n);
        splats->n++;
    }
    int rc = drop_far(splats, err);
    if (rc < 0) fs_splats_free(splats);
    return rc;
}

void fs_splats_turn(Splats *splats)
{
    for (size_t i = 0; i < (size_t)splats->n; i++)
        for (size_t k = 1; k < 3; k++) {
            splats->mean[3 * i + k] *= -1;
            splats->rotation[4 * i + k + 1] *= -1; // an ellipsoid may be turned about its own axis as well
        }
    for (int k = 0; k < 4; k++)
        for (int a = 1; a < 3; a++) splats->pane[k][a] *= -1;
}

// Half a turn about a unit axis after a rotation: the product of quaternions (0, axis) and q.
static void half_turn(const double axis[3], float q[4])
{
    double w = q[0], x = q[1], y = q[2], z = q[3];
    q[0] = (float)-(axis[0] * x + axis[1] * y + axis[2] * z);
    q[1] = (float)(w * axis[0] + axis[1] * z - axis[2] * y);
    q[2] = (float)(w * axis[1] + axis[2] * x - axis[0] * z);
    q[3] = (float)(w * axis[2] + axis[0] * y - axis[1] * x);
}

void fs_splats_mirror(Splats *splats, const double normal[3], double distance)
{
    size_t kept = 0;
    for (size_t i = 0; i < (size_t)splats->n; i++) {
        const float *mean = splats->mean + 3 * i;
        double behind = -distance, at[3], most = 0;
        for (int a = 0; a < 3; a++) behind += normal[a] * (double)mean[a];
        for (int a = 0; a < 3; a++) {
            at[a] = (double)mean[a] - 2 * behind * normal[a];
            most = fabs(at[a]) > most || isnan(at[a]) ? fabs(at[a]) : most;
        }
        if (!(most <= (double)FLT_MAX)) continue;
        const float mirrored[3] = {(float)at[0], (float)at[1], (float)at[2]};
        half_turn(normal, splats->rotation + 4 * i); // the reflection is it, times -1, which an ellipsoid does not show
        const float *const field[ARRAYS] = {mirrored, splats->scale + 3 * i, splats->rotation + 4 * i,
                                            splats->opacity + i, splats->srgb + 3 * i};
        put(splats, kept++, field);
    }
    splats->n = (int)kept;
}

// ---- order ----

void fs_splats_range(const float *value, int n, float range[2])
{
    range[0] = range[1] = n ? value[0] : 0;
    for (size_t i = 0; i < (size_t)n; i++) {
        float v = value[3 * i];
        if (v < range[0]) range[0] = v;
        if (v > range[1]) range[1] = v;
    }
}

double fs_splats_opacity(const Splats *splats, size_t i)
{
    return 1.0 / (1.0 + exp(-(double)splats->opacity[i]));
}

static double invisibility(const Splats *splats, size_t i)
{
    const float *s = splats->scale + 3 * i;
    return -exp((double)s[0] + (double)s[1] + (double)s[2]) * fs_splats_opacity(splats, i);
}

// The bits of three numbers of 17 bits, in turn: exact as a double.
static double place_on_curve(const Splats *splats, size_t i, double reach)
{
    double code = 0;
    unsigned at[3];
    for (size_t a = 0; a < 3; a++)
        at[a] = fs_splats_level(reach > 0 ? ((double)splats->mean[3 * i + a] / reach + 1) * 65535.5 : 0, 131071);
    for (int bit = 16; bit >= 0; bit--)
        for (int a = 2; a >= 0; a--) code = 2 * code + (at[a] >> bit & 1);
    return code;
}

int fs_splats_sort(Splats *splats, SplatsOrder order, FsError *err)
{
    if (order == SPLATS_AS_TRAINED || splats->n == 0) return 0;
    size_t n = (size_t)splats->n;
    Ranked *rank = malloc(sizeof *rank * n);
    float *values = malloc(sizeof(float) * 4 * n);
    double reach;
    int rc = 0;
    if (!rank || !values) TRY(fs_error_memory(err));
    TRY(fs_splats_reach(splats, 0.999, &reach, err));
    for (size_t i = 0; i < n; i++)
        rank[i] =
            (Ranked){order == SPLATS_BY_PLACE ? place_on_curve(splats, i, reach) : invisibility(splats, i), (int)i};
    fs_order_ranked(rank, n);
    for (int a = 0; a < ARRAYS; a++) {
        size_t width = (size_t)width_of[a];
        float *array = *array_of(splats, a);
        memcpy(values, array, sizeof(float) * width * n);
        for (size_t k = 0; k < n; k++)
            memcpy(array + width * k, values + width * (size_t)rank[k].index, sizeof(float) * width);
    }
fail:
    free(rank);
    free(values);
    return rc;
}

int fs_splats_smallest_three(const float rotation[4], float others[3])
{
    int largest = 0;
    for (int k = 1; k < 4; k++)
        if (fabsf(rotation[k]) > fabsf(rotation[largest])) largest = k;
    for (int k = 0, to = 0; k < 4; k++)
        if (k != largest) others[to++] = rotation[largest] < 0 ? -rotation[k] : rotation[k];
    return largest;
}
