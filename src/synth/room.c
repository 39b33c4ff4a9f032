// The rooms on the camera's side, seen mirrored. A room is built in its own frame: the viewer (the mirrored camera) is
// near the origin's wall and looks towards +x * side and +y; y = depth is the wall opposite the pane.
#include "synth/layout.h"

typedef struct Build {
    World *w;
    Stock stock;
    Frame f;
    float side, size; // side: where the view goes, +1 right; size scales distances
    float wide, depth, high;
} Build;

static float rnd(Build *b, float low, float high)
{
    return fs_things_range(b->w, low, high);
}

static Frame stand(const Build *b, float x, float y, float yaw)
{
    return frame_at(b->f, vec(b->side * x * b->size, y * b->size, 0), b->side * yaw);
}

// Frames on the two walls in view: the opposite one at x, the side one at distance y from the pane.
static Frame on_wall(const Build *b, float x, float z)
{
    return frame_at(b->f, vec(b->side * x * b->size, b->depth - 0.004f, z), 0);
}

static Frame on_side(const Build *b, float y, float z)
{
    return frame_at(b->f, vec(b->side * (b->wide - 0.004f), y * b->size, z), -b->side * 1.5707963f);
}

static void shell(Build *b, Paint wall, Paint floor, float hue)
{
    World *w = b->w;
    int paper = fs_world_tiled(w, wall, hue, 1.6f), ground = fs_world_tiled(w, floor, -1, 1.0f);
    int ceiling = fs_world_tiled(w, fs_things_pick(w, 2) ? PAINT_PANELS : PAINT_PLASTER, 0.12f, 1.2f);
    int skirting = fs_world_color(w, vec(0.5f, 0.46f, 0.42f));
    const int side[6] = {paper, paper, paper, paper, ground, ceiling};
    float x0 = b->side > 0 ? -2.6f : -b->wide, x1 = b->side > 0 ? b->wide : 2.6f;
    fs_world_room(w, b->f, vec(x0, 0, 0), vec(x1, b->depth, b->high), side);
    fs_world_box(w, b->f, vec(x0, b->depth - 0.02f, 0), vec(x1, b->depth, 0.1f), skirting);
    float red = rnd(b, 4.6f, 6.0f), blue = rnd(b, 4.8f, 6.2f);
    Vec tint = vec(red, 5.2f, blue);
    for (int i = 0; i < 3; i++) { // lamps in the ceiling, seen as bright panels
        float x = b->side * b->size * (0.6f + 1.0f * (float)i) - 0.3f, y = b->depth * (i & 1 ? 0.62f : 0.4f);
        Frame f = frame_at(b->f, vec(x, y, b->high - 0.012f), 0);
        int glow = fs_world_surface(w, (Surface){-1, vec_scale(tint, 0.12f), .glow = 1});
        fs_world_quad(w, f, vec(0, 0.3f, 0), vec(0.6f, 0, 0), vec(0, -0.3f, 0), glow);
        fs_world_light(w, f, vec(0, 0.3f, -0.03f), vec(0.6f, 0, 0), vec(0, -0.3f, 0),
                       vec_scale(tint, 2.2f * b->size * b->size));
    }
    w->fill = vec(0.4f, 0.4f, 0.4f);
}

// Light from a place that is not a ceiling lamp, so that the shading differs from room to room.
static void window_light(Build *b, Frame f, float width, float height, Vec light)
{
    fs_things_window(b->w, f, width, height, vec_scale(light, 0.16f));
    fs_world_light(b->w, f, vec(-0.5f * width, -0.08f, -0.5f * height), vec(width, 0, 0), vec(0, 0, height), light);
}

static void gallery_wall(Build *b, float x0, float x1, float z)
{
    static const Paint kinds[] = {PAINT_POSTER, PAINT_ART, PAINT_NOTES, PAINT_COVER, PAINT_NEWS, PAINT_ART};
    int k = fs_things_pick(b->w, 6);
    for (float x = x0; x < x1;) {
        float width = rnd(b, 0.4f, 0.75f), height = width * rnd(b, 0.8f, 1.4f);
        fs_things_picture(b->w, on_wall(b, x + 0.5f * width / b->size, z), width, fminf(height, 0.9f), kinds[k++ % 6]);
        x += (width + rnd(b, 0.08f, 0.25f)) / b->size;
    }
}

