// Loads and stores around project_body.h: Gaussians of interleaved arrays into lanes and back. The includer defines
// LANES, real and put(real*, lane, float), get(real*, lane).

FN void load_gaussians(const ProjectParams *params, int i, int n, Gaussian *g)
{
    for (int l = 0; l < LANES; l++) {
        size_t j = (size_t)(i + (l < n ? l : 0));
        for (int k = 0; k < 3; k++) put(&g->mean[k], l, params->means[3 * j + (size_t)k]);
        for (int k = 0; k < 3; k++) put(&g->scale[k], l, params->scales[3 * j + (size_t)k]);
        for (int k = 0; k < 4; k++) put(&g->quat[k], l, params->quats[4 * j + (size_t)k]);
        put(&g->opacity, l, params->opacities[j]);
    }
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
    const float tiles_x = (float)((cam->width + FS_TILE_W - 1) / FS_TILE_W);
    const float tiles_y = (float)((cam->height + FS_TILE_H - 1) / FS_TILE_H);
    for (int l = 0; l < n; l++) {
        Splat *s = &splats[i + l];
        s->x = get(&x, l);
        s->y = get(&y, l);
        s->a = get(&a, l);
        s->b = get(&b, l);
        s->c = get(&c, l);
        s->l = get(&l2, l);
        s->depth = get(&o.p[2], l);
        float hx = get(&rx, l), hy = get(&ry, l);
        // pixel centres inside [x - hx, x + hx]
        float x0 = floorf((s->x - hx - 0.5f) / FS_TILE_W), x1 = floorf((s->x + hx - 0.5f) / FS_TILE_W) + 1;
        float y0 = floorf((s->y - hy - 0.5f) / FS_TILE_H), y1 = floorf((s->y + hy - 0.5f) / FS_TILE_H) + 1;
        x0 = x0 > 0 ? x0 : 0;
        y0 = y0 > 0 ? y0 : 0;
        x1 = x1 < tiles_x ? x1 : tiles_x;
        y1 = y1 < tiles_y ? y1 : tiles_y;
        bool visible = s->depth >= cam->near && hx > 0 && x0 < x1 && y0 < y1; // false for NaN too
        s->tile[0] = visible ? (uint16_t)x0 : 0;
        s->tile[1] = visible ? (uint16_t)y0 : 0;
        s->tile[2] = visible ? (uint16_t)x1 : 0;
        s->tile[3] = visible ? (uint16_t)y1 : 0;
    }
}

FN void backward_lanes(const ProjectCamera *cam, const ProjectParams *params, int i, int n, const ProjectBack *from,
                       const ProjectParams *d)
{
    const Splat *splats = from->splats;
    Gaussian g, out;
    real m[6], d_z;
    bool any = false;
    for (int l = 0; l < LANES; l++) {
        size_t j = (size_t)(i + (l < n ? l : 0));
        bool visible = splats[j].tile[0] < splats[j].tile[2];
        any |= visible;
        for (int k = 0; k < 6; k++) put(&m[k], l, visible ? from->moments[j * FS_RECORD + (size_t)k] : 0);
        put(&d_z, l, visible ? from->d_depth[j] : 0);
    }
    if (!any) {
        memset(d->means + 3 * (size_t)i, 0, sizeof(float) * 3 * (size_t)n);
        memset(d->scales + 3 * (size_t)i, 0, sizeof(float) * 3 * (size_t)n);
        memset(d->quats + 4 * (size_t)i, 0, sizeof(float) * 4 * (size_t)n);
        memset(d->opacities + (size_t)i, 0, sizeof(float) * (size_t)n);
        return;
    }
    load_gaussians(params, i, n, &g);
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
