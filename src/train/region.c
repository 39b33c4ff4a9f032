#include "train/region.h"

#include <math.h>
#include <stdlib.h>

static int held(int i, int n) // beyond the edge: the cell there
{
    return i < 0 ? 0 : i < n ? i : n - 1;
}

// Weights 1 2 1, each way.
static float mean(const Region *r, const float *cells, int x, int y)
{
    float sum = 0;
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++)
            sum +=
                (float)((2 - abs(i)) * (2 - abs(j))) * cells[held(y + j, r->height) * r->width + held(x + i, r->width)];
    return sum / 16;
}

void fs_region_spread(Region *r, unsigned char value, int radius)
{
    Region old = *r;
    for (int y = 0; y < r->height; y++)
        for (int x = 0; x < r->width; x++)
            for (int j = -radius; j <= radius; j++)
                for (int i = -radius; i <= radius; i++)
                    if (i * i + j * j <= radius * radius + 1 &&
                        old.in[held(y + j, r->height) * r->width + held(x + i, r->width)] == value)
                        r->in[y * r->width + x] = value;
}

// The cells that hang together with the first, of its value, get the value `to`; their number.
static int flood(Region *r, int first, unsigned char to)
{
    int stack[REGION_SIDE * REGION_SIDE], n = 1, count = 0;
    unsigned char from = r->in[first];
    stack[0] = first;
    r->in[first] = to;
    while (n) {
        int at = stack[--n], x = at % r->width, y = at / r->width;
        const int next[4][2] = {{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}};
        count++;
        for (int k = 0; k < 4; k++) {
            int nx = next[k][0], ny = next[k][1], i = ny * r->width + nx;
            if (nx < 0 || ny < 0 || nx >= r->width || ny >= r->height || r->in[i] != from) continue;
            r->in[i] = to;
            stack[n++] = i;
        }
    }
    return count;
}

enum { OUT, IN, LOOKED_AT, KEPT, LEFT_OUT };
enum { BESIDE = 1, AROUND = 4 };     // cells from a region to what is around it
enum { PARTS_MOST = 64, STRIP = 3 }; // so many times as wide as high

// The mean of a region's cells less the mean around it.
static float contrast(const Region *r, const float *cells, unsigned char value)
{
    Region beside = *r, around = *r;
    double in = 0, out = 0, n_in = 0, n_out = 0;
    fs_region_spread(&beside, value, BESIDE);
    fs_region_spread(&around, value, AROUND);
    for (int i = 0; i < r->width * r->height; i++) {
        if (r->in[i] == value) in += (double)cells[i], n_in++;
        if (around.in[i] == value && beside.in[i] != value && cells[i] > 0) out += (double)cells[i], n_out++;
    }
    return (float)(in / fmax(n_in, 1) - out / fmax(n_out, 1));
}

// All n cells of a line from the first of the value to the last get it. True: there were others between.
static bool fill_line(unsigned char *line, int n, int stride, unsigned char value)
{
    int first = 0, last = n - 1;
    bool any = false;
    while (first < n && line[first * stride] != value) first++;
    while (last > first && line[last * stride] != value) last--;
    for (int i = first; i < last; i++) {
        any |= line[i * stride] != value;
        line[i * stride] = value;
    }
    return any;
}

static void fill(Region *r, unsigned char value)
{
    for (bool any = true; any;) {
        any = false;
        for (int y = 0; y < r->height; y++) any |= fill_line(r->in + y * r->width, r->width, 1, value);
        for (int x = 0; x < r->width; x++) any |= fill_line(r->in + x, r->height, r->width, value);
    }
}

typedef struct Part { // cells that hang together
    int first, left, right, top, bottom;
    double sum; // of its cells' values
} Part;

static Part part_of(const Region *r, const float *cells, unsigned char value)
{
    Part part = {.first = -1, .left = r->width, .right = -1, .bottom = -1};
    for (int i = 0; i < r->width * r->height; i++) {
        if (r->in[i] != value) continue;
        if (part.first < 0) part.first = i, part.top = i / r->width;
        part.bottom = i / r->width;
        part.left = i % r->width < part.left ? i % r->width : part.left;
        part.right = i % r->width > part.right ? i % r->width : part.right;
        part.sum += (double)cells[i];
    }
    return part;
}

