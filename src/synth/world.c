// Building a world: primitives, surfaces, light points; and looking them up at a hit.
#include "synth/world.h"

#include <stdlib.h>

#include "base/memory.h"

void fs_world_free(World *world)
{
    for (int i = 0; i < world->n_textures; i++) fs_texture_free(&world->texture[i]);
    free(world->texture);
    free(world->surface);
    free(world->point);
    free(world->shape);
    free(world->look);
    fs_bvh_free(&world->bvh);
    *world = (World){0};
}

// Room for one more element in an array (given by its address) of n elements; false when out of memory.
static bool reserve(World *world, void *array, int n, size_t size)
{
    world->failed = world->failed || fs_memory_grow(array, n, size, NULL) < 0;
    return !world->failed;
}

static int texture_of(World *world, Paint paint, float hue, float w_m, float h_m)
{
    if (!reserve(world, &world->texture, world->n_textures, sizeof *world->texture)) return -1;
    Texture *t = &world->texture[world->n_textures];
    if (fs_paint_texture(t, paint, hue, 100 * w_m, 100 * h_m, world->px_per_cm, &world->rng) < 0) {
        fs_texture_free(t);
        world->failed = true;
        return -1;
    }
    return world->n_textures++;
}

int fs_world_surface(World *world, Surface surface)
{
    if (!reserve(world, &world->surface, world->n_surfaces, sizeof surface)) return 0;
    world->surface[world->n_surfaces] = surface;
    return world->n_surfaces++;
}

// A scene poor in texture replaces some of its paintings by plain colour.
static Paint thinned(World *world, Paint paint)
{
    bool rich = paint != PAINT_PLAIN && paint != PAINT_PLASTER && paint != PAINT_METAL && paint != PAINT_WOOD;
    bool keep = fs_rng_uniform(&world->rng) < world->texture_keep;
    return keep || !rich ? paint : PAINT_PLAIN;
}

int fs_world_painted(World *world, Paint paint, float hue, float w_m, float h_m)
{
    paint = thinned(world, paint);
    return fs_world_surface(world, (Surface){texture_of(world, paint, hue, w_m, h_m), vec(1, 1, 1), .gloss = 0});
}

int fs_world_tiled(World *world, Paint paint, float hue, float repeat)
{
    int surface = fs_world_painted(world, paint, hue, repeat, repeat);
    fs_world_edit(world, surface)->repeat = repeat;
    return surface;
}

int fs_world_color(World *world, Color coded)
{
    const float *linear = fs_texture_linear();
    Vec tint = vec(linear[(int)(255 * coded.x)], linear[(int)(255 * coded.y)], linear[(int)(255 * coded.z)]);
    return fs_world_surface(world, (Surface){-1, tint, .gloss = 0});
}

Surface *fs_world_edit(World *world, int surface)
{
    static _Thread_local Surface dummy; // written to, never read, after a failure
    return world->failed ? &dummy : &world->surface[surface];
}

static int add_point(World *world, Vec at, Vec normal)
{
    if (!reserve(world, &world->point, world->n_points, sizeof *world->point)) return 0;
    world->point[world->n_points] = (LightPoint){.at = at, .normal = normal};
    return world->n_points++;
}

static void add_prim(World *world, PrimShape shape, PrimLook look)
{
    if (!reserve(world, &world->shape, world->n, sizeof *world->shape)) return;
    if (!reserve(world, &world->look, world->n, sizeof *world->look)) return;
    const Surface *s = &world->surface[look.surface];
    shape.number = world->n;
    shape.flags = (unsigned char)((s->thin ? SHAPE_THIN : 0) | (s->glow > 0 ? SHAPE_GLOW : 0));
    if (s->texture >= 0) {
        const Texture *t = &world->texture[s->texture];
        float uv = fabsf(look.u_a * look.v_b - look.u_b * look.v_a) * (float)t->width[0] * (float)t->height[0];
        float area = vec_length(vec_cross(shape.edge_a, shape.edge_b));
        look.texels_per_metre = sqrtf(uv / fmaxf(area, 1e-10f));
    }
    world->shape[world->n] = shape;
    world->look[world->n++] = look;
}

static int grid_count(float length, float step)
{
    int n = (int)ceilf(length / step) + 1;
    return n < 2 ? 2 : n > 64 ? 64 : n;
}

