// The scenes: what is behind the pane, where one stands before it, and the room that is mirrored in it.
// World coordinates: x right, y into the transmitted scene, z up, metres; the floor is z = 0.
#pragma once

#include "synth/spec.h"
#include "synth/things.h"

typedef struct Layout {
    World behind, room;
    Vec pane_point, pane_normal; // the point looked through from the middle of the path; normal towards the camera
    float gap;                   // to a second pane behind it, metres; 0: there is none
    Vec tint;                    // what the pane keeps of the light that goes through
    Vec stand;                   // middle of the path
    Vec look_at;                 // what the camera is pointed at
    float span_x, span_y;        // the path's extent to the side and upwards
    float side;                  // +1: looking to the right through the pane, -1: to the left
    const char *name, *room_name;
} Layout;

// Which of the layouts and rooms a seed gets: layout = seed % 5, room = (seed + seed / 5) % 4 (the case has its own).
int fs_layout_build(Layout *layout, const Spec *spec, FsError *err);
void fs_layout_free(Layout *layout);

// behind.c: one function per transmitted scene; room.c: the mirrored rooms. Both fill in what they know.
void fs_behind_build(Layout *layout, const Spec *spec, int which);
void fs_room_build(Layout *layout, const Spec *spec, int which);
void fs_behind_frame(Layout *layout); // the pane's own frame, in view
void fs_lamps_build(Layout *layout);  // lamps.c: strips, spots, a screen
#define LAYOUTS 5
#define LAYOUT_CASE 2
#define ROOMS 4