// A figure stands upright: a strip that reaches farther to a side than half the width of its largest part is none of
// it.
static void leave_one(Region *r, const Part *part, int n)
{
    int main = 0;
    for (int i = 1; i < n; i++)
        if (part[i].sum > part[main].sum) main = i;
    int reach = n ? (part[main].right - part[main].left + 2) / 2 : 0;
    for (int i = 0; i < n; i++) {
        bool beyond = part[i].left < part[main].left - reach || part[i].right > part[main].right + reach;
        int width = part[i].right - part[i].left + 1, height = part[i].bottom - part[i].top + 1;
        if (beyond && width > STRIP * height) flood(r, part[i].first, LEFT_OUT);
    }
}

void fs_region_find(Region *r, const float *cells, const RegionRule *rule)
{
    Part part[PARTS_MOST];
    int parts = 0;
    const int n = r->width * r->height;
    for (int i = 0; i < n; i++) r->in[i] = mean(r, cells, i % r->width, i / r->width) > rule->threshold ? IN : OUT;
    fs_region_spread(r, IN, rule->gap);
    fs_region_spread(r, OUT, rule->gap);
    for (int i = 0; i < n; i++) {
        if (r->in[i] != IN) continue;
        bool keep = flood(r, i, LOOKED_AT) >= rule->least && contrast(r, cells, LOOKED_AT) >= rule->stands_out;
        if (keep && rule->one && parts < PARTS_MOST) part[parts++] = part_of(r, cells, LOOKED_AT);
        if (keep && !rule->one) fill(r, LOOKED_AT);
        for (int k = 0; k < n; k++)
            if (r->in[k] == LOOKED_AT) r->in[k] = keep ? KEPT : LEFT_OUT;
    }
    if (rule->one) {
        leave_one(r, part, parts);
        fill(r, KEPT);
    }
    for (int i = 0; i < n; i++) r->in[i] = r->in[i] == KEPT;
}

double fs_region_clarity(const float *cells, const bool *seen)
{
    enum { BLOCK = 4, BLOCKS = REGION_SIDE / BLOCK };
    double value[BLOCKS * BLOCKS] = {0}, n[BLOCKS * BLOCKS] = {0}, sum = 0, squares = 0, all = 0;
    for (int i = 0; i < REGION_SIDE * REGION_SIDE; i++) {
        int at = i / REGION_SIDE / BLOCK * BLOCKS + i % REGION_SIDE / BLOCK;
        value[at] += (double)cells[i];
        n[at] += seen[i];
    }
    for (int i = 0; i < BLOCKS * BLOCKS; i++) {
        if (n[i] <= 0) continue;
        sum += value[i];
        squares += value[i] * value[i] / n[i];
        all += n[i];
    }
    return all > 0 ? squares - sum * sum / all : 0;
}

static void turn_over(Region *r)
{
    for (int y = 0; y < r->height / 2; y++)
        for (int x = 0; x < r->width; x++) {
            unsigned char *a = r->in + y * r->width + x, *b = r->in + (r->height - 1 - y) * r->width + x, was = *a;
            *a = *b;
            *b = was;
        }
}

void fs_region_complete(Region *region, double height, bool upwards)
{
    if (upwards) turn_over(region);
    int top = region->height, left = region->width, right = -1, low[REGION_SIDE];
    for (int x = 0; x < region->width; x++) {
        low[x] = region->height;
        for (int y = 0; y < region->height; y++) {
            if (!region->in[y * region->width + x]) continue;
            low[x] = y;
            if (y < top) top = y;
            if (x < left) left = x;
            right = x;
        }
    }
    double width = right - left + 1, bottom = top + height * width;
    for (int x = left; x <= right; x++)
        for (int y = low[x]; y < region->height && y < bottom; y++) region->in[y * region->width + x] = 1;
    if (upwards) turn_over(region);
}