void fs_world_quad(World *world, Frame f, Vec corner, Vec edge_a, Vec edge_b, int surface)
{
    if (world->failed) return;
    PrimShape shape = {frame_point(f, corner), frame_vector(f, edge_a), frame_vector(f, edge_b), .triangle = 0};
    float la = vec_length(shape.edge_a), lb = vec_length(shape.edge_b), repeat = world->surface[surface].repeat;
    PrimLook look = {.normal = vec_unit(vec_cross(shape.edge_a, shape.edge_b)), .surface = surface};
    look.u_a = repeat > 0 ? la / repeat : 1.0f;
    look.v_b = repeat > 0 ? lb / repeat : 1.0f;
    look.light_a = grid_count(la, world->light_step);
    look.light_b = grid_count(lb, world->light_step);
    look.light = world->n_points;
    for (int j = 0; j < look.light_b; j++)
        for (int i = 0; i < look.light_a; i++) { // the outermost points stay a little inside the face
            float a = 0.01f + 0.98f * (float)i / (float)(look.light_a - 1);
            float b = 0.01f + 0.98f * (float)j / (float)(look.light_b - 1);
            add_point(world, vec_mad(vec_mad(shape.corner, shape.edge_a, a), shape.edge_b, b), look.normal);
        }
    if (!world->failed) add_prim(world, shape, look);
}

void fs_world_box6(World *world, Frame f, Vec low, Vec high, const int side[6])
{
    Vec d = vec_sub(high, low);
    Vec x = vec(d.x, 0, 0), y = vec(0, d.y, 0), z = vec(0, 0, d.z), nx = vec(-d.x, 0, 0), ny = vec(0, -d.y, 0);
    if (side[0] >= 0) fs_world_quad(world, f, low, x, z, side[0]);
    if (side[1] >= 0) fs_world_quad(world, f, vec(high.x, high.y, low.z), nx, z, side[1]);
    if (side[2] >= 0) fs_world_quad(world, f, vec(low.x, high.y, low.z), ny, z, side[2]);
    if (side[3] >= 0) fs_world_quad(world, f, vec(high.x, low.y, low.z), y, z, side[3]);
    if (side[4] >= 0) fs_world_quad(world, f, vec(low.x, high.y, low.z), x, ny, side[4]);
    if (side[5] >= 0) fs_world_quad(world, f, vec(low.x, low.y, high.z), x, y, side[5]);
}

void fs_world_box(World *world, Frame f, Vec low, Vec high, int surface)
{
    fs_world_box6(world, f, low, high, (int[]){surface, surface, surface, surface, surface, surface});
}

void fs_world_room(World *world, Frame f, Vec low, Vec high, const int side[6])
{
    Vec back = vec(low.x, high.y, low.z), front = vec(high.x, low.y, high.z); // swapped: a box seen from inside
    fs_world_box6(world, f, back, front, (int[]){-1, side[0], -1, -1, -1, -1});
    fs_world_box6(world, f, back, front, (int[]){side[1], -1, side[2], side[3], side[4], side[5]});
}

static void add_triangle(World *world, const Vec p[3], const int point[3], const float uv[6], int surface)
{
    PrimShape shape = {p[0], vec_sub(p[1], p[0]), vec_sub(p[2], p[0]), .triangle = 1};
    if (vec_length(vec_cross(shape.edge_a, shape.edge_b)) < 1e-10f) return; // at the pole of a sphere
    Vec n[3];
    for (int i = 0; i < 3; i++) n[i] = world->point[point[i]].normal;
    add_prim(world, shape,
             (PrimLook){.normal = n[0],
                        .normal_a = vec_sub(n[1], n[0]),
                        .normal_b = vec_sub(n[2], n[0]),
                        .u = uv[0],
                        .v = uv[1],
                        .u_a = uv[2] - uv[0],
                        .v_a = uv[3] - uv[1],
                        .u_b = uv[4] - uv[0],
                        .v_b = uv[5] - uv[1],
                        .surface = surface,
                        .light = point[0],
                        .light_a = point[1],
                        .light_b = point[2]});
}