static void gallery_side(Build *b, float y0, float y1, float z)
{
    static const Paint kinds[] = {PAINT_ART, PAINT_POSTER, PAINT_COVER, PAINT_NOTES};
    int k = fs_things_pick(b->w, 4);
    for (float y = y0; y < y1;) {
        float width = rnd(b, 0.4f, 0.7f);
        fs_things_picture(b->w, on_side(b, y + 0.5f * width / b->size, z), width, width * rnd(b, 0.9f, 1.3f),
                          kinds[k++ % 4]);
        y += (width + rnd(b, 0.1f, 0.25f)) / b->size;
    }
}

static void corridor(Build *b)
{
    World *w = b->w;
    shell(b, PAINT_STAINED, PAINT_TILES, 0.1f);
    gallery_wall(b, 0.25f, 1.2f, 1.6f);
    fs_things_door(w, frame_at(b->f, vec(b->side * 1.75f * b->size, b->depth - 0.004f, 0), 0), -1);
    fs_things_picture(w, on_wall(b, 1.75f, 2.3f), 0.5f, 0.16f, PAINT_LABEL);
    fs_things_picture(w, on_wall(b, 2.75f, 1.55f), 0.9f, 0.65f, PAINT_NOTES);
    gallery_side(b, 0.7f, 2.6f, 1.6f);
    Frame cooler = stand(b, 2.5f, 2.5f, 0.1f), bench = stand(b, 3.3f, 0.9f, 1.2f);
    fs_things_plant(w, stand(b, 1.05f, 2.35f, 0), 0.9f, &b->stock);
    fs_world_box(w, cooler, vec(-0.17f, -0.16f, 0), vec(0.17f, 0.16f, 0.95f), b->stock.white);
    fs_things_bottle(w, frame_at(cooler, vec(0, 0, 0.95f), 0), 0.4f, fs_world_color(w, vec(0.5f, 0.65f, 0.75f)));
    fs_things_tin(w, stand(b, 2.9f, 1.6f, 0), 0.11f, 0.75f, fs_world_color(w, vec(0.72f, 0.16f, 0.14f)), b->stock.dark);
    fs_things_table(w, bench, 1.2f, 0.4f, 0.5f, b->stock.wood[0]);
    fs_things_carton(w, frame_at(bench, vec(0, 0, 0.5f), 0.2f), 0.35f, 0.3f, 0.28f, &b->stock);
}

static void classroom(Build *b)
{
    World *w = b->w;
    shell(b, PAINT_PANELS, PAINT_WOOD, -1);
    gallery_wall(b, 0.3f, 2.2f, 1.75f);
    fs_things_picture(w, on_wall(b, 2.85f, 1.55f), 1.0f, 0.8f, PAINT_POSTER);
    window_light(b, on_side(b, 1.35f, 1.6f), 1.0f, 1.1f, vec(4.2f, 5.0f, 6.0f));
    fs_things_picture(w, on_side(b, 2.4f, 1.6f), 0.55f, 0.75f, PAINT_ART);
    int seat[3];
    for (int i = 0; i < 3; i++) seat[i] = fs_world_tiled(w, i & 1 ? PAINT_FABRIC : PAINT_STRIPES, -1, 0.25f);
    for (int i = 0; i < 4; i++) {
        Frame t =
            stand(b, 1.0f + 1.25f * (float)(i % 2) + 0.25f * (float)(i / 2), i < 2 ? 1.3f : 2.35f, rnd(b, -0.1f, 0.1f));
        fs_things_table(w, t, 1.05f, 0.6f, 0.74f, b->stock.wood[i & 1]);
        fs_things_row(w, frame_at(t, vec(0, 0, 0.74f), 0), -0.45f, 0.3f, 0.45f, 0.26f, &b->stock);
        float aside = rnd(b, -0.2f, 0.2f);
        fs_things_chair(w, frame_at(t, vec(aside, -0.48f, 0), 3.1416f + rnd(b, -0.4f, 0.4f)), seat[i % 3],
                        b->stock.dark);
    }
    fs_things_rack(w, stand(b, 3.35f, 2.65f, -1.2f), vec(0.9f, 0.3f, 1.9f), 5, b->stock.wood[0], &b->stock);
}

