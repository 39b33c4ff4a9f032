// Boxes of all kinds: cartons, books, pictures, and rows of them.
#include "synth/things.h"

#include "synth/paint_parts.h"

float fs_things_range(World *world, float low, float high)
{
    return fs_rng_range(&world->rng, low, high);
}

int fs_things_pick(World *world, int n)
{
    return fs_rng_below(&world->rng, n);
}

void fs_things_stock(World *world, Stock *s)
{
    static const Paint glazes[] = {PAINT_STRIPES, PAINT_FLORAL, PAINT_CHECKER, PAINT_STONE, PAINT_PLAIN};
    for (int i = 0; i < 8; i++) {
        s->label[i] = fs_world_painted(world, PAINT_LABEL, (float)i / 8.0f, 0.24f, 0.2f);
        fs_world_edit(world, s->label[i])->gloss = i & 1 ? 0.12f : 0.03f;
    }
    for (int i = 0; i < 3; i++) s->carton[i] = fs_world_painted(world, PAINT_CARTON, (float)i / 3.0f, 0.35f, 0.3f);
    for (int i = 0; i < 4; i++) {
        s->cover[i] = fs_world_painted(world, i & 1 ? PAINT_COVER : PAINT_BOOKS, -1, 0.2f, 0.27f);
        s->fabric[i] = fs_world_tiled(world, i & 1 ? PAINT_FLORAL : PAINT_FABRIC, -1, 0.3f);
    }
    s->basket = fs_world_tiled(world, PAINT_BASKET, -1, 0.24f);
    s->metal = fs_world_tiled(world, PAINT_METAL, -1, 0.4f);
    fs_world_edit(world, s->metal)->gloss = 0.2f;
    s->dark = fs_world_color(world, vec(0.25f, 0.25f, 0.27f));
    s->white = fs_world_color(world, vec(0.82f, 0.82f, 0.8f));
    s->wood[0] = fs_world_tiled(world, PAINT_WOOD, 0.2f, 0.84f);
    s->wood[1] = fs_world_tiled(world, PAINT_WOOD, 0.8f, 0.84f);
    s->keys = fs_world_painted(world, PAINT_KEYS, -1, 0.4f, 0.14f);
    s->checker = fs_world_painted(world, PAINT_CHECKER, -1, 0.12f, 0.12f);
    s->leaf = fs_world_color(world, vec(0.32f, 0.5f, 0.24f));
    for (int i = 0; i < 5; i++) {
        s->glaze[i] = fs_world_painted(world, glazes[i], -1, 0.3f, 0.2f);
        fs_world_edit(world, s->glaze[i])->gloss = 0.15f;
    }
}

void fs_things_carton(World *w, Frame f, float width, float depth, float height, const Stock *s)
{
    bool plain = fs_things_pick(w, 4) == 0;
    int a = plain ? s->carton[fs_things_pick(w, 3)] : s->label[fs_things_pick(w, 8)];
    int b = plain ? a : s->label[fs_things_pick(w, 8)], top = plain ? a : fs_things_pick(w, 2) ? a : s->checker;
    fs_world_box6(w, f, vec(-0.5f * width, -0.5f * depth, 0), vec(0.5f * width, 0.5f * depth, height),
                  (int[]){a, -1, b, b, -1, top});
}

static int spine(World *w)
{
    Surface cloth = {.texture = -1, .gloss = 0.05f};
    Color c = fs_paint_parts_color(&w->rng, vec(0, 0.2f, 0.3f), vec(1, 0.7f, 0.8f));
    cloth.tint = vec(c.x * c.x, c.y * c.y, c.z * c.z);
    return fs_world_surface(w, cloth);
}

void fs_things_books(World *w, Frame f, float length, float height, const Stock *s)
{
    for (float x = -0.5f * length; x < 0.5f * length - 0.015f;) {
        float thick = fminf(fs_things_range(w, 0.018f, 0.05f), 0.5f * length - x),
              h = height * fs_things_range(w, 0.75f, 1.0f);
        float deep = fs_things_range(w, 0.14f, 0.19f);
        int cloth = spine(w), front = fs_things_pick(w, 3) ? cloth : s->cover[fs_things_pick(w, 4)];
        fs_world_box6(w, f, vec(x, -0.5f * deep, 0), vec(x + 0.97f * thick, 0.5f * deep, h),
                      (int[]){front, -1, cloth, cloth, -1, s->white});
        if (front == cloth) { // a title plate
            int plate = fs_things_pick(w, 2) ? s->white : s->dark;
            float z = h * fs_things_range(w, 0.5f, 0.75f);
            fs_world_quad(w, f, vec(x + 0.15f * thick, -0.5f * deep - 0.001f, z), vec(0.65f * thick, 0, 0),
                          vec(0, 0, 0.16f * h), plate);
        }
        x += thick;
    }
}

