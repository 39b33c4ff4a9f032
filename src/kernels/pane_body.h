// The maths of pane.h in the words of real_scalar.h and real_simd.h: one pixel per lane.
FN real cosine(const PaneView *v, int x, int y, real ray[3])
{
    real length2 = r_set(0), dot = r_set(0), px = r_set((float)x) + r_lanes();
    for (int k = 0; k < 3; k++) {
        ray[k] = px * r_set(v->dx[k]) + r_set(v->base[k] + (float)y * v->dy[k]);
        length2 = length2 + ray[k] * ray[k];
    }
    real inv = r_set(1) / r_sqrt(length2);
    for (int k = 0; k < 3; k++) {
        ray[k] = ray[k] * inv;
        dot = dot + ray[k] * r_set(v->normal[k]);
    }
    return dot;
}

static void forward(const PaneView *v, const Planes *beta, const Planes *tau, int y0, int y1)
{
    const real one = r_set(1), most = r_set(v->most / v->dimming);
    for (int y = y0; y < y1; y++)
        for (int x = 0; x < beta->stride; x += LANES) {
            real ray[3], u = one - r_abs(cosine(v, x, y, ray)),
                         rho = r_min(one + r_set(FS_OPTICS_GRAZING) * (u * u) * (u * u) * u, most);
            r_store(fs_planes_row(beta, 0, y) + x, r_set(v->f0) * rho * r_set(v->R));
            r_store(fs_planes_row(tau, 0, y) + x, (one - r_set(v->dimming) * rho) * r_set(v->T / (1 - v->dimming)));
        }
}

static PaneGradient backward(const PaneView *v, const Planes *d_beta, const Planes *d_tau, int y0, int y1)
{
    PaneGradient gradient = {0};
    const real one = r_set(1), most = r_set(v->most / v->dimming), width = r_set((float)d_beta->width);
    const float rest = 1 / (1 - v->dimming),
                most_by_dimming = v->dimming > 0 ? -v->most / (v->dimming * v->dimming) : 0;
    for (int y = y0; y < y1; y++) {
        real part[6] = {r_set(0), r_set(0), r_set(0), r_set(0), r_set(0), r_set(0)};
        for (int x = 0; x < d_beta->width; x += LANES) {
            real px = r_set((float)x) + r_lanes();
            real d_b = r_below(px, width, r_load(fs_planes_row(d_beta, 0, y) + x));
            real d_t = r_below(px, width, r_load(fs_planes_row(d_tau, 0, y) + x));
            real ray[3], c = cosine(v, x, y, ray), u = one - r_abs(c), u4 = (u * u) * (u * u);
            real free_rho = one + r_set(FS_OPTICS_GRAZING) * u4 * u, rho = r_min(free_rho, most);
            d_b = d_b * r_set(v->R);
            d_t = d_t * r_set(v->T * rest);
            part[4] = part[4] + d_t * (one - r_set(v->dimming) * rho);
            part[5] = part[5] + d_b * r_set(v->f0) * rho;
            part[3] = part[3] + d_t * ((one - r_set(v->dimming) * rho) * r_set(rest) - rho);
            real d_rho = d_b * r_set(v->f0) - d_t * r_set(v->dimming), d_free = r_below(free_rho, most, d_rho);
            part[3] = part[3] + (d_rho - d_free) * r_set(most_by_dimming);
            real d_c = d_free * r_set(5 * FS_OPTICS_GRAZING) * u4;
            d_c = r_below(c, r_set(0), d_c + d_c) - d_c; // |c| grows with -c where c < 0
            for (int k = 0; k < 3; k++) part[k] = part[k] + d_c * (ray[k] - c * r_set(v->normal[k]));
        }
        for (int k = 0; k < 3; k++) gradient.normal[k] += (double)r_sum(part[k]);
        gradient.dimming += (double)r_sum(part[3]);
        gradient.T += (double)r_sum(part[4]);
        gradient.R += (double)r_sum(part[5]);
    }
    return gradient;
}
