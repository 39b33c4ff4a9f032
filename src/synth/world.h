// One lit set: parallelograms and triangles with textures, area lights, baked ambient light, and a hierarchy to trace
// rays through. A capture has two: what is behind the pane, and the room that is mirrored in it.
#pragma once

#include "base/threads.h"
#include "base/error.h"
#include "synth/bvh.h"
#include "synth/paint.h"

// What a surface is made of.
typedef struct Surface {
    int texture;   // index into World.texture, or -1
    Vec tint;      // linear albedo, multiplies the texture
    float repeat;  // metres per repetition of the texture; 0: the texture covers the face once
    float gloss;   // strength of the highlight of the flash
    float glow;    // own light (lamps), linear, not lit
    bool thin;     // lies on another surface: casts no ambient shadow on it
    bool in_front; // before the pane: seen without it
} Surface;

// What shading needs of a primitive; the corners are in the hierarchy's PrimShape.
typedef struct PrimLook {
    Vec normal, normal_a, normal_b; // at corner 0, and its change along both edges
    float u, v, u_a, v_a, u_b, v_b; // texture coordinates likewise
    float texels_per_metre;
    int surface;
    int light, light_a, light_b; // triangle: three light points; parallelogram: first of a grid of a x b points
} PrimLook;

typedef struct LightPoint {
    Vec at, normal;
    Vec light; // ambient irradiance / pi, so that radiance = albedo * light
} LightPoint;

typedef struct AreaLight {
    Vec corner, edge_a, edge_b; // shines to the side of edge_a x edge_b
    Vec radiance;
} AreaLight;

typedef struct World {
    PrimShape *shape; // (n) by primitive number
    PrimLook *look;   // (n)
    int n;
    Surface *surface;
    int n_surfaces;
    LightPoint *point;
    int n_points;
    Texture *texture;
    int n_textures;
    AreaLight light[16];
    int n_lights;
    Vec fill;     // light that comes from everywhere, linear
    float bounce; // 0..1: how much of the light that surfaces give each other counts
    Bvh bvh;
    bool failed; // out of memory while building; the builder calls below never fail themselves
    // for the builders:
    Rng rng;
    float px_per_cm;    // of textures
    float light_step;   // metres between baked light points on flat faces
    float texture_keep; // 0..1: share of rich textures kept (the rest become plain)
} World;

void fs_world_free(World *world);
int fs_world_surface(World *world, Surface surface); // index
// Painted once for a face of w x h metres.
int fs_world_painted(World *world, Paint paint, float hue, float w_m, float h_m);
// Painted as a square of `repeat` metres that tiles the face.
int fs_world_tiled(World *world, Paint paint, float hue, float repeat);
int fs_world_color(World *world, Color coded);     // plain
Surface *fs_world_edit(World *world, int surface); // never NULL

// All positions are in the frame; normals face edge_a x edge_b.
void fs_world_quad(World *world, Frame f, Vec corner, Vec edge_a, Vec edge_b, int surface);
// Box from low to high corner; every side has its own surface (side[0..5]: front -y, back, left -x, right, bottom,
// top).
void fs_world_box6(World *world, Frame f, Vec low, Vec high, const int side[6]);
void fs_world_box(World *world, Frame f, Vec low, Vec high, int surface);
// The inside of a box: walls front (-y side), back, left, right, floor, ceiling; -1 leaves a side open.
void fs_world_room(World *world, Frame f, Vec low, Vec high, const int side[6]);
// A curved sheet of nu x nv cells; at(context, u, v) for u, v in 0..1 gives points, outside is du x dv. The texture is
// repeated repeat_u and repeat_v times along u and v.
typedef struct Sheet {
    int nu, nv;
    float repeat_u, repeat_v;
    Vec (*at)(const void *context, float u, float v);
    const void *context;
} Sheet;
void fs_world_sheet(World *world, Frame f, Sheet sheet, int surface);
// A parallelogram that shines; one more than there is room for is left out.
void fs_world_light(World *world, Frame f, Vec corner, Vec edge_a, Vec edge_b, Vec radiance);

int fs_world_finish(World *world, FsError *err);                   // builds the hierarchy
int fs_bake_ambient(World *world, Threads *threads, FsError *err); // then: the ambient light on every surface

// Ambient light at a point of a primitive, and its colour.
Vec fs_world_ambient(const World *world, const Hit *hit);
Vec fs_world_mean_light(const World *world); // of all its baked points
Vec fs_world_albedo(const World *world, const Hit *hit,
                    float spread_m); // spread_m: width of the looked-up area, metres
Vec fs_world_normal(const World *world, const Hit *hit);
static inline const Surface *fs_world_surface_of(const World *world, const Hit *hit)
{
    return &world->surface[world->look[hit->prim].surface];
}
