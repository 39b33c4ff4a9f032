// Tables, chairs, racks, doors, lamps.
#include "synth/things.h"

static void slab(World *w, Frame f, Vec corner, Vec size, int surface)
{
    fs_world_box(w, f, corner, vec_add(corner, size), surface);
}

void fs_things_table(World *w, Frame f, float width, float depth, float height, int surface)
{
    float x = 0.5f * width, y = 0.5f * depth, leg = 0.05f;
    slab(w, f, vec(-x, -y, height - 0.035f), vec(width, depth, 0.035f), surface);
    slab(w, f, vec(-x + leg, -y + leg, height - 0.12f), vec(width - 2 * leg, 0.02f, 0.09f), surface);
    for (int i = 0; i < 4; i++)
        slab(w, f, vec(i & 1 ? x - leg - 0.02f : -x + 0.02f, i & 2 ? y - leg - 0.02f : -y + 0.02f, 0),
             vec(leg, leg, height - 0.035f), surface);
}

void fs_things_chair(World *w, Frame f, int seat, int legs)
{
    const float h = 0.45f, half = 0.21f;
    slab(w, f, vec(-half, -half, h - 0.03f), vec(2 * half, 2 * half, 0.05f), seat);
    slab(w, f, vec(-half, half - 0.03f, h + 0.16f), vec(2 * half, 0.035f, 0.3f), seat);
    for (int i = 0; i < 4; i++) {
        float x = i & 1 ? half - 0.03f : -half, y = i & 2 ? half - 0.03f : -half;
        slab(w, f, vec(x, y, 0), vec(0.03f, 0.03f, i & 2 ? h + 0.42f : h - 0.03f), legs);
    }
}

void fs_things_rack(World *w, Frame f, Vec size, int boards, int surface, const Stock *s)
{
    float width = size.x, depth = size.y, height = size.z, x = 0.5f * width, y = 0.5f * depth,
          step = height / (float)boards;
    slab(w, f, vec(-x, -y, 0), vec(0.03f, depth, height), surface);
    slab(w, f, vec(x - 0.03f, -y, 0), vec(0.03f, depth, height), surface);
    slab(w, f, vec(-x, y - 0.01f, 0), vec(width, 0.01f, height), surface);
    for (int i = 0; i <= boards; i++) {
        float z = (float)i * step;
        slab(w, f, vec(-x + 0.03f, -y, z - (i == boards ? 0.025f : 0.0f)), vec(width - 0.06f, depth - 0.01f, 0.025f),
             surface);
        if (i == boards) break;
        Frame at = frame_at(f, vec(0, 0, z + 0.025f), 0);
        if (fs_things_pick(w, 2))
            fs_things_row(w, at, -x + 0.06f, x - 0.2f, depth, 0.8f * step, s);
        else
            fs_things_books(w, at, width - 0.1f, 0.85f * step, s);
    }
}

void fs_things_drawers(World *w, Frame f, float width, float depth, float height, int surface, const Stock *s)
{
    float x = 0.5f * width, y = 0.5f * depth;
    slab(w, f, vec(-x, -y, 0), vec(width, depth, height), surface);
    slab(w, f, vec(-x - 0.015f, -y - 0.015f, height), vec(2 * x + 0.03f, depth + 0.03f, 0.025f), surface);
    int columns = 1 + (int)(width / 0.45f), rows = 1 + (int)(height / 0.24f);
    float dx = width / (float)columns, dz = height / (float)rows;
    for (int i = 0; i < columns; i++)
        for (int j = 0; j < rows; j++) {
            float px = -x + dx * (float)i, pz = dz * (float)j;
            slab(w, f, vec(px + 0.012f, -y - 0.018f, pz + 0.012f), vec(dx - 0.024f, 0.018f, dz - 0.024f), surface);
            slab(w, f, vec(px + 0.4f * dx, -y - 0.04f, pz + 0.72f * dz), vec(0.2f * dx, 0.022f, 0.018f), s->metal);
            if (fs_things_pick(w, 3) == 0) {
                fs_things_picture(w, frame_at(f, vec(px + 0.5f * dx, -y - 0.02f, pz + 0.36f * dz), 0), 0.3f * dx,
                                  0.4f * dz, PAINT_COVER);
            }
        }
}

