// What is behind the pane: a wall of posters, a shelf, a display case, a cabinet with a lamp pole before it, a shop
// window. Nothing comes nearer to the pane than 10 cm, so that a tilted pane never cuts it.
#include "synth/layout.h"

typedef struct Build {
    World *w;
    Stock stock;
    Frame f;    // world axes
    float side; // of the view: x of the layout grows to where one looks
    float deep; // stretch in depth
} Build;

static float rnd(Build *b, float low, float high)
{
    return fs_things_range(b->w, low, high);
}

static Frame at(const Build *b, float x, float y, float z, float yaw)
{
    return frame_at(b->f, vec(b->side * x, y, z), b->side * yaw);
}

// Something that hangs on a wall whose surface is at y, centred at x and z.
static void hang(Build *b, float x, float y, float z, float width, float height, Paint paint)
{
    fs_things_picture(b->w, at(b, x, y - 0.003f, z, 0), width, height, paint);
}

// The hall behind the pane, lit from its ceiling and through the pane.
static void hall(Build *b, float depth, Paint wall, float hue, float repeat)
{
    World *w = b->w;
    if (w->texture_keep < 1) wall = PAINT_PLAIN; // a scene poor in texture has smooth walls
    int paper = fs_world_tiled(w, wall, hue, repeat), floor = fs_world_tiled(w, PAINT_CARPET, -1, 0.8f);
    int ceiling = fs_world_tiled(w, PAINT_PLASTER, 0.1f, 1.5f);
    fs_world_room(w, b->f, vec(-3.2f, 0, 0), vec(3.2f, depth, 2.75f), (int[]){-1, paper, paper, paper, floor, ceiling});
    float red = rnd(b, 5.2f, 6.2f), blue = rnd(b, 4.6f, 5.8f), tilt = rnd(b, -0.4f, 0.4f);
    Vec warm = vec(red, 5.6f, blue);
    float deep = fminf(0.5f, 0.5f * depth);
    fs_world_light(w, b->f, vec(b->side * (0.4f + tilt) - 0.7f, 0.15f + deep, 2.7f), vec(1.4f, 0, 0), vec(0, -deep, 0),
                   warm);
    fs_world_light(w, b->f, vec(1.6f + tilt, -0.9f, 2.2f), vec(-3.2f, 0, 0), vec(0, 0.3f, 0.5f),
                   vec_scale(vec(warm.z, warm.y, warm.x), 0.45f));
    w->fill = vec(0.45f, 0.46f, 0.47f);
}

// Posters, paintings, papers side by side from x0 to x1.
static void gallery(Build *b, float x0, float x1, float y, float z, float height)
{
    static const Paint kinds[] = {PAINT_POSTER, PAINT_ART, PAINT_NEWS, PAINT_POSTER, PAINT_NOTES, PAINT_COVER};
    int k = fs_things_pick(b->w, 6);
    for (float x = x0; x < x1;) {
        float width = rnd(b, 0.3f, 0.62f), h = fminf(height, width * rnd(b, 1.0f, 1.5f));
        hang(b, x + 0.5f * width, y, z + rnd(b, -0.5f, 0.5f) * (height - h), width, h, kinds[k++ % 6]);
        x += width + rnd(b, 0.05f, 0.12f);
    }
}

static void posters(Build *b)
{
    World *w = b->w;
    float wall = rnd(b, 0.5f, 0.75f) * b->deep;
    hall(b, wall, fs_things_pick(w, 2) ? PAINT_STAINED : PAINT_PANELS, 0.09f, 1.6f);
    float width = rnd(b, 1.1f, 1.35f), left = rnd(b, -0.15f, 0.05f), x = left + 0.5f * width;
    fs_things_picture(w, at(b, x, wall - 0.005f, 1.5f, 0), width, rnd(b, 0.75f, 0.9f), PAINT_POSTER);
    hang(b, left - 0.26f, wall, rnd(b, 1.3f, 1.45f), 0.36f, 0.5f, PAINT_NEWS);
    hang(b, left - 0.6f, wall, rnd(b, 1.4f, 1.6f), 0.24f, 0.4f, PAINT_COVER);
    gallery(b, left + width + 0.12f, 2.9f, wall, 1.55f, 0.75f);
    gallery(b, left + width, 2.9f, wall, 0.8f, 0.55f);
    gallery(b, left - 0.1f, 2.7f, wall, 2.25f, 0.45f);
    // a sideboard under the poster, with things
    float top = rnd(b, 0.9f, 0.96f), deep = fminf(0.34f, wall - 0.14f);
    fs_things_table(w, at(b, 0.9f, wall - 0.5f * deep, 0, 0), 2.9f, deep, top, b->stock.wood[fs_things_pick(w, 2)]);
    float a = -0.45f * b->side, c = 2.2f * b->side;
    fs_things_row(w, at(b, 0, wall - 0.5f * deep, top, 0), fminf(a, c), fmaxf(a, c), deep - 0.05f, rnd(b, 0.17f, 0.24f),
                  &b->stock);
}

