// Built top-down by the surface area heuristic over bins: a node is cut in two, and each half in two again.
#include "synth/bvh.h"

#include <stdlib.h>
#include <string.h>

#define BINS 12
#define LEAF 3
#define DEPTH 40
#define STACK (3 * DEPTH + 4)

typedef struct Bounds {
    float low[3], high[3];
} Bounds;

static const Bounds nowhere = {{1e30f, 1e30f, 1e30f}, {-1e30f, -1e30f, -1e30f}};

static void grow(Bounds *b, const Bounds *by)
{
    for (int k = 0; k < 3; k++) {
        b->low[k] = by->low[k] < b->low[k] ? by->low[k] : b->low[k];
        b->high[k] = by->high[k] > b->high[k] ? by->high[k] : b->high[k];
    }
}

static float half_area(const Bounds *b)
{
    float x = b->high[0] - b->low[0], y = b->high[1] - b->low[1], z = b->high[2] - b->low[2];
    return x < 0 ? 0.0f : x * y + y * z + z * x;
}

static Bounds shape_bounds(const PrimShape *s)
{
    Vec p[4] = {s->corner, vec_add(s->corner, s->edge_a), vec_add(s->corner, s->edge_b), s->corner};
    if (!s->triangle) p[3] = vec_add(p[1], s->edge_b);
    Bounds b = nowhere;
    for (int i = 0; i < 4; i++) {
        Bounds q = {{p[i].x - 1e-5f, p[i].y - 1e-5f, p[i].z - 1e-5f}, {p[i].x + 1e-5f, p[i].y + 1e-5f, p[i].z + 1e-5f}};
        grow(&b, &q);
    }
    return b;
}

typedef struct Item {
    Bounds bounds;
    float centre[3];
    int shape;
} Item;

// The best cut of items into two by centre along an axis; returns false where a leaf is better.
static bool choose_split(const Item *item, int n, const Bounds *bounds, int *axis, float *at)
{
    Bounds centres = nowhere;
    for (int i = 0; i < n; i++) {
        Bounds c;
        memcpy(c.low, item[i].centre, sizeof c.low);
        memcpy(c.high, item[i].centre, sizeof c.high);
        grow(&centres, &c);
    }
    float best = (float)n * half_area(bounds);
    bool found = false;
    for (int k = 0; k < 3; k++) {
        float low = centres.low[k], width = centres.high[k] - low;
        if (!(width > 1e-6f)) continue;
        Bounds bin[BINS], right = nowhere, left = nowhere;
        int count[BINS] = {0}, n_left = 0, n_right = 0;
        float right_cost[BINS] = {0};
        for (int i = 0; i < BINS; i++) bin[i] = nowhere;
        for (int i = 0; i < n; i++) {
            int b = (int)((item[i].centre[k] - low) / width * (BINS * 0.9999f));
            grow(&bin[b], &item[i].bounds);
            count[b]++;
        }
        for (int b = BINS - 1; b > 0; b--) {
            grow(&right, &bin[b]);
            n_right += count[b];
            right_cost[b] = (float)n_right * half_area(&right);
        }
        for (int b = 1; b < BINS; b++) {
            grow(&left, &bin[b - 1]);
            n_left += count[b - 1];
            float cost = 0.6f * half_area(bounds) + (float)n_left * half_area(&left) + right_cost[b];
            if (n_left > 0 && n_left < n && cost < best) {
                best = cost;
                *axis = k;
                *at = low + width * (float)b / (BINS * 0.9999f);
                found = true;
            }
        }
    }
    return found;
}

static int partition(Item *item, int n, int axis, float at)
{
    int left = 0;
    for (int i = 0; i < n; i++)
        if (item[i].centre[axis] < at) {
            Item t = item[left];
            item[left++] = item[i];
            item[i] = t;
        }
    return left;
}

typedef struct Part {
    int first, n;
    Bounds bounds;
} Part;