static void office(Build *b)
{
    World *w = b->w;
    shell(b, PAINT_PLASTER, PAINT_CARPET, -1);
    fs_things_rack(w, frame_at(b->f, vec(b->side * 0.8f * b->size, b->depth - 0.18f, 0), 0), vec(1.0f, 0.32f, 2.0f), 5,
                   b->stock.white, &b->stock);
    gallery_wall(b, 1.45f, 2.1f, 1.6f);
    fs_things_door(w, frame_at(b->f, vec(b->side * 2.75f * b->size, b->depth - 0.004f, 0), 0), -1);
    gallery_side(b, 0.6f, 2.6f, 1.7f);
    Frame desk = stand(b, 1.75f, 1.75f, 0.15f);
    fs_things_table(w, desk, 1.6f, 0.75f, 0.74f, b->stock.wood[1]);
    fs_things_monitor(w, frame_at(desk, vec(-0.1f, 0.05f, 0.74f), 0.2f));
    const int side[6] = {b->stock.dark, b->stock.dark, b->stock.dark, b->stock.dark, -1, b->stock.keys};
    fs_world_box6(w, frame_at(desk, vec(-0.1f, -0.24f, 0.74f), 0.1f), vec(-0.22f, -0.08f, 0), vec(0.22f, 0.08f, 0.02f),
                  side);
    fs_things_row(w, frame_at(desk, vec(0, 0.15f, 0.74f), 0), 0.3f, 0.6f, 0.35f, 0.3f, &b->stock);
    fs_things_pile(w, frame_at(desk, vec(-0.6f, 0, 0.74f), 0.4f), 6, &b->stock);
    fs_things_chair(w, stand(b, 1.7f, 1.1f, 2.8f), b->stock.fabric[0], b->stock.dark);
    fs_things_plant(w, stand(b, 3.2f, 2.5f, 0), 1.3f, &b->stock);
    for (int i = 0; i < 2; i++) {
        Frame lamp = frame_at(b->f, vec(b->side * b->size * (1.3f + 0.9f * (float)i), 1.6f * b->size, b->high), 0);
        fs_things_pendant(w, lamp, 0.55f, vec(1.0f, 0.93f, 0.8f));
        fs_world_light(w, lamp, vec(-0.1f, 0.1f, -0.95f), vec(0.2f, 0, 0), vec(0, -0.2f, 0), vec(14, 13, 11));
    }
    fs_things_drawers(w, stand(b, 3.25f, 1.1f, -1.3f), 0.8f, 0.4f, 0.9f, b->stock.metal, &b->stock);
}

static void living_room(Build *b)
{
    World *w = b->w;
    shell(b, fs_things_pick(w, 2) ? PAINT_STRIPES : PAINT_STAINED, PAINT_WOOD, -1);
    fs_things_picture(w, on_wall(b, 1.1f, 1.65f), 1.1f, 0.7f, PAINT_ART);
    fs_things_picture(w, on_wall(b, 2.15f, 1.8f), 0.5f, 0.6f, PAINT_ART);
    fs_things_picture(w, on_wall(b, 2.8f, 1.55f), 0.45f, 0.6f, PAINT_POSTER);
    Frame lamp = stand(b, 2.6f, 2.5f, 0), table = stand(b, 1.5f, 1.55f, 0.2f);
    fs_things_sofa(w, stand(b, 1.3f, 2.5f, 0), 1.7f, fs_world_tiled(w, PAINT_FABRIC, -1, 0.6f), &b->stock);
    int weave = fs_world_painted(w, PAINT_FLORAL, -1, 1.8f, 1.2f);
    fs_world_quad(w, stand(b, 1.5f, 1.6f, 0.1f), vec(-0.9f, -0.6f, 0.012f), vec(1.8f, 0, 0), vec(0, 1.2f, 0), weave);
    fs_things_floor_lamp(w, lamp, 1.6f, vec(0.8f, 0.68f, 0.52f));
    fs_world_light(w, lamp, vec(-0.12f, -0.12f, 1.62f), vec(0.24f, 0, 0), vec(0, 0.24f, 0), vec(9, 7.5f, 6));
    fs_world_light(w, lamp, vec(-0.12f, 0.12f, 1.28f), vec(0.24f, 0, 0), vec(0, -0.24f, 0), vec(12, 10, 8));
    window_light(b, on_side(b, 1.2f, 1.6f), 1.1f, 1.3f, vec(5.0f, 5.6f, 6.2f));
    int cloth = fs_world_tiled(w, PAINT_FLORAL, -1, 0.4f);
    for (int i = 0; i < 2; i++) {
        Frame c =
            frame_at(b->f, vec(b->side * (b->wide - 0.1f), b->size * (i ? 2.05f : 0.4f), 2.45f), -b->side * 1.5708f);
        fs_things_cloth(w, c, 0.45f, 2.2f, 0.03f, cloth);
    }
    fs_things_table(w, table, 0.9f, 0.5f, 0.42f, b->stock.wood[0]);
    fs_things_row(w, frame_at(table, vec(0, 0, 0.42f), 0), -0.4f, 0.3f, 0.3f, 0.25f, &b->stock);
    fs_things_rack(w, stand(b, 3.2f, 2.6f, -0.9f), vec(0.8f, 0.3f, 1.9f), 5, b->stock.wood[1], &b->stock);
    fs_things_plant(w, stand(b, 0.35f, 2.5f, 0), 1.1f, &b->stock);
}

