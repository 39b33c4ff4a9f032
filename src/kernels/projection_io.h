// Loads and stores around projection_body.h: Gaussians of interleaved arrays into lanes and back. The includer defines
// LANES, real, r_floor, r_column (every stride-th of n floats) and get(real*, lane).

FN void load_gaussians(const ProjectParams *params, int i, int n, Gaussian *g)
{
    const size_t j = (size_t)i;
    for (int k = 0; k < 3; k++) g->mean[k] = r_column(params->means + 3 * j + k, 3, n);
    for (int k = 0; k < 3; k++) g->scale[k] = r_column(params->scales + 3 * j + k, 3, n);
    for (int k = 0; k < 4; k++) g->quat[k] = r_column(params->quats + 4 * j + k, 4, n);
    g->opacity = r_column(params->opacities + j, 1, n);
}

FN void forward_lanes(const ProjectCamera *cam, const ProjectParams *params, int i, int n, float t_min, Splat *splats)
{
    Gaussian g;
    Projection o;
    load_gaussians(params, i, n, &g);
    project(cam, &g, &o);
    const real k2 = r_set(-0.5f * LOG2E);
    real x = r_set(cam->fx) * o.p[0] * o.inv_z + r_set(cam->cx), y = r_set(cam->fy) * o.p[1] * o.inv_z + r_set(cam->cy);
    real a = k2 * o.a, b = r_set(2) * k2 * o.b, c = k2 * o.c, l2 = log2_sigmoid(g.opacity);
    // t >= t_min is the ellipse d^T conic d <= reach; its half extents are sqrt(reach cov_xx), sqrt(reach cov_yy)
    real reach = r_max((l2 - r_set(t_min)) * r_set(2.0f / LOG2E), r_set(0));
    real rx = r_sqrt(reach * o.xx), ry = r_sqrt(reach * o.yy);
    // tiles with pixel centres inside [x - rx, x + rx]
    const real w = r_set(1.0f / FS_TILE_W), h = r_set(1.0f / FS_TILE_H), half = r_set(0.5f), zero = r_set(0);
    const real tiles_x = r_set((float)((cam->width + FS_TILE_W - 1) / FS_TILE_W));
    const real tiles_y = r_set((float)((cam->height + FS_TILE_H - 1) / FS_TILE_H));
    real x0 = r_max(r_floor((x - rx - half) * w), zero), x1 = r_min(r_floor((x + rx - half) * w) + r_set(1), tiles_x);
    real y0 = r_max(r_floor((y - ry - half) * h), zero), y1 = r_min(r_floor((y + ry - half) * h) + r_set(1), tiles_y);
    for (int l = 0; l < n; l++) {
        Splat *s = &splats[i + l];
        s->x = get(&x, l);
        s->y = get(&y, l);
        s->a = get(&a, l);
        s->b = get(&b, l);
        s->c = get(&c, l);
        s->l = get(&l2, l);
        s->depth = get(&o.p[2], l);
        bool visible = s->depth >= cam->near && get(&rx, l) > 0 && get(&x0, l) < get(&x1, l) &&
                       get(&y0, l) < get(&y1, l); // false for NaN too
        s->tile[0] = visible ? (uint16_t)get(&x0, l) : 0;
        s->tile[1] = visible ? (uint16_t)get(&y0, l) : 0;
        s->tile[2] = visible ? (uint16_t)get(&x1, l) : 0;
        s->tile[3] = visible ? (uint16_t)get(&y1, l) : 0;
    }
}

FN void backward_lanes(const ProjectCamera *cam, const ProjectParams *params, int i, int n, const ProjectBack *from,
                       const ProjectParams *d)
{
    const Splat *splats = from->splats;
    Gaussian g, out;
    real m[6], d_z;
    bool any = false;
    for (int l = 0; l < n; l++) any |= splats[i + l].tile[0] < splats[i + l].tile[2];
    if (!any) {
        memset(d->means + 3 * (size_t)i, 0, sizeof(float) * 3 * (size_t)n);
        memset(d->scales + 3 * (size_t)i, 0, sizeof(float) * 3 * (size_t)n);
        memset(d->quats + 4 * (size_t)i, 0, sizeof(float) * 4 * (size_t)n);
        memset(d->opacities + (size_t)i, 0, sizeof(float) * (size_t)n);
        return;
    }
    load_gaussians(params, i, n, &g);
    for (int k = 0; k < 6; k++) m[k] = r_column(from->moments + (size_t)i * FS_RECORD + k, FS_RECORD, n);
    d_z = r_column(from->d_depth + i, 1, n);
    project_back(cam, &g, m, d_z, &out);
    for (int l = 0; l < n; l++) {
        size_t j = (size_t)(i + l);
        float on = splats[j].tile[0] < splats[j].tile[2] ? 1.0f : 0.0f;
        for (int k = 0; k < 3; k++) d->means[3 * j + (size_t)k] = on ? get(&out.mean[k], l) : 0;
        for (int k = 0; k < 3; k++) d->scales[3 * j + (size_t)k] = on ? get(&out.scale[k], l) : 0;
        for (int k = 0; k < 4; k++) d->quats[4 * j + (size_t)k] = on ? get(&out.quat[k], l) : 0;
        d->opacities[j] = on ? get(&out.opacity, l) : 0;
    }
}

static void forward(const ProjectCamera *cam, const ProjectParams *params, int begin, int end, float t_min,
                    Splat *splats)
{
    for (int i = begin; i < end; i += LANES)
        forward_lanes(cam, params, i, end - i < LANES ? end - i : LANES, t_min, splats);
}

static void backward(const ProjectCamera *cam, const ProjectParams *params, int begin, int end, const ProjectBack *from,
                     const ProjectParams *gradients)
{
    for (int i = begin; i < end; i += LANES)
        backward_lanes(cam, params, i, end - i < LANES ? end - i : LANES, from, gradients);
}