static Bounds bounds_of(const Item *item, int n)
{
    Bounds bounds = nowhere;
    for (int i = 0; i < n; i++) grow(&bounds, &item[i].bounds);
    return bounds;
}

// Cuts part[0] in two where that pays; the second half goes to *other.
static bool cut_part(Item *item, Part *part, Part *other)
{
    int axis, left;
    float cut;
    if (part->n < 2 || !choose_split(item + part->first, part->n, &part->bounds, &axis, &cut)) return false;
    left = partition(item + part->first, part->n, axis, cut);
    if (left <= 0 || left >= part->n) return false;
    *other = (Part){part->first + left, part->n - left, bounds_of(item + part->first + left, part->n - left)};
    *part = (Part){part->first, left, bounds_of(item + part->first, left)};
    return true;
}

static void build(Bvh *bvh, int at, Item *item, Part whole, int depth)
{
    Part part[4] = {whole};
    int n = 1;
    if (cut_part(item, &part[0], &part[2])) {
        n = cut_part(item, &part[0], &part[1]) ? 2 : 1;
        if (n == 1) part[1] = part[2];
        n = n + 1;
        if (cut_part(item, &part[n - 1], &part[n])) n++;
    }
    BvhNode *node = &bvh->node[at];
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++) {
            node->low[k][i] = i < n ? part[i].bounds.low[k] : 1e30f;
            node->high[k][i] = i < n ? part[i].bounds.high[k] : 1e30f;
        }
    for (int i = 0; i < n; i++) {
        bool leaf = part[i].n <= LEAF || depth >= DEPTH - 1 || n == 1;
        node->first[i] = leaf ? part[i].first : bvh->n_nodes;
        node->count[i] = leaf ? part[i].n : 0;
        if (!leaf) build(bvh, bvh->n_nodes++, item, part[i], depth + 1);
        node = &bvh->node[at];
    }
}

int fs_bvh_build(Bvh *bvh, const PrimShape *shape, int n)
{
    *bvh = (Bvh){.n = n, .n_nodes = 1};
    Item *item = malloc((size_t)(n > 0 ? n : 1) * sizeof *item);
    bvh->shape = malloc((size_t)(n > 0 ? n : 1) * sizeof *bvh->shape);
    bvh->node = malloc((size_t)(2 * n + 1) * sizeof *bvh->node);
    if (!item || !bvh->shape || !bvh->node) {
        free(item);
        fs_bvh_free(bvh);
        return -1;
    }
    for (int i = 0; i < n; i++) {
        item[i].bounds = shape_bounds(&shape[i]);
        for (int k = 0; k < 3; k++) item[i].centre[k] = 0.5f * (item[i].bounds.low[k] + item[i].bounds.high[k]);
        item[i].shape = i;
    }
    build(bvh, 0, item, (Part){0, n, bounds_of(item, n)}, 0);
    for (int i = 0; i < n; i++) bvh->shape[i] = shape[item[i].shape];
    free(item);
    return 0;
}

void fs_bvh_free(Bvh *bvh)
{
    free(bvh->node);
    free(bvh->shape);
    *bvh = (Bvh){0};
}

typedef int FourMask __attribute__((vector_size(16)));

static inline Four choose(FourMask mask, Four a, Four b) // a where the mask is set
{
    return (Four)(((FourMask)a & mask) | ((FourMask)b & ~mask));
}

static inline Four smaller(Four a, Four b)
{
    return choose(a < b, a, b);
}

static inline Four larger(Four a, Four b)
{
    return choose(a > b, a, b);
}

static inline Four all(float x)
{
    return (Four){x, x, x, x};
}