// Nothing but flat pictures close behind the pane, as under framed glass.
static void pictures(Build *b)
{
    float wall = rnd(b, 0.14f, 0.18f), width = rnd(b, 1.1f, 1.35f), left = rnd(b, -0.15f, 0.05f);
    hall(b, wall, PAINT_PLASTER, 0.09f, 1.6f);
    hang(b, left + 0.5f * width, wall, 1.5f, width, rnd(b, 0.75f, 0.9f), PAINT_POSTER);
    gallery(b, left - 0.9f, left - 0.05f, wall, 1.5f, 0.75f);
    gallery(b, left + width + 0.05f, 2.9f, wall, 1.5f, 0.75f);
    gallery(b, left - 0.8f, 2.9f, wall, 0.8f, 0.55f);
    gallery(b, left - 0.8f, 2.7f, wall, 2.25f, 0.45f);
}

static void shelf(Build *b)
{
    World *w = b->w;
    float front = rnd(b, 0.2f, 0.3f), deep = rnd(b, 0.36f, 0.45f) * fminf(b->deep, 1.5f);
    float wall = (front + deep + rnd(b, 0.25f, 0.45f)) * (b->deep > 1 ? 1.5f : 1);
    hall(b, wall, fs_things_pick(w, 2) ? PAINT_BRICK : PAINT_STAINED, -1, 1.2f);
    gallery(b, -0.9f, 2.7f, wall, 1.75f, 0.6f);
    gallery(b, -0.9f, 2.7f, wall, 1.1f, 0.6f);
    float step = rnd(b, 0.34f, 0.4f), z = rnd(b, 0.52f, 0.62f);
    int board = fs_things_pick(w, 2) ? b->stock.metal : b->stock.wood[0];
    for (int i = 0; i < 5; i++, z += step) {
        float x0 = b->side > 0 ? -1.0f : -2.9f, x1 = x0 + 3.9f;
        fs_world_box(w, b->f, vec(x0, front, z), vec(x1, front + deep, z + 0.025f), board);
        fs_things_row(w, frame_at(b->f, vec(0, front + 0.5f * deep, z + 0.025f), 0), x0 + 0.05f, x1 - 0.25f,
                      0.85f * deep, 0.8f * step, &b->stock);
    }
    float first = rnd(b, -0.5f, -0.25f);
    for (float x = first; x < 2.9f; x += 0.95f)
        for (int i = 0; i < 2; i++) {
            float y = front + (i ? deep - 0.03f : 0.0f), px = b->side * x;
            fs_world_box(w, b->f, vec(px - 0.02f, y - 0.012f, 0), vec(px + 0.02f, y + 0.03f, 2.5f), board);
        }
}

