// Balls, tins, bottles, rings, cushions, cloth, plants.
#include "synth/things.h"

#define TAU 6.2831853f

typedef struct Turned {
    const Knot *knot;
    int n;
} Turned;

static Vec turned_at(const void *context, float u, float v)
{
    const Turned *t = context;
    float x = fminf(fmaxf(v, 0), 1) * (float)(t->n - 1);
    int i = (int)x > t->n - 2 ? t->n - 2 : (int)x;
    float s = x - (float)i, r = t->knot[i].radius + s * (t->knot[i + 1].radius - t->knot[i].radius);
    float h = t->knot[i].height + s * (t->knot[i + 1].height - t->knot[i].height);
    return vec(r * sinf(TAU * u), -r * cosf(TAU * u), h);
}

void fs_things_turned(World *w, Frame f, const Knot *knot, int n, int segments, int surface)
{
    Turned t = {knot, n};
    float widest = 0;
    for (int i = 0; i < n; i++) widest = fmaxf(widest, knot[i].radius);
    fs_world_sheet(w, f, (Sheet){segments, n - 1, fmaxf(1, roundf(TAU * widest / 0.28f)), 1, turned_at, &t}, surface);
}

void fs_things_ball(World *w, Frame f, float radius, int surface)
{
    enum { N = 15 };
    Knot k[N];
    for (int i = 0; i < N; i++) {
        float a = 3.14159265f * (float)i / (N - 1);
        k[i] = (Knot){radius * sinf(a), radius * (1 - cosf(a))};
    }
    fs_things_turned(w, f, k, N, 28, surface);
}

void fs_things_tin(World *w, Frame f, float radius, float height, int surface, int lid)
{
    fs_things_turned(w, f, (Knot[]){{radius, 0}, {radius, height}}, 2, 28, surface);
    fs_things_turned(w, f, (Knot[]){{radius, height}, {0.94f * radius, height + 0.002f}, {0, height + 0.002f}}, 3, 28,
                     lid);
}

void fs_things_rod(World *w, Vec from, Vec to, float radius, int surface)
{
    Frame f = {.o = from, .z = vec_unit(vec_sub(to, from))};
    vec_basis(f.z, &f.x, &f.y);
    float length = vec_length(vec_sub(to, from));
    fs_things_turned(w, f, (Knot[]){{radius, 0}, {radius, length}, {0, length}}, 3, 14, surface);
}

static Vec ring_at(const void *context, float u, float v)
{
    const float *r = context; // radius, half thickness
    float a = TAU * u, b = TAU * v, q = r[0] - r[1] * cosf(b);
    return vec(q * sinf(a), -q * cosf(a), r[1] + r[1] * sinf(-b));
}

void fs_things_ring(World *w, Frame f, float radius, float thick, int surface)
{
    const float r[2] = {radius, 0.5f * thick};
    fs_world_sheet(w, f, (Sheet){36, 10, 3, 1, ring_at, r}, surface);
}

void fs_things_vase(World *w, Frame f, float height, int surface)
{
    enum { N = 12 };
    Knot k[N];
    float belly = fs_things_range(w, 0.22f, 0.36f) * height, neck = fs_things_range(w, 0.3f, 0.6f);
    float turn = fs_things_range(w, 0.0f, 0.8f);
    for (int i = 0; i < N; i++) {
        float v = (float)i / (N - 1), bulge = sinf(3.14159265f * fminf(1.0f, 0.22f + v * (0.8f + 0.25f * turn)));
        k[i] = (Knot){belly * (neck + (1 - neck) * bulge) * (v > 0.92f ? 1.12f : 1.0f), v * height};
    }
    fs_things_turned(w, f, k, N, 28, surface);
}

void fs_things_bottle(World *w, Frame f, float height, int surface)
{
    float r = fs_things_range(w, 0.13f, 0.17f) * height;
    const Knot k[] = {{r, 0},
                      {r, 0.3f * height},
                      {r, 0.58f * height},
                      {0.85f * r, 0.66f * height},
                      {0.35f * r, 0.76f * height},
                      {0.33f * r, 0.9f * height},
                      {0.42f * r, 0.92f * height},
                      {0.42f * r, height},
                      {0, height}};
    fs_things_turned(w, f, k, 9, 24, surface);
}

static float power(float x, float e) // |x|^e with the sign of x
{
    return copysignf(powf(fabsf(x), e), x);
}

