// Where a ray meets an ellipsoid is where it meets the unit sphere in the ellipsoid's own coordinates.
#include "synth/figure.h"

typedef enum Part { SKIN, CLOTH, LEGS } Part;

static const struct {
    Vec centre, radius; // right, front, up; metres
    Part part;
} parts[] = {
    {{0, 0, 1.60f}, {0.08f, 0.10f, 0.12f}, SKIN},          {{0, 0, 1.16f}, {0.21f, 0.13f, 0.32f}, CLOTH},
    {{0, 0, 1.42f}, {0.20f, 0.09f, 0.08f}, CLOTH},         {{-0.10f, 0, 0.46f}, {0.09f, 0.10f, 0.50f}, LEGS},
    {{0.10f, 0, 0.46f}, {0.09f, 0.10f, 0.50f}, LEGS},      {{-0.26f, 0.04f, 1.14f}, {0.06f, 0.07f, 0.33f}, CLOTH},
    {{0.26f, 0.04f, 1.14f}, {0.06f, 0.07f, 0.33f}, CLOTH},
};

static Vec local(const Figure *f, Vec v)
{
    return vec(vec_dot(v, f->right), vec_dot(v, f->front), v.z);
}

static Vec divide(Vec a, Vec b)
{
    return vec(a.x / b.x, a.y / b.y, a.z / b.z);
}

static void hit_part(const Figure *f, int k, Vec o, Vec d, FigureHit *hit)
{
    Vec radius = vec_scale(parts[k].radius, f->size), centre = vec_scale(parts[k].centre, f->size);
    Vec from = divide(vec_sub(o, centre), radius), along = divide(d, radius);
    float a = vec_dot(along, along), b = vec_dot(from, along), c = vec_dot(from, from) - 1, root = b * b - a * c;
    if (root < 0) return;
    float t = (-b - sqrtf(root)) / a;
    if (t <= 0 || t >= hit->t) return;
    Vec n = vec_unit(divide(vec_mad(from, along, t), radius));
    Vec normal = vec_add(vec_scale(f->right, n.x), vec_scale(f->front, n.y));
    normal.z += n.z;
    *hit = (FigureHit){t, normal, parts[k].part == SKIN ? f->skin : parts[k].part == LEGS ? f->legs : f->cloth, f};
}

void fs_figure_hit(const Figure *figure, int n, Vec o, Vec d, FigureHit *hit)
{
    for (int i = 0; i < n; i++) {
        const Figure *f = &figure[i];
        Vec middle = vec_mad(f->feet, vec(0, 0, 1), 0.86f * f->size), to = vec_sub(middle, o);
        float along = vec_dot(to, d);
        if (vec_dot(to, to) - along * along > f->size * f->size) continue; // past all of it
        Vec from = local(f, vec_sub(o, f->feet)), ahead = local(f, d);
        for (int k = 0; k < (int)(sizeof parts / sizeof *parts); k++) hit_part(f, k, from, ahead, hit);
    }
}