void fs_world_sheet(World *world, Frame f, Sheet s, int surface)
{
    int first = world->n_points, nu = s.nu, nv = s.nv;
    const float h = 1e-3f;
    for (int j = 0; j <= nv; j++)
        for (int i = 0; i <= nu; i++) {
            float u = (float)i / (float)nu, v = (float)j / (float)nv;
            float vs = v < 0.01f ? 0.01f : v > 0.99f ? 0.99f : v; // poles have no tangent
            Vec du = vec_sub(s.at(s.context, u + h, vs), s.at(s.context, u - h, vs));
            Vec dv = vec_sub(s.at(s.context, u, vs + h), s.at(s.context, u, vs - h));
            add_point(world, frame_point(f, s.at(s.context, u, v)), vec_unit(frame_vector(f, vec_cross(du, dv))));
        }
    for (int j = 0; j < nv && !world->failed; j++)
        for (int i = 0; i < nu; i++) {
            int k[4] = {first + j * (nu + 1) + i, 0, 0, 0};
            k[1] = k[0] + 1;
            k[2] = k[0] + nu + 1;
            k[3] = k[2] + 1;
            float u0 = s.repeat_u * (float)i / (float)nu, u1 = s.repeat_u * (float)(i + 1) / (float)nu;
            float v0 = s.repeat_v * (float)j / (float)nv, v1 = s.repeat_v * (float)(j + 1) / (float)nv;
            Vec p[4];
            for (int c = 0; c < 4; c++) p[c] = world->point[k[c]].at;
            add_triangle(world, (Vec[]){p[0], p[1], p[2]}, (int[]){k[0], k[1], k[2]}, (float[]){u0, v0, u1, v0, u0, v1},
                         surface);
            add_triangle(world, (Vec[]){p[3], p[2], p[1]}, (int[]){k[3], k[2], k[1]}, (float[]){u1, v1, u0, v1, u1, v0},
                         surface);
        }
}

void fs_world_light(World *world, Frame f, Vec corner, Vec edge_a, Vec edge_b, Vec radiance)
{
    if (world->n_lights == (int)(sizeof world->light / sizeof *world->light)) return;
    world->light[world->n_lights++] =
        (AreaLight){frame_point(f, corner), frame_vector(f, edge_a), frame_vector(f, edge_b), radiance};
}

int fs_world_finish(World *world, FsError *err)
{
    if (world->failed || fs_bvh_build(&world->bvh, world->shape, world->n) < 0) return fs_error_memory(err);
    return 0;
}

Vec fs_world_ambient(const World *world, const Hit *hit)
{
    const PrimLook *look = &world->look[hit->prim];
    const LightPoint *p = world->point;
    if (world->shape[hit->prim].triangle) {
        Vec l = p[look->light].light;
        l = vec_mad(l, vec_sub(p[look->light_a].light, p[look->light].light), hit->a);
        return vec_mad(l, vec_sub(p[look->light_b].light, p[look->light].light), hit->b);
    }
    int na = look->light_a, nb = look->light_b;
    float x = (hit->a - 0.01f) / 0.98f * (float)(na - 1), y = (hit->b - 0.01f) / 0.98f * (float)(nb - 1);
    x = x < 0 ? 0 : x > (float)(na - 1) ? (float)(na - 1) : x;
    y = y < 0 ? 0 : y > (float)(nb - 1) ? (float)(nb - 1) : y;
    int i = (int)x > na - 2 ? na - 2 : (int)x, j = (int)y > nb - 2 ? nb - 2 : (int)y;
    const LightPoint *q = p + look->light + j * na + i;
    float s = x - (float)i, t = y - (float)j;
    Vec low = vec_mad(q[0].light, vec_sub(q[1].light, q[0].light), s);
    Vec high = vec_mad(q[na].light, vec_sub(q[na + 1].light, q[na].light), s);
    return vec_mad(low, vec_sub(high, low), t);
}

Vec fs_world_mean_light(const World *world)
{
    double sum[3] = {0};
    for (int i = 0; i < world->n_points; i++) {
        sum[0] += (double)world->point[i].light.x;
        sum[1] += (double)world->point[i].light.y;
        sum[2] += (double)world->point[i].light.z;
    }
    double n = world->n_points > 0 ? world->n_points : 1;
    return vec((float)(sum[0] / n), (float)(sum[1] / n), (float)(sum[2] / n));
}

Vec fs_world_albedo(const World *world, const Hit *hit, float spread_m)
{
    const PrimLook *look = &world->look[hit->prim];
    const Surface *s = &world->surface[look->surface];
    if (s->texture < 0) return s->tint;
    float u = look->u + hit->a * look->u_a + hit->b * look->u_b, v = look->v + hit->a * look->v_a + hit->b * look->v_b;
    return vec_mul(s->tint, fs_texture_sample(&world->texture[s->texture], u, v, spread_m * look->texels_per_metre));
}

Vec fs_world_normal(const World *world, const Hit *hit)
{
    const PrimLook *look = &world->look[hit->prim];
    if (!world->shape[hit->prim].triangle) return look->normal;
    return vec_unit(vec_mad(vec_mad(look->normal, look->normal_a, hit->a), look->normal_b, hit->b));
}