// A table-top case under a pane that lies almost flat.
static void display_case(Build *b)
{
    World *w = b->w;
    const float table = 0.72f, half_x = 0.95f, y0 = -0.45f, y1 = 0.85f;
    float floor = table - 0.12f * b->deep;
    static const Paint cloths[] = {PAINT_STONE, PAINT_FABRIC, PAINT_FLORAL, PAINT_WOOD, PAINT_CARPET};
    int cloth = fs_world_tiled(w, cloths[fs_things_pick(w, 5)], -1, 0.42f), frame = b->stock.wood[1];
    fs_world_room(w, b->f, vec(-half_x, y0, floor), vec(half_x, y1, table + 0.1f),
                  (int[]){frame, frame, frame, frame, cloth, -1});
    for (int i = 0; i < 46; i++) { // a jittered grid, so that little overlaps
        float x = -0.75f + 0.21f * (float)(i % 8) + rnd(b, -0.05f, 0.05f),
              y = -0.3f + 0.19f * (float)(i / 8) + rnd(b, -0.04f, 0.04f);
        Frame f = frame_at(b->f, vec(x, y, floor), rnd(b, -1.5f, 1.5f));
        float size = rnd(b, 0.07f, 0.15f), high = rnd(b, 0.02f, 0.09f) * fminf(b->deep, 1.6f);
        int glaze = b->stock.glaze[fs_things_pick(w, 5)];
        switch (fs_things_pick(w, 9)) {
        case 0: fs_things_ring(w, f, 0.5f * size, rnd(b, 0.012f, 0.025f), glaze); break;
        case 1: fs_things_ball(w, f, rnd(b, 0.02f, 0.045f), glaze); break;
        case 2: fs_things_pile(w, f, 1 + fs_things_pick(w, 3), &b->stock); break;
        case 3:
            fs_world_box6(w, f, vec(-0.1f, -0.035f, 0), vec(0.1f, 0.035f, 0.018f),
                          (int[]){b->stock.dark, b->stock.dark, b->stock.dark, b->stock.dark, -1, b->stock.keys});
            break;
        case 4: fs_things_tin(w, f, 0.3f * size, high, b->stock.label[fs_things_pick(w, 8)], b->stock.checker); break;
        case 5:
            fs_world_box6(
                w, f, vec(-0.03f, -0.03f, 0), vec(0.03f, 0.03f, 0.06f),
                (int[]){b->stock.checker, b->stock.checker, b->stock.checker, b->stock.checker, -1, b->stock.checker});
            break;
        case 6: {
            Frame lying = frame_pitch(f, 1.5707963f);
            lying.o = vec_mad(lying.o, b->f.z, 0.002f);
            fs_things_picture(w, lying, size, 1.3f * size, i & 1 ? PAINT_COVER : PAINT_NEWS);
            break;
        }
        default: fs_things_carton(w, f, size, 0.7f * size, high, &b->stock);
        }
    }
    fs_world_light(w, b->f, vec(-0.9f, 0, 2.5f), vec(1.2f, 0, 0), vec(0, -0.6f, 0), vec(4.6f, 4.9f, 5.2f));
    fs_world_light(w, b->f, vec(0.6f, 1.1f, 2.5f), vec(0.8f, 0, 0), vec(0, -0.6f, 0), vec(4.4f, 4.4f, 4.2f));
    w->fill = vec(0.4f, 0.41f, 0.43f);
}