// What a pane that lies flat mirrors: the upper part of a wall ahead and the ceiling.
static void upper_room(Build *b)
{
    World *w = b->w;
    shell(b, fs_things_pick(w, 2) ? PAINT_STRIPES : PAINT_BRICK, PAINT_CARPET, -1);
    fs_things_door(w, frame_at(b->f, vec(-0.15f + rnd(b, -0.15f, 0.15f), b->depth - 0.004f, 0), 0), -1);
    for (int i = 0; i < 6; i++) {
        float x = (i < 3 ? -1.75f + 0.42f * (float)i : 0.75f + 0.45f * (float)(i - 3)), z = i & 1 ? 1.5f : 1.95f;
        fs_things_picture(w, frame_at(b->f, vec(x, b->depth - 0.004f, z), 0), 0.38f, rnd(b, 0.4f, 0.6f),
                          i & 1 ? PAINT_POSTER : PAINT_ART);
        fs_things_picture(w, frame_at(b->f, vec(x, b->depth - 0.004f, i & 1 ? 2.1f : 1.35f), 0), 0.34f, 0.3f,
                          PAINT_COVER);
    }
    int board = b->stock.wood[0];
    fs_world_box(w, b->f, vec(-1.9f, b->depth - 0.26f, 2.32f), vec(1.9f, b->depth, 2.35f), board);
    fs_things_row(w, frame_at(b->f, vec(0, b->depth - 0.14f, 2.35f), 0), -1.8f, 1.6f, 0.2f, 0.25f, &b->stock);
    for (int i = -2; i <= 2; i++) // beams under the ceiling
        fs_world_box(w, b->f, vec(0.75f * (float)i - 0.05f, 0, b->high - 0.12f),
                     vec(0.75f * (float)i + 0.05f, b->depth, b->high), b->stock.wood[1]);
    Frame lamp = frame_at(b->f, vec(rnd(b, 0.25f, 0.5f), 0.75f * b->depth, b->high), 0);
    fs_things_pendant(w, lamp, 0.4f, vec(0.7f, 0.65f, 0.58f));
    fs_world_light(w, lamp, vec(-0.1f, 0.1f, -0.8f), vec(0.2f, 0, 0), vec(0, -0.2f, 0), vec(16, 15, 13));
    Frame plant = frame_at(b->f, vec(-0.75f, b->depth - 0.3f, 1.5f), 0);
    fs_world_box(w, plant, vec(-0.2f, -0.15f, -0.05f), vec(0.2f, 0.3f, 0), board);
    fs_things_plant(w, plant, 0.55f, &b->stock);
}

static const struct {
    const char *name;
    void (*build)(Build *b);
} rooms[ROOMS + 1] = {
    {"corridor", corridor},       {"classroom", classroom},   {"office", office},
    {"living room", living_room}, {"room above", upper_room},
};

void fs_room_build(Layout *layout, const Spec *spec, int which)
{
    Build b = {.w = &layout->room, .f = frame_identity(), .size = spec->room_size};
    if (which == ROOMS) { // ahead of the viewer
        b.f.o = vec(layout->pane_point.x, layout->pane_point.y - 1.2f, 0);
        b.side = 1;
        b.wide = 2.6f;
        b.depth = 1.2f + fs_things_range(b.w, 1.35f, 1.6f) * (0.4f + 0.6f * b.size);
        b.high = 2.85f;
    } else { // behind the viewer
        b.f.o = vec(layout->pane_point.x, 0.25f, 0);
        b.f.x = vec(-1, 0, 0);
        b.f.y = vec(0, -1, 0);
        b.side = -layout->side;
        b.wide = fs_things_range(b.w, 3.5f, 3.9f) * b.size;
        b.depth = fs_things_range(b.w, 2.9f, 3.2f) * b.size;
        b.high = fs_things_range(b.w, 2.55f, 2.8f);
    }
    fs_things_stock(b.w, &b.stock);
    layout->room_name = rooms[which].name;
    rooms[which].build(&b);
}
