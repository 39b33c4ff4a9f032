// Lamps among what is behind the pane, as display cases and shop windows have them: strips of light, spots, and a
// screen. They shine by themselves: the flash adds nothing to them, as it adds nothing to most of what is mirrored.
#include "synth/layout.h"

#define STRIP 30.0f // radiance of a strip; most of what they light has 1 or less
#define SPOT 40.0f

// A strip from x0 to x1 at y and z, in its dark housing; shines forward and down.
static void strip(World *w, Frame f, float x0, float x1, int housing)
{
    const float high = 0.012f;
    int glow = fs_world_surface(w, (Surface){-1, vec(1, 0.93f, 0.82f), .glow = STRIP});
    fs_world_box(w, f, vec(x0, 0, 0), vec(x1, 0.04f, 0.03f), housing);
    fs_world_quad(w, f, vec(x0, -0.002f, 0.004f), vec(x1 - x0, 0, 0), vec(0, 0, high), glow);
    fs_world_light(w, f, vec(x0, -0.004f, -0.002f), vec(0, high, 0), vec(x1 - x0, 0, 0),
                   vec(STRIP, 0.93f * STRIP, 0.82f * STRIP));
}

// The head of a spot, shining down.
static void spot(World *w, Frame f, float size, int housing)
{
    int glow = fs_world_surface(w, (Surface){-1, vec(1, 0.9f, 0.74f), .glow = SPOT});
    fs_things_turned(w, f, (Knot[]){{size, 0}, {0.9f * size, 2.6f * size}, {0, 2.9f * size}}, 3, 20, housing);
    fs_things_ball(w, f, 0.7f * size, glow);
    fs_world_light(w, f, vec(-0.6f * size, -0.6f * size, -0.8f * size), vec(0, 1.2f * size, 0), vec(1.2f * size, 0, 0),
                   vec(SPOT, 0.9f * SPOT, 0.74f * SPOT));
}

// A picture that shines, in a dark frame.
static void screen(World *w, Frame f, float width, float height, int housing)
{
    int glow = fs_world_painted(w, PAINT_COVER, -1, width, height);
    fs_world_edit(w, glow)->glow = 1.4f;
    float x = 0.5f * width;
    fs_world_box(w, f, vec(-x - 0.012f, 0.001f, -0.012f), vec(x + 0.012f, 0.015f, height + 0.012f), housing);
    fs_world_quad(w, f, vec(-x, 0, 0), vec(width, 0, 0), vec(0, 0, height), glow);
}

// On stands among what lies in a case.
static void light_case(World *w, Frame f, int housing)
{
    const float bottom = 0.6f;
    strip(w, frame_at(f, vec(0, 0.45f, bottom + 0.07f), 0), -0.3f, 0.3f, housing);
    for (int i = 0; i < 2; i++) {
        float x = (i ? 0.2f : -0.25f) + fs_things_range(w, -0.05f, 0.05f), y = fs_things_range(w, -0.05f, 0.25f);
        fs_things_rod(w, vec(x + 0.02f, y, bottom), vec(x + 0.02f, y, bottom + 0.09f), 0.003f, housing);
        spot(w, frame_at(f, vec(x, y, bottom + 0.055f), 0), 0.013f, housing);
    }
    screen(w, frame_pitch(frame_at(f, vec(0, 0.32f, bottom + 0.01f), 0.1f), 1.2f), 0.17f, 0.12f, housing);
}

void fs_lamps_build(Layout *l)
{
    World *w = &l->behind;
    int housing = fs_world_color(w, vec(0.2f, 0.2f, 0.21f));
    Frame f = frame_identity();
    if (fabsf(l->pane_normal.z) > 0.5f) {
        light_case(w, f, housing);
        return;
    }
    float left = l->side > 0 ? -0.7f : -2.7f;
    strip(w, frame_at(f, vec(0, fs_things_range(w, 0.2f, 0.35f), 1.83f), 0), left, left + 3.4f, housing);
    for (int i = 0; i < 3; i++) { // that hang from the ceiling
        float x = l->side * (0.1f + 0.6f * (float)i + fs_things_range(w, -0.1f, 0.1f));
        float y = fs_things_range(w, 0.16f, 0.22f), z = fs_things_range(w, 1.6f, 1.72f);
        fs_things_rod(w, vec(x, y, z + 0.08f), vec(x, y, 2.6f), 0.006f, housing);
        spot(w, frame_at(f, vec(x, y, z), 0), 0.034f, housing);
    }
    screen(w, frame_at(f, vec(l->side * fs_things_range(w, 0.5f, 0.8f), 0.14f, fs_things_range(w, 1.0f, 1.1f)), 0),
           0.3f, 0.19f, housing);
}