// Where the ray enters each of the four boxes; huge where it misses the box before t_max.
static inline Four enter(const BvhNode *n, Vec o, Vec inv, float t_max)
{
    Four x0 = (n->low[0] - o.x) * inv.x, x1 = (n->high[0] - o.x) * inv.x;
    Four y0 = (n->low[1] - o.y) * inv.y, y1 = (n->high[1] - o.y) * inv.y;
    Four z0 = (n->low[2] - o.z) * inv.z, z1 = (n->high[2] - o.z) * inv.z;
    Four near = larger(larger(smaller(x0, x1), smaller(y0, y1)), larger(smaller(z0, z1), all(0.0f)));
    Four far = smaller(smaller(larger(x0, x1), larger(y0, y1)), smaller(larger(z0, z1), all(t_max)));
    return choose(near <= far, near, all(1e30f));
}

static inline Vec inverse(Vec d)
{
    return vec(1.0f / (fabsf(d.x) > 1e-9f ? d.x : 1e-9f), 1.0f / (fabsf(d.y) > 1e-9f ? d.y : 1e-9f),
               1.0f / (fabsf(d.z) > 1e-9f ? d.z : 1e-9f));
}

// Fills in *hit where there is one.
static inline bool hit_shape(const PrimShape *s, Vec o, Vec d, float t_min, float t_max, Hit *hit)
{
    Vec p = vec_cross(d, s->edge_b);
    float det = vec_dot(s->edge_a, p);
    if (fabsf(det) < 1e-12f) return false;
    float inv = 1.0f / det;
    Vec q = vec_sub(o, s->corner);
    float a = vec_dot(q, p) * inv;
    if (a < 0.0f || a > 1.0f) return false;
    Vec r = vec_cross(q, s->edge_a);
    float b = vec_dot(d, r) * inv;
    if (b < 0.0f || (s->triangle ? a + b : b) > 1.0f) return false;
    float t = vec_dot(s->edge_b, r) * inv;
    if (!(t > t_min && t < t_max)) return false;
    *hit = (Hit){t, a, b, s->number};
    return true;
}

bool fs_bvh_hit_shape(const PrimShape *shape, Vec o, Vec d, Hit *hit)
{
    return hit_shape(shape, o, d, 0.0f, hit->t, hit);
}

typedef struct Todo {
    float entry;
    int first, count;
} Todo;

// Puts the children that the ray meets on the stack, the nearest on top.
static inline int push_children(const BvhNode *node, Four entry, Todo *stack, int top)
{
    int base = top;
    for (int i = 0; i < 4; i++) {
        if (entry[i] > 1e29f) continue;
        int at = top++;
        for (; at > base && stack[at - 1].entry < entry[i]; at--) stack[at] = stack[at - 1];
        stack[at] = (Todo){entry[i], node->first[i], node->count[i]};
    }
    return top;
}

// The nearest hit with t in (t_min, hit->t), or any, of shapes without a flag of ignore.
static inline bool walk(const Bvh *bvh, Vec o, Vec d, float t_min, int ignore, bool any, Hit *hit)
{
    Todo stack[STACK];
    int top = 0;
    Vec inv = inverse(d);
    hit->prim = -1;
    if (bvh->n > 0) stack[top++] = (Todo){0, 0, 0};
    while (top > 0) {
        Todo now = stack[--top];
        if (now.entry >= hit->t) continue;
        if (now.count == 0) {
            const BvhNode *node = &bvh->node[now.first];
            top = push_children(node, enter(node, o, inv, hit->t), stack, top);
            continue;
        }
        for (int i = 0; i < now.count; i++) {
            const PrimShape *s = &bvh->shape[now.first + i];
            if (!(s->flags & ignore) && hit_shape(s, o, d, t_min, hit->t, hit) && any) return true;
        }
    }
    return hit->prim >= 0;
}

bool fs_bvh_hit(const Bvh *bvh, Vec o, Vec d, Hit *hit)
{
    return walk(bvh, o, d, 0.0f, 0, false, hit);
}

bool fs_bvh_blocked(const Bvh *bvh, Vec o, Vec d, float t_min, float t_max, int ignore)
{
    return walk(bvh, o, d, t_min, ignore, true, &(Hit){.t = t_max});
}
