// Things that stand, lie or hang in a scene. Each is built in a frame whose origin is where it stands (middle of its
// bottom) or hangs (middle of its back), x to the right, y away from the viewer, z up; sizes in metres.
#pragma once

#include "synth/world.h"

float fs_things_range(World *world, float low, float high); // random
int fs_things_pick(World *world, int n);                    // 0 .. n-1

// The surfaces that several things share, painted once per world.
typedef struct Stock {
    int label[8], carton[3], cover[4], fabric[4], basket, metal, dark, white, wood[2], keys, checker, leaf, glaze[5];
} Stock;
void fs_things_stock(World *world, Stock *stock);

// Round things.
typedef struct Knot {
    float radius, height;
} Knot;
void fs_things_turned(World *w, Frame f, const Knot *knot, int n, int segments, int surface); // about z
void fs_things_ball(World *w, Frame f, float radius, int surface);
void fs_things_tin(World *w, Frame f, float radius, float height, int surface, int lid);
void fs_things_rod(World *w, Vec from, Vec to, float radius, int surface);      // world coordinates
void fs_things_ring(World *w, Frame f, float radius, float thick, int surface); // lying
void fs_things_vase(World *w, Frame f, float height, int surface);
void fs_things_bottle(World *w, Frame f, float height, int surface);
void fs_things_cushion(World *w, Frame f, float width, float height, float thick, int surface); // upright
void fs_things_bag(World *w, Frame f, float width, float height, int surface);
void fs_things_cloth(World *w, Frame f, float width, float height, float fold,
                     int surface); // hanging from z=0 down
void fs_things_plant(World *w, Frame f, float height, const Stock *s);

// Angular things.
void fs_things_carton(World *w, Frame f, float width, float depth, float height, const Stock *s);
void fs_things_books(World *w, Frame f, float length, float height, const Stock *s); // a row, upright
void fs_things_pile(World *w, Frame f, int n, const Stock *s);                       // of books, lying
void fs_things_picture(World *w, Frame f, float width, float height, Paint paint);   // hangs, centre at origin
void fs_things_any(World *w, Frame f, float width, float height, const Stock *s);    // something for a shelf
// Things side by side along x from x0 to x1 at the frame's z = 0, at most `high` high.
void fs_things_row(World *w, Frame f, float x0, float x1, float depth, float high, const Stock *s);

// Furniture.
void fs_things_table(World *w, Frame f, float width, float depth, float height, int surface);
void fs_things_chair(World *w, Frame f, int seat, int legs);
void fs_things_rack(World *w, Frame f, Vec size, int boards, int surface, const Stock *s);
void fs_things_drawers(World *w, Frame f, float width, float depth, float height, int surface, const Stock *s);
void fs_things_door(World *w, Frame f, float hue); // in a wall: the frame's y = 0 is the wall
void fs_things_window(World *w, Frame f, float width, float height, Vec sky); // in a wall, centre at origin
void fs_things_floor_lamp(World *w, Frame f, float height, Vec light);
void fs_things_pendant(World *w, Frame f, float drop, Vec light); // hangs from the origin
void fs_things_sofa(World *w, Frame f, float width, int cloth, const Stock *s);
void fs_things_monitor(World *w, Frame f);
