#include "engine/host_pixels.h"

#include "engine/scratch.h"

static Planes planes_at(const HostPixels *p, Arena *arena, const Planes *all, const int first[2])
{
    Planes some = fs_scratch_planes(arena, &p->camera, all->channels);
    for (int c = 0; c < some.channels && some.px; c++)
        for (int y = 0; y < some.height; y++) {
            const float *from = fs_planes_row(all, c, first[1] + y * p->stride[1]) + first[0];
            float *row = fs_planes_row(&some, c, y);
            for (int x = 0; x < some.stride; x++) row[x] = x < some.width ? from[x * p->stride[0]] : 0;
        }
    return some;
}

static int fewer(int pixels, int stride, Rng *rng, int *first)
{
    *first = fs_rng_below(rng, stride < pixels ? stride : pixels);
    return (pixels - 1 - *first) / stride + 1;
}

void fs_host_pixels_pick(HostPixels *p, Arena *arena, const HostView *v, const int stride[2], Rng *rng)
{
    *p = (HostPixels){.stride = {stride[0], stride[1]}, .camera = v->camera, .photo = v->photo, .trust = v->mask};
    if (stride[0] > 1 || stride[1] > 1) {
        int first[2];
        Camera *c = &p->camera;
        c->width = fewer(c->width, stride[0], rng, &first[0]);
        c->height = fewer(c->height, stride[1], rng, &first[1]);
        c->fx /= stride[0];
        c->fy /= stride[1];
        c->cx = (c->cx - first[0] - 0.5) / stride[0] + 0.5;
        c->cy = (c->cy - first[1] - 0.5) / stride[1] + 0.5;
        p->photo = planes_at(p, arena, &v->photo, first);
        p->trust = planes_at(p, arena, &v->mask, first);
    }
    p->mu = fs_scratch_planes(arena, &p->camera, 3);
    p->var = fs_scratch_planes(arena, &p->camera, 3);
}