void fs_things_pile(World *w, Frame f, int n, const Stock *s)
{
    float z = 0;
    for (int i = 0; i < n; i++) {
        float thick = fs_things_range(w, 0.015f, 0.045f), width = fs_things_range(w, 0.15f, 0.24f),
              deep = 0.72f * width;
        float aside = fs_things_range(w, -0.02f, 0.02f);
        Frame at = frame_at(f, vec(aside, 0, z), fs_things_range(w, -0.4f, 0.4f));
        int cloth = spine(w), cover = s->cover[fs_things_pick(w, 4)];
        fs_world_box6(w, at, vec(-0.5f * width, -0.5f * deep, 0), vec(0.5f * width, 0.5f * deep, thick),
                      (int[]){cloth, -1, s->white, s->white, -1, cover});
        z += thick;
    }
}

void fs_things_picture(World *w, Frame f, float width, float height, Paint paint)
{
    bool framed = paint == PAINT_ART || fs_things_pick(w, 3) == 0;
    float thick = framed ? 0.025f : 0.004f, rim = framed ? 0.018f : 0.0f;
    int face = fs_world_painted(w, paint, -1, width, height);
    fs_world_edit(w, face)->thin = true;
    if (framed) {
        int wood = spine(w);
        fs_world_box6(w, f, vec(-0.5f * width - rim, -thick, -0.5f * height - rim),
                      vec(0.5f * width + rim, 0, 0.5f * height + rim), (int[]){wood, -1, wood, wood, wood, wood});
    }
    fs_world_quad(w, f, vec(-0.5f * width, -thick - 0.002f, -0.5f * height), vec(width, 0, 0), vec(0, 0, height), face);
}

void fs_things_any(World *w, Frame f, float width, float height, const Stock *s)
{
    Frame turned = frame_at(f, vec(0, 0, 0), fs_things_range(w, -0.5f, 0.5f));
    float r = 0.5f * width;
    switch (fs_things_pick(w, 11)) {
    case 0: fs_things_vase(w, f, fminf(height, 2.6f * width), s->glaze[fs_things_pick(w, 5)]); break;
    case 1: fs_things_bottle(w, f, fminf(height, 3 * width), s->label[fs_things_pick(w, 8)]); break;
    case 2:
        fs_things_tin(w, f, 0.85f * r, fminf(height, 1.8f * width), s->label[fs_things_pick(w, 8)], s->metal);
        break;
    case 3: fs_things_ball(w, f, fminf(r, 0.5f * height), s->glaze[fs_things_pick(w, 3)]); break;
    case 4: fs_things_tin(w, f, r, fminf(0.8f * height, 0.8f * width), s->basket, s->basket); break;
    case 5: fs_things_bag(w, f, 1.05f * width, fminf(height, 1.3f * width), s->fabric[fs_things_pick(w, 4)]); break;
    case 6: fs_things_pile(w, f, 2 + fs_things_pick(w, 4), s); break;
    case 7: fs_things_books(w, f, width, fminf(height, 0.28f), s); break;
    default:
        fs_things_carton(w, turned, 0.85f * width, fminf(0.8f * width, 0.25f), height * fs_things_range(w, 0.6f, 1.0f),
                         s);
    }
}

void fs_things_row(World *w, Frame f, float x0, float x1, float depth, float high, const Stock *s)
{
    for (float x = x0; x < x1;) {
        float width = fminf(fs_things_range(w, 0.09f, 0.26f), 1.2f * high), room = 0.5f * fmaxf(depth - width, 0.0f);
        Frame at = frame_at(f, vec(x + 0.5f * width, fs_things_range(w, -room, room), 0), 0);
        fs_things_any(w, at, width, high * fs_things_range(w, 0.55f, 1.0f), s);
        x += width * fs_things_range(w, 1.1f, 1.35f);
    }
}