static Vec cushion_at(const void *context, float u, float v) // a superellipsoid: square outline, soft faces
{
    const float *size = context; // width, height, thickness
    float a = TAU * u, b = 3.14159265f * (fminf(fmaxf(v, 0), 1) - 0.5f), wide = power(cosf(b), 0.45f);
    float x = 0.5f * size[0] * wide * power(sinf(a), 0.8f), y = -0.5f * size[2] * cosf(b) * power(cosf(a), 1.1f);
    return vec(x, y, 0.5f * size[1] * (1 + power(sinf(b), 0.5f)));
}

void fs_things_cushion(World *w, Frame f, float width, float height, float thick, int surface)
{
    const float size[3] = {width, height, thick};
    fs_world_sheet(w, f, (Sheet){32, 16, roundf(2 * width / 0.3f), roundf(height / 0.3f) + 0.5f, cushion_at, size},
                   surface);
}

static Vec bag_at(const void *context, float u, float v)
{
    const float *size = context; // width, height, phase
    float a = TAU * u, crease = 0.04f * sinf(3 * a + 9 * v + size[2]) + 0.03f * sinf(7 * a - 5 * v);
    float body = v < 0.75f ? 1.0f - 0.15f * (v - 0.3f) * (v - 0.3f) : 0.92f - 2.2f * (v - 0.75f);
    if (v > 0.92f) body = 0.55f + 2.0f * (v - 0.92f);
    float r = 0.5f * size[0] * (body + crease) * fminf(1.0f, 0.75f + 4 * v);
    return vec(r * sinf(a), -0.75f * r * cosf(a), v * size[1]);
}

void fs_things_bag(World *w, Frame f, float width, float height, int surface)
{
    const float size[3] = {width, height, fs_things_range(w, 0, 6)};
    fs_world_sheet(w, f, (Sheet){32, 16, roundf(3 * width / 0.3f) + 1, height / 0.3f, bag_at, size}, surface);
}

static Vec cloth_at(const void *context, float u, float v)
{
    const float *size = context; // width, height, fold, phase
    float wave =
        sinf(u * size[0] * 34.0f + size[3]) * 0.6f + sinf(u * size[0] * 15.0f + 2.1f * size[3] + 1.5f * v) * 0.7f;
    return vec(size[0] * (u - 0.5f), size[2] * wave * (1.0f - 0.35f * v), -size[1] * (1.0f - v));
}

void fs_things_cloth(World *w, Frame f, float width, float height, float fold, int surface)
{
    const float size[4] = {width, height, fold, fs_things_range(w, 0, 6)};
    int nu = (int)fminf(96.0f, 16 + 50 * width);
    float repeat = w->failed ? 0 : fs_world_edit(w, surface)->repeat; // a banner's picture covers it once
    fs_world_sheet(w, f,
                   (Sheet){nu, 8, repeat > 0 ? width / repeat : 1, repeat > 0 ? height / repeat : 1, cloth_at, size},
                   surface);
}

typedef struct Leaf {
    float length, width, droop, lift;
} Leaf;

static Vec leaf_at(const void *context, float u, float v)
{
    const Leaf *l = context;
    float t = fminf(fmaxf(v, 0), 1), half = l->width * sinf(3.14159265f * powf(t, 0.7f)) + 1e-4f;
    return vec((u - 0.5f) * 2 * half, l->length * t * cosf(l->lift) * (1 - 0.2f * t),
               l->length * (t * sinf(l->lift) - l->droop * t * t) + 0.15f * fabsf(u - 0.5f) * half);
}

void fs_things_plant(World *w, Frame f, float height, const Stock *s)
{
    float pot = 0.16f * height + 0.03f;
    fs_things_turned(w, f,
                     (Knot[]){{0.7f * pot, 0},
                              {pot, 1.5f * pot},
                              {1.08f * pot, 1.55f * pot},
                              {1.08f * pot, 1.8f * pot},
                              {0.9f * pot, 1.8f * pot},
                              {0, 1.7f * pot}},
                     6, 20, s->glaze[fs_things_pick(w, 5)]);
    int leaves = 16 + fs_things_pick(w, 10);
    for (int i = 0; i < leaves; i++) {
        Leaf leaf = {.length = 0.75f * height * fs_things_range(w, 0.5f, 1.0f), .width = 0.05f * height};
        leaf.droop = fs_things_range(w, 0.1f, 0.8f);
        leaf.lift = fs_things_range(w, 0.5f, 1.45f);
        Frame at = frame_at(f, vec(0, 0, 1.7f * pot), 2.4f * (float)i + fs_things_range(w, -0.3f, 0.3f));
        fs_world_sheet(w, at, (Sheet){2, 6, 1, 1, leaf_at, &leaf}, s->leaf);
    }
}