void fs_things_door(World *w, Frame f, float hue)
{
    const float width = 0.92f, height = 2.05f;
    int leaf = fs_world_painted(w, PAINT_DOOR, hue, width, height), trim = fs_world_painted(w, PAINT_WOOD, -1, 0.3f, 2);
    fs_world_quad(w, f, vec(-0.5f * width, -0.02f, 0), vec(width, 0, 0), vec(0, 0, height), leaf);
    slab(w, f, vec(-0.5f * width - 0.09f, -0.05f, 0), vec(0.09f, 0.06f, height), trim);
    slab(w, f, vec(0.5f * width, -0.05f, 0), vec(0.09f, 0.06f, height), trim);
    slab(w, f, vec(-0.5f * width - 0.09f, -0.05f, height), vec(width + 0.18f, 0.06f, 0.09f), trim);
}

void fs_things_window(World *w, Frame f, float width, float height, Vec sky)
{
    int glow = fs_world_surface(w, (Surface){-1, sky, .glow = 1, .thin = true});
    int bar = fs_world_color(w, vec(0.8f, 0.8f, 0.78f));
    fs_world_quad(w, f, vec(-0.5f * width, -0.01f, -0.5f * height), vec(width, 0, 0), vec(0, 0, height), glow);
    for (int i = 0; i <= 2; i++) {
        slab(w, f, vec(-0.5f * width + 0.5f * (float)i * width - 0.025f, -0.05f, -0.5f * height),
             vec(0.05f, 0.04f, height), bar);
        slab(w, f, vec(-0.5f * width, -0.05f, -0.5f * height + 0.5f * (float)i * height - 0.025f),
             vec(width, 0.04f, 0.05f), bar);
    }
}

void fs_things_floor_lamp(World *w, Frame f, float height, Vec light)
{
    int shade = fs_world_surface(w, (Surface){-1, light, .glow = 1});
    int metal = fs_world_color(w, vec(0.3f, 0.3f, 0.32f));
    fs_things_turned(w, f, (Knot[]){{0.15f, 0}, {0.15f, 0.02f}, {0, 0.03f}}, 3, 20, metal);
    fs_things_rod(w, frame_point(f, vec(0, 0, 0.02f)), frame_point(f, vec(0, 0, height)), 0.013f, metal);
    fs_things_turned(w, f, (Knot[]){{0.2f, height - 0.3f}, {0.12f, height}}, 2, 24, shade);
}

void fs_things_pendant(World *w, Frame f, float drop, Vec light)
{
    int shade = fs_world_surface(w, (Surface){-1, light, .glow = 1});
    int metal = fs_world_color(w, vec(0.5f, 0.48f, 0.44f));
    fs_things_rod(w, f.o, frame_point(f, vec(0, 0, -drop)), 0.008f, metal);
    fs_things_turned(w, f,
                     (Knot[]){{0.2f, -drop - 0.18f}, {0.17f, -drop - 0.09f}, {0.09f, -drop - 0.02f}, {0.02f, -drop}}, 4,
                     24, metal);
    fs_things_ball(w, frame_at(f, vec(0, 0, -drop - 0.22f), 0), 0.075f, shade);
}

void fs_things_sofa(World *w, Frame f, float width, int cloth, const Stock *s)
{
    float x = 0.5f * width;
    slab(w, f, vec(-x, -0.4f, 0.1f), vec(width, 0.8f, 0.3f), cloth);
    slab(w, f, vec(-x, 0.22f, 0.4f), vec(width, 0.2f, 0.42f), cloth);
    slab(w, f, vec(-x - 0.16f, -0.42f, 0.08f), vec(0.16f, 0.84f, 0.52f), cloth);
    slab(w, f, vec(x, -0.42f, 0.08f), vec(0.16f, 0.84f, 0.52f), cloth);
    for (int i = 0; i < 3; i++) {
        Frame at =
            frame_at(f, vec(-x + 0.3f + (width - 0.6f) * 0.5f * (float)i, 0.1f, 0.4f), fs_things_range(w, -0.3f, 0.3f));
        at = frame_pitch(at, 0.25f);
        fs_things_cushion(w, at, 0.42f, 0.4f, 0.16f, s->fabric[fs_things_pick(w, 4)]);
    }
}

void fs_things_monitor(World *w, Frame f)
{
    int dark = fs_world_color(w, vec(0.2f, 0.2f, 0.21f)), picture = fs_world_painted(w, PAINT_POSTER, 0.6f, 0.5f, 0.3f);
    slab(w, f, vec(-0.12f, -0.09f, 0), vec(0.24f, 0.18f, 0.015f), dark);
    slab(w, f, vec(-0.02f, -0.02f, 0.015f), vec(0.04f, 0.04f, 0.15f), dark);
    slab(w, f, vec(-0.27f, -0.03f, 0.12f), vec(0.54f, 0.03f, 0.33f), dark);
    fs_world_quad(w, f, vec(-0.25f, -0.032f, 0.14f), vec(0.5f, 0, 0), vec(0, 0, 0.29f), picture);
}
