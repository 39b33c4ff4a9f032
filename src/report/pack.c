#include "report/pack.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "base/order.h"
#include "kernels/raster.h"

#define LARGE 32768 // Gaussians: smaller ones, and their order along the curve says more of their places
#define SPREAD 12.0 // of sizes, natural logarithms: smaller ones are drawn as the smallest
#define TURNS 24    // of a cube into itself

// ---- turns ----

typedef struct Turn {
    double q[4]; // w x y z
    int axis[3]; // which old axis becomes the k-th
} Turn;

static void multiply(const double a[4], const double b[4], double out[4])
{
    out[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    out[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    out[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    out[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}

// The axis that the turn takes e_k to: the largest entry of the matrix's column.
static int axis_of(const double q[4], int k)
{
    double e[4] = {0}, conjugate[4] = {q[0], -q[1], -q[2], -q[3]}, half[4], to[4];
    e[1 + k] = 1;
    multiply(q, e, half);
    multiply(half, conjugate, to);
    int best = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(to[1 + i]) > fabs(to[1 + best])) best = i;
    return best;
}

// All quaternions of 0, 1 or of 1, 1 or of 1, 1, 1, 1 over their length, with one sign of each pair.
static void make_turns(Turn turn[TURNS])
{
    int n = 0;
    for (int code = 0; code < 81; code++) {
        double q[4];
        int digits = code, count = 0, first = 0;
        for (int k = 0; k < 4; k++, digits /= 3) {
            q[k] = digits % 3 - 1;
            count += q[k] != 0;
            if (!first) first = (int)q[k];
        }
        if (first < 1 || count == 3) continue;
        for (int k = 0; k < 4; k++) turn[n].q[k] = q[k] / sqrt(count);
        for (int k = 0; k < 3; k++) turn[n].axis[k] = axis_of(turn[n].q, k);
        n++;
    }
}

// The same Gaussian with its axes in the order that needs the smallest turn.
static void smallest_turn(const Turn turn[TURNS], const float *quat, const float *scale, double q[4], double size[3])
{
    double given[4], product[4];
    int best = 0;
    for (int k = 0; k < 4; k++) given[k] = (double)quat[k], q[k] = -1;
    for (int t = 0; t < TURNS; t++) {
        multiply(given, turn[t].q, product);
        double sign = product[0] < 0 ? -1 : 1;
        if (sign * product[0] <= q[0]) continue;
        for (int k = 0; k < 4; k++) q[k] = sign * product[k];
        best = t;
    }
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; k++) q[k] = length > 0 ? q[k] / length : k == 0;
    for (int k = 0; k < 3; k++) size[k] = (double)scale[turn[best].axis[k]];
}

// ---- numbers ----

static double opacity_of(const Cloud *cloud, int i)
{
    return 1 / (1 + exp(-(double)cloud->field[CLOUD_OPACITIES][i]));
}

static bool is_drawn(const Cloud *cloud, int i)
{
    return log2(opacity_of(cloud, i)) > (double)FS_T_MIN;
}

static unsigned number(double value, const PackRange *range)
{
    double most = (1 << range->bits) - 1, span = range->high - range->low;
    double q = span > 0 ? (value - range->low) / span * most : 0;
    return (unsigned)fmax(0, fmin(most, floor(q + 0.5)));
}

static PackRange range_of(const float *x, size_t n, int bits)
{
    PackRange range = {n ? INFINITY : 0, n ? -INFINITY : 0, bits};
    for (size_t i = 0; i < n; i++) {
        range.low = fmin(range.low, (double)x[i]);
        range.high = fmax(range.high, (double)x[i]);
    }
    return range;
}

static double warped(const Pack *pack, const Cloud *cloud, int i, int axis)
{
    double d = (double)cloud->field[CLOUD_MEANS][3 * (size_t)i + (size_t)axis] - pack->centre[axis];
    return copysign(log1p(fabs(d) / pack->reach), d);
}

// ---- order ----

typedef struct Seat { // a Gaussian's place on the curve
    uint64_t code;
    int index;
    uint16_t at[3];
} Seat;

static int by_code(const void *a, const void *b)
{
    const Seat *x = a, *y = b;
    return x->code != y->code ? (x->code < y->code ? -1 : 1) : x->index - y->index;
}

static void choose_reach(Pack *pack, const Cloud *cloud, double *distance)
{
    for (int i = 0; i < cloud->n; i++) {
        double sum = 0;
        for (int k = 0; k < 3; k++) {
            double d = (double)cloud->field[CLOUD_MEANS][3 * (size_t)i + (size_t)k] - pack->centre[k];
            sum += d * d;
        }
        distance[i] = sqrt(sum);
    }
    pack->reach = fmax(fs_order_median(distance, (size_t)cloud->n) / 2, 1e-9);
}

static void choose_step(Pack *pack, const Cloud *cloud)
{
    double widest = 0;
    for (int k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (int i = 0; i < cloud->n; i++) {
            low = fmin(low, warped(pack, cloud, i, k));
            high = fmax(high, warped(pack, cloud, i, k));
        }
        pack->low[k] = cloud->n ? low : 0;
        widest = fmax(widest, cloud->n ? high - low : 0);
    }
    pack->step = widest / ((1 << pack->bits) - 1);
}

static void seat_all(Pack *pack, const Cloud *cloud, Seat *seat)
{
    for (int i = 0; i < cloud->n; i++) {
        if (!is_drawn(cloud, i)) continue;
        Seat *s = &seat[pack->n++];
        *s = (Seat){.index = i};
        for (int k = 0; k < 3; k++) {
            double at = pack->step > 0 ? floor((warped(pack, cloud, i, k) - pack->low[k]) / pack->step + 0.5) : 0;
            s->at[k] = (uint16_t)at;
            for (int b = 0; b < pack->bits; b++) s->code |= (uint64_t)(s->at[k] >> b & 1) << (3 * b + k);
        }
    }
    qsort(seat, (size_t)pack->n, sizeof *seat, by_code);
}

// ---- planes ----

static unsigned char *plane(const Pack *pack, int p)
{
    return pack->byte + (size_t)p * (size_t)pack->n;
}

static void put_places(const Pack *pack, const Seat *seat)
{
    int last[3] = {0};
    for (int i = 0; i < pack->n; i++)
        for (int k = 0; k < 3; k++) {
            int d = seat[i].at[k] - last[k];
            unsigned zigzag = d < 0 ? 2u * (unsigned)-d - 1 : 2u * (unsigned)d;
            plane(pack, 2 * k)[i] = (unsigned char)(zigzag >> 8);
            plane(pack, 2 * k + 1)[i] = (unsigned char)zigzag;
            last[k] = seat[i].at[k];
        }
}

static void put_shapes(const Pack *pack, const Cloud *cloud, const Seat *seat)
{
    Turn turn[TURNS];
    make_turns(turn);
    for (int i = 0; i < pack->n; i++) {
        size_t j = (size_t)seat[i].index;
        double q[4], size[3];
        smallest_turn(turn, cloud->field[CLOUD_QUATS] + 4 * j, cloud->field[CLOUD_SCALES] + 3 * j, q, size);
        for (int k = 0; k < 3; k++) plane(pack, 6 + k)[i] = (unsigned char)number(size[k], &pack->size);
        for (int k = 0; k < 3; k++) plane(pack, 9 + k)[i] = (unsigned char)number(q[1 + k], &pack->turn);
    }
}

static void put_looks(const Pack *pack, const Cloud *cloud, const Seat *seat)
{
    for (int i = 0; i < pack->n; i++) {
        size_t j = (size_t)seat[i].index;
        const float *color = cloud->field[CLOUD_COLORS] + j * (size_t)pack->colors;
        unsigned c[3];
        plane(pack, 12)[i] = (unsigned char)number(sqrt(opacity_of(cloud, (int)j)), &pack->opacity);
        for (int k = 0; k < pack->colors; k++) c[k] = number((double)color[k], &pack->color);
        plane(pack, 13)[i] = (unsigned char)c[pack->colors == 3];
        if (pack->colors == 3) { // of 8 bits at most, so that a difference is one byte
            plane(pack, 14)[i] = (unsigned char)(c[0] - c[1]);
            plane(pack, 15)[i] = (unsigned char)(c[2] - c[1]);
        }
        if (pack->gains)
            plane(pack, 13 + pack->colors)[i] =
                (unsigned char)number((double)cloud->field[CLOUD_GAINS][j], &pack->gain);
        if (pack->covers)
            plane(pack, 13 + pack->colors + pack->gains)[i] =
                (unsigned char)number((double)cloud->field[CLOUD_COVERS][j], &pack->cover);
    }
}

int fs_pack_cloud(const Cloud *cloud, const double centre[3], Pack *pack, FsError *err)
{
    bool large = cloud->n >= LARGE;
    size_t n = (size_t)cloud->n;
    *pack = (Pack){.bits = large ? 14 : 13,
                   .turn = {-FS_PACK_TURN, FS_PACK_TURN, large ? 6 : 5},
                   .opacity = {0, 1, large ? 7 : 6},
                   .colors = cloud->width[CLOUD_COLORS],
                   .gains = cloud->width[CLOUD_GAINS],
                   .covers = cloud->width[CLOUD_COVERS],
                   .cover = {0, 1, 6}};
    for (int k = 0; k < 3; k++) pack->centre[k] = centre[k];
    Seat *seat = malloc(sizeof *seat * (n + 1));
    double *distance = malloc(sizeof *distance * (n + 1));
    int rc = seat && distance ? 0 : fs_error_memory(err);
    if (rc < 0) goto fail;
    pack->size = range_of(cloud->field[CLOUD_SCALES], 3 * n, 6);
    pack->size.low = fmax(pack->size.low, pack->size.high - SPREAD);
    pack->color = range_of(cloud->field[CLOUD_COLORS], n * (size_t)pack->colors, 7);
    if (pack->gains) pack->gain = range_of(cloud->field[CLOUD_GAINS], n, 6);
    choose_reach(pack, cloud, distance);
    choose_step(pack, cloud);
    seat_all(pack, cloud, seat);
    pack->planes = 13 + pack->colors + pack->gains + pack->covers;
    pack->byte = malloc((size_t)pack->planes * (size_t)pack->n + 1);
    if (!pack->byte) TRY(fs_error_memory(err));
    put_places(pack, seat);
    put_shapes(pack, cloud, seat);
    put_looks(pack, cloud, seat);
fail:
    free(seat);
    free(distance);
    return rc;
}

void fs_pack_free(Pack *pack)
{
    free(pack->byte);
    *pack = (Pack){0};
}