static void cabinet(Build *b)
{
    World *w = b->w;
    float front = rnd(b, 0.45f, 0.6f), wall = (front + 0.75f) * b->deep, deep = 0.45f, top = rnd(b, 0.85f, 0.95f);
    hall(b, wall, fs_things_pick(w, 2) ? PAINT_PANELS : PAINT_STAINED, -1, 1.8f);
    gallery(b, -0.6f, 3.0f, wall, 1.85f, 0.75f);
    gallery(b, 0.2f, 3.0f, wall, 1.2f, 0.6f);
    hang(b, -0.35f, wall, 1.2f, 0.5f, 0.65f, PAINT_POSTER);
    Frame f = at(b, 0.95f, front + 0.5f * deep, 0, 0);
    fs_things_drawers(w, f, 2.3f, deep, top, b->stock.wood[fs_things_pick(w, 2)], &b->stock);
    float at_layer = top + 0.026f;
    for (int layer = 0; layer < 3; layer++) { // cartons on cartons
        float high = 0.0f;
        for (float x = 0.0f + 0.18f * (float)layer; x < 2.0f - 0.15f * (float)layer; x += rnd(b, 0.24f, 0.34f)) {
            float y = front + 0.22f + rnd(b, -0.05f, 0.08f);
            Frame c = at(b, x, y, at_layer, rnd(b, -0.25f, 0.25f));
            float h = rnd(b, 0.15f, 0.24f);
            high = fmaxf(high, 0.15f);
            if (layer == 2 || fs_things_pick(w, 5) == 0)
                fs_things_any(w, c, 0.18f, h, &b->stock);
            else
                fs_things_carton(w, c, rnd(b, 0.2f, 0.27f), 0.25f, layer ? h : 0.15f + 0.1f * (h - 0.15f), &b->stock);
        }
        at_layer += high + 0.012f;
    }
    fs_things_tin(w, at(b, -0.45f, front + 0.1f, 0, 0), 0.17f, 1.0f, b->stock.basket, b->stock.fabric[0]);
    fs_things_vase(w, at(b, -0.45f, front + 0.1f, 1.0f, 0), 0.38f, b->stock.glaze[0]);
    // the pole of a lamp between the pane and the cabinet
    float x = rnd(b, 0.25f, 0.45f) * b->side, y = rnd(b, 0.18f, 0.26f);
    fs_things_rod(w, vec(x, y, 0), vec(x, y, 2.1f), rnd(b, 0.012f, 0.018f), b->stock.dark);
    fs_things_rod(w, vec(x, y, 1.62f), vec(x + 0.25f * b->side, y + 0.1f, 1.72f), 0.009f, b->stock.dark);
    fs_things_turned(w, frame_at(b->f, vec(x + 0.25f * b->side, y + 0.1f, 1.62f), 0),
                     (Knot[]){{0.075f, 0}, {0.05f, 0.08f}, {0.015f, 0.1f}, {0, 0.1f}}, 4, 20, b->stock.glaze[4]);
}

static void shop_window(Build *b)
{
    World *w = b->w;
    float wall = rnd(b, 0.95f, 1.15f) * b->deep;
    hall(b, wall, fs_things_pick(w, 2) ? PAINT_TILES : PAINT_BRICK, -1, 1.2f);
    gallery(b, -0.2f, 2.9f, wall, 1.55f, 0.7f);
    gallery(b, -0.2f, 2.9f, wall, 0.75f, 0.6f);
    int velvet = fs_world_tiled(w, PAINT_FABRIC, -1, 0.5f), banner = fs_world_painted(w, PAINT_POSTER, -1, 0.9f, 1.3f);
    for (int i = 0; i < 3; i++) { // curtains
        fs_things_cloth(w, at(b, i == 0 ? -0.35f : 1.25f + 0.95f * (float)i, wall - 0.12f, 2.5f, 0),
                        i == 0 ? 0.6f : 0.45f, 2.4f, 0.035f, velvet);
    }
    float hung = rnd(b, 1.5f, 1.7f);
    fs_things_cloth(w, at(b, hung, wall - 0.35f, 2.15f, rnd(b, -0.3f, 0.1f)), 0.8f, 1.2f, 0.012f, banner);
    for (int i = 0; i < 9; i++) { // pedestals of several heights, one thing on each
        float x = -0.25f + 0.34f * (float)(i % 5) + 0.42f * (float)(i / 5) + rnd(b, -0.05f, 0.05f);
        float y = (i < 5 ? 0.34f : 0.68f) + rnd(b, -0.06f, 0.06f), h = rnd(b, 0.72f, 1.05f) + (i < 5 ? 0.0f : 0.3f);
        Frame p = at(b, x, y * (1 + 0.4f * (b->deep - 1)), 0, rnd(b, -0.4f, 0.4f));
        int body = i % 3 == 0 ? b->stock.wood[i & 1] : i % 3 == 1 ? b->stock.fabric[i & 3] : b->stock.label[i & 7];
        fs_world_box(w, p, vec(-0.11f, -0.11f, 0), vec(0.11f, 0.11f, h), body);
        Frame on = frame_at(p, vec(0, 0, h), 0);
        int glaze = b->stock.glaze[fs_things_pick(w, 4)];
        switch (i % 6) {
        case 0: fs_things_vase(w, on, rnd(b, 0.28f, 0.38f), glaze); break;
        case 1: fs_things_ball(w, on, rnd(b, 0.09f, 0.12f), glaze); break;
        case 2: fs_things_bag(w, on, 0.22f, 0.28f, b->stock.fabric[fs_things_pick(w, 4)]); break;
        case 3: fs_things_plant(w, on, rnd(b, 0.3f, 0.4f), &b->stock); break;
        case 4: fs_things_cushion(w, on, 0.3f, 0.26f, 0.13f, b->stock.fabric[fs_things_pick(w, 4)]); break;
        default: fs_things_pile(w, on, 5, &b->stock);
        }
    }
}

