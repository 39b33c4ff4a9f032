#include "train/region.h"

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

// The cells that hang together with the first, of its value, get the value `to`; their number. edge: one is at the
// edge.
static int flood(Region *r, int first, unsigned char to, bool *edge)
{
    int stack[REGION_SIDE * REGION_SIDE], n = 1, count = 0;
    unsigned char from = r->in[first];
    stack[0] = first;
    r->in[first] = to;
    *edge = false;
    while (n) {
        int at = stack[--n], x = at % r->width, y = at / r->width;
        const int next[4][2] = {{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}};
        count++;
        for (int k = 0; k < 4; k++) {
            int nx = next[k][0], ny = next[k][1], i = ny * r->width + nx;
            bool out = nx < 0 || ny < 0 || nx >= r->width || ny >= r->height;
            *edge |= out;
            if (out || r->in[i] != from) continue;
            r->in[i] = to;
            stack[n++] = i;
        }
    }
    return count;
}

enum { OUT, IN, OUTSIDE, LOOKED_AT, KEPT, LEFT_OUT };

static bool any_above(const Region *r, const float *cells, unsigned char value, float least)
{
    for (int i = 0; i < r->width * r->height; i++)
        if (r->in[i] == value && mean(r, cells, i % r->width, i / r->width) > least) return true;
    return false;
}

void fs_region_find(Region *r, const float *cells, const RegionRule *rule)
{
    const int n = r->width * r->height;
    bool edge;
    for (int i = 0; i < n; i++) r->in[i] = mean(r, cells, i % r->width, i / r->width) > rule->threshold ? IN : OUT;
    fs_region_spread(r, IN, rule->gap);
    fs_region_spread(r, OUT, rule->gap);
    for (int i = 0; i < n; i++) {
        if (r->in[i] != OUT) continue;
        flood(r, i, OUTSIDE, &edge);
        if (!edge) flood(r, i, IN, &edge);
    }
    for (int i = 0; i < n; i++)
        if (r->in[i] == IN) {
            bool large = flood(r, i, LOOKED_AT, &edge) >= rule->least;
            flood(r, i, large && any_above(r, cells, LOOKED_AT, rule->sure) ? KEPT : LEFT_OUT, &edge);
        }
    for (int i = 0; i < n; i++) r->in[i] = r->in[i] == KEPT;
}

void fs_region_complete(Region *region, double upper, double height)
{
    int top = region->height, end = 0, left = region->width, right = -1, low[REGION_SIDE];
    for (int x = 0; x < region->width; x++) {
        low[x] = region->height;
        for (int y = 0; y < region->height; y++) {
            if (!region->in[y * region->width + x]) continue;
            low[x] = y;
            if (y < top) top = y;
            if (y >= end) end = y + 1;
            if (x < left) left = x;
            right = x;
        }
    }
    double width = right - left + 1, bottom = top + height * width;
    if (end - top > upper * width) return;
    for (int x = left; x <= right; x++)
        for (int y = low[x]; y < region->height && y < bottom; y++) region->in[y * region->width + x] = 1;
}
