// From the seed to a whole scene.
#include "synth/layout.h"

static void world_begin(World *world, uint64_t seed, const Spec *spec, float px_per_cm, float light_step)
{
    *world = (World){.rng = fs_rng_new(seed), .texture_keep = 1.0f, .bounce = 1.0f, .light_step = light_step};
    float detail = (float)(spec->width > spec->height ? spec->width : spec->height) / 600.0f;
    world->px_per_cm = fminf(fmaxf(px_per_cm * detail, 1.0f), 20.0f);
}

// Some materials are dark (cloth, rubber, ink), so that there are surfaces whose only light is the flash's or hardly
// any.
static void darken(World *world, float share, uint64_t seed)
{
    Rng rng = fs_rng_new(seed);
    for (int i = 0; i < world->n_surfaces; i++) {
        Surface *s = &world->surface[i];
        bool chosen = fs_rng_uniform(&rng) < share;
        float albedo = 0.05f + 0.25f * fs_rng_uniform(&rng);
        if (chosen && s->glow <= 0) s->tint = vec_scale(s->tint, albedo);
    }
}

// Less light from everywhere and from the side of the pane: what a shelf's boards keep the lamps from lies in deep
// shade.
static void shade(World *world, float amount)
{
    float keep = 1 - 0.95f * amount;
    world->fill = vec_scale(world->fill, keep);
    world->bounce = 1 - 0.8f * amount;
    for (int i = 1; i < world->n_lights; i++) world->light[i].radiance = vec_scale(world->light[i].radiance, keep);
}

// Green as thick glass is, bronze or blue.
static Vec tint_of(const Spec *spec)
{
    static const Vec lost[3] = {{1.0f, 0.3f, 0.6f}, {0.4f, 0.6f, 1.0f}, {1.0f, 0.6f, 0.35f}};
    return vec_mad(vec(1, 1, 1), lost[spec->seed / 3 % 3], -spec->field.strength[FIELD_TINT]);
}

int fs_layout_build(Layout *layout, const Spec *spec, FsError *err)
{
    int rc, which = spec->picture ? 0 : (int)(spec->seed % LAYOUTS),
            room = (int)((spec->seed + spec->seed / LAYOUTS) % ROOMS);
    *layout = (Layout){.side = spec->seed / 2 % 2 ? -1.0f : 1.0f, .tint = tint_of(spec)};
    if (spec->field.strength[FIELD_DOUBLE_GLAZING] > 0) layout->gap = 0.014f;
    world_begin(&layout->behind, 2 * (uint64_t)spec->seed + 1, spec, 8.0f, 0.045f);
    world_begin(&layout->room, 2 * (uint64_t)spec->seed + 2, spec, 3.5f, 0.08f);
    layout->behind.texture_keep = spec->texture_keep;
    fs_behind_build(layout, spec, which);
    if (spec->frame) fs_behind_frame(layout);
    fs_room_build(layout, spec, which == LAYOUT_CASE ? ROOMS : room);
    darken(&layout->behind, spec->black, 3 * (uint64_t)spec->seed + 1);
    darken(&layout->room, spec->black, 3 * (uint64_t)spec->seed + 2);
    shade(&layout->behind, spec->shade);
    if (spec->lit) fs_lamps_build(layout);
    TRY(fs_world_finish(&layout->behind, err));
    TRY(fs_world_finish(&layout->room, err));
    return 0;
fail:
    fs_layout_free(layout);
    return rc;
}

void fs_layout_free(Layout *layout)
{
    fs_world_free(&layout->behind);
    fs_world_free(&layout->room);
    *layout = (Layout){0};
}
