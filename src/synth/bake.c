// Area lights with soft shadows, then two bounces between the surfaces. The same sampling pattern is used at every
// point, so that what is left of the sampling error is smooth, not noise.
#include "synth/world.h"

#include "base/arena.h"

#define PER_JOB 64
#define LIGHT_SIDE 4 // samples of a light: LIGHT_SIDE^2
#define BOUNCE_RAYS 48
#define BOUNCES 2

typedef struct Bake {
    const World *world;
    const Vec *mean; // albedo per surface
    Vec *direct, *result;
    bool bounce;
} Bake;

static Vec lit_directly(const World *world, const LightPoint *p)
{
    Vec sum = vec(0, 0, 0);
    Vec from = vec_mad(p->at, p->normal, 2e-3f);
    for (int l = 0; l < world->n_lights; l++) {
        const AreaLight *light = &world->light[l];
        Vec side = vec_cross(light->edge_a, light->edge_b);
        float area = vec_length(side), weight = 0.0f;
        side = vec_scale(side, 1.0f / area);
        for (int i = 0; i < LIGHT_SIDE * LIGHT_SIDE; i++) {
            float a = ((float)(i % LIGHT_SIDE) + 0.5f) / LIGHT_SIDE, b = ((float)(i / LIGHT_SIDE) + 0.5f) / LIGHT_SIDE;
            Vec to = vec_sub(vec_mad(vec_mad(light->corner, light->edge_a, a), light->edge_b, b), from);
            float d2 = vec_dot(to, to), d = sqrtf(d2), cos_here = vec_dot(to, p->normal) / d;
            if (cos_here <= 0.0f) continue;
            float cos_there = -vec_dot(to, side) / d;
            if (cos_there <= 0.0f) continue;
            if (fs_bvh_blocked(&world->bvh, from, to, 1e-4f, 0.999f, SHAPE_THIN | SHAPE_GLOW)) continue;
            weight += cos_here * cos_there / fmaxf(d2, 0.02f);
        }
        sum = vec_mad(sum, light->radiance, weight * area / (3.14159265f * LIGHT_SIDE * LIGHT_SIDE));
    }
    return sum;
}

static Vec lit_by_others(const Bake *bake, const LightPoint *p)
{
    const World *world = bake->world;
    Vec from = vec_mad(p->at, p->normal, 2e-3f), t, b, sum = vec(0, 0, 0);
    vec_basis(p->normal, &t, &b);
    for (int i = 0; i < BOUNCE_RAYS; i++) { // cosine-weighted, so that each ray counts the same
        float u = ((float)i + 0.5f) / BOUNCE_RAYS, phi = 6.2831853f * 0.61803399f * (float)i, r = sqrtf(u);
        Vec d = vec_scale(p->normal, sqrtf(1.0f - u));
        d = vec_mad(vec_mad(d, t, r * cosf(phi)), b, r * sinf(phi));
        Hit hit = {.t = 1e9f};
        if (fs_bvh_hit(&world->bvh, from, d, &hit))
            sum = vec_add(sum, vec_mul(bake->mean[world->look[hit.prim].surface], fs_world_ambient(world, &hit)));
        else
            sum = vec_add(sum, world->fill);
    }
    return vec_scale(sum, world->bounce / BOUNCE_RAYS);
}

static void bake_job(void *context, int job, int worker)
{
    Bake *bake = context;
    int end = (job + 1) * PER_JOB < bake->world->n_points ? (job + 1) * PER_JOB : bake->world->n_points;
    (void)worker;
    for (int i = job * PER_JOB; i < end; i++) {
        const LightPoint *p = &bake->world->point[i];
        if (!bake->bounce)
            bake->result[i] = bake->direct[i] = lit_directly(bake->world, p);
        else
            bake->result[i] = vec_add(bake->direct[i], lit_by_others(bake, p));
    }
}

int fs_bake_ambient(World *world, Threads *threads, FsError *err)
{
    int rc = 0, n = world->n_points;
    Arena arena = {0};
    Vec *mean = ARENA_NEW(&arena, Vec, world->n_surfaces);
    Bake bake = {world, mean, ARENA_NEW(&arena, Vec, n), ARENA_NEW(&arena, Vec, n), false};
    if (arena.failed) TRY(fs_error_memory(err));
    for (int i = 0; i < world->n_surfaces; i++) {
        const Surface *s = &world->surface[i];
        mean[i] = s->texture < 0 ? s->tint : vec_mul(s->tint, world->texture[s->texture].mean);
    }
    for (int pass = 0; pass <= BOUNCES; pass++) {
        bake.bounce = pass > 0;
        fs_threads_for(threads, (n + PER_JOB - 1) / PER_JOB, bake_job, &bake);
        for (int i = 0; i < n; i++) world->point[i].light = bake.result[i];
    }
fail:
    fs_arena_free(&arena);
    return rc;
}