static const struct {
    const char *name;
    void (*build)(Build *b);
} scenes[LAYOUTS] = {
    {"wall of posters", posters}, {"shelf", shelf}, {"display case", display_case}, {"cabinet", cabinet},
    {"shop window", shop_window},
};

// Where one stands: oblique to the pane, so that the flash's own mirror image stays out of the view, as long as nothing
// else is asked for.
static void stand_before(Layout *l, const Spec *spec, Rng *rng, bool flat)
{
    float turn = 0.6109f + 0.05f * (fs_rng_uniform(rng) - 0.5f), tilt[2];
    for (int i = 0; i < 2; i++) tilt[i] = 0.1f * (fs_rng_uniform(rng) - 0.5f);
    turn *= spec->turn;
    if (flat) {
        float away = 0.62f + 0.06f * fs_rng_uniform(rng);
        turn = 0.82f * spec->turn;
        l->pane_point = vec(0, 0.12f, 0.76f);
        l->pane_normal = vec_unit(vec(tilt[0], tilt[1] - 0.03f, 1));
        l->stand = vec_add(l->pane_point, vec(0, -away * sinf(turn), away * cosf(turn)));
        l->span_x = 0.48f;
        l->span_y = 0.3f;
    } else {
        float away = 1.15f + 0.15f * fs_rng_uniform(rng);
        l->pane_point = vec(0, 0, 1.38f + 0.06f * fs_rng_uniform(rng));
        l->pane_normal = vec_unit(vec(tilt[0], -1, 0.7f * tilt[1]));
        l->stand = vec_add(l->pane_point, vec(-l->side * away * sinf(turn), -away * cosf(turn), 0.02f));
        l->span_x = 0.66f;
        l->span_y = 0.38f;
    }
    Vec ahead = vec_unit(vec_sub(l->pane_point, l->stand));
    l->look_at = vec_mad(l->pane_point, ahead, flat ? 0.2f : 0.8f * spec->depth_stretch);
}

void fs_behind_build(Layout *layout, const Spec *spec, int which)
{
    Build b = {.w = &layout->behind, .f = frame_identity(), .side = layout->side, .deep = spec->depth_stretch};
    Rng rng = fs_rng_new(spec->seed * 31ull + 7);
    stand_before(layout, spec, &rng, which == LAYOUT_CASE);
    fs_things_stock(b.w, &b.stock);
    layout->name = spec->picture ? "pictures" : scenes[which].name;
    (spec->picture ? pictures : scenes[which].build)(&b);
}

// Bars of the window the pane is set in, where they cross the picture at its left or right and below.
void fs_behind_frame(Layout *l)
{
    World *w = &l->behind;
    int bar = fs_world_tiled(w, PAINT_WOOD, -1, 0.84f);
    fs_world_edit(w, bar)->in_front = true;
    bool flat = fabsf(l->pane_normal.z) > 0.5f;
    Frame f = {.o = l->pane_point, .y = vec_scale(l->pane_normal, -1)};
    f.x = vec_unit(vec_cross(f.y, flat ? vec(0, 1, 0) : vec(0, 0, 1)));
    f.z = vec_cross(f.x, f.y);
    float half = 0.46f * vec_length(vec_sub(l->stand, l->pane_point)),
          thick = flat ? 0.014f : 0.03f; // of the picture, of the bars
    float x = -0.62f * half * l->side, z = flat ? -0.75f * half : -0.5f * half;
    fs_world_box(w, f, vec(x - thick, -thick, -2), vec(x + thick, 0.02f, 2), bar);
    fs_world_box(w, f, vec(-3, -1.1f * thick, z - thick), vec(3, 0.02f, z + thick), bar);
}
