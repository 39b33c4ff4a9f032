// From the seed to a whole scene.
#include "synth/layout.h"

static void world_begin(World *world, uint64_t seed, const Spec *spec, float px_per_cm, float light_step)
{
    *world = (World){.rng = fs_rng_new(seed), .texture_keep = 1.0f, .light_step = light_step};
    float detail = (float)(spec->width > spec->height ? spec->width : spec->height) / 600.0f;
    world->px_per_cm = fminf(fmaxf(px_per_cm * detail, 1.0f), 20.0f);
}

int fs_layout_build(Layout *layout, const Spec *spec, FsError *err)
{
    int rc, which = (int)(spec->seed % LAYOUTS), room = (int)((spec->seed + spec->seed / LAYOUTS) % ROOMS);
    *layout = (Layout){.side = spec->seed / 2 % 2 ? -1.0f : 1.0f};
    world_begin(&layout->behind, 2 * (uint64_t)spec->seed + 1, spec, 8.0f, 0.045f);
    world_begin(&layout->room, 2 * (uint64_t)spec->seed + 2, spec, 3.5f, 0.08f);
    layout->behind.texture_keep = spec->texture_keep;
    fs_behind_build(layout, spec, which);
    if (spec->frame) fs_behind_frame(layout);
    fs_room_build(layout, spec, which == LAYOUT_CASE ? ROOMS : room);
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
