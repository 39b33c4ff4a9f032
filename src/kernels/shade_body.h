// The maths of shade.h over `real`, as in projection_body.h; r_pow(x, e) for x > 0.
FN void shade_lanes(const ShadeLight *light, const ShadeCloud *cloud, int i, int n, real alpha[3], real grow[3])
{
    const float *means = cloud->means, *gains = cloud->gains;
    real d2 = r_set(0), gain = gains ? r_column(gains + i, 1, n) : r_set(0);
    for (int k = 0; k < 3; k++) {
        real m = r_column(means + 3 * (size_t)i + k, 3, n) - r_set(light->centre[k]);
        d2 = d2 + m * m;
    }
    real near2 = r_set(1e-4f * light->flash_distance * light->flash_distance);
    real fall = r_set(light->flash_distance * light->flash_distance) / r_max(d2, near2) * r_exp(gain);
    if (light->even) fall = r_exp(gain);
    for (int k = 0; k < 3; k++) {
        alpha[k] = r_set(light->tint[k]) * fall;
        grow[k] = r_pow(r_set(1) + alpha[k], FS_OPTICS_GAMMA);
    }
}

static void forward(const ShadeLight *light, const ShadeCloud *cloud, int begin, int end, float *out)
{
    for (int i = begin; i < end; i += LANES) {
        int n = end - i < LANES ? end - i : LANES;
        real alpha[3], grow[3];
        shade_lanes(light, cloud, i, n, alpha, grow);
        for (int l = 0; l < n; l++)
            for (int k = 0; k < 3; k++) {
                size_t j = 3 * (size_t)(i + l) + (size_t)k;
                out[j] = cloud->colors[j] * get(&grow[k], l);
            }
    }
}

static void backward(const ShadeLight *light, const ShadeCloud *cloud, int begin, int end, const float *d_out,
                     const ShadeGradients *d, double d_tint[3])
{
    for (int i = begin; i < end; i += LANES) {
        int n = end - i < LANES ? end - i : LANES;
        real alpha[3], grow[3];
        shade_lanes(light, cloud, i, n, alpha, grow);
        real d_gain = r_set(0);
        for (int k = 0; k < 3; k++) {
            size_t j = 3 * (size_t)i + (size_t)k;
            real d_color = r_column(d_out + j, 3, n) * grow[k];
            real d_log_alpha =
                d_color * r_column(cloud->colors + j, 3, n) * r_set(FS_OPTICS_GAMMA) * alpha[k] / (r_set(1) + alpha[k]);
            d_gain = d_gain + d_log_alpha;
            d_tint[k] += (double)(r_sum(d_log_alpha) / light->tint[k]);
            for (int l = 0; l < n; l++) d->colors[j + 3 * (size_t)l] = get(&d_color, l);
        }
        for (int l = 0; l < n && d->gains; l++) d->gains[i + l] = get(&d_gain, l);
    }
}

static void enter(const ShadeLight *light, const ShadeCloud *cloud, const unsigned char *visible, int begin, int end,
                  const ShadeGradients *d)
{
    for (int i = begin; i < end; i += LANES) {
        int n = end - i < LANES ? end - i : LANES;
        real alpha[3], grow[3];
        shade_lanes(light, cloud, i, n, alpha, grow);
        real d_gain = r_set(0);
        for (int k = 0; k < 3; k++) {
            size_t j = 3 * (size_t)i + (size_t)k;
            real color = r_column(cloud->colors + j, 3, n), d_color = r_column(d->colors + j, 3, n);
            d_gain = d_gain - d_color * color * r_set(FS_OPTICS_GAMMA) * alpha[k] / (r_set(1) + alpha[k]);
            d_color = d_color / grow[k];
            color = color * grow[k];
            for (int l = 0; l < n; l++) {
                if (!visible[i + l]) continue;
                d->colors[j + 3 * (size_t)l] = get(&d_color, l);
                cloud->colors[j + 3 * (size_t)l] = get(&color, l);
            }
        }
        for (int l = 0; l < n; l++)
            if (visible[i + l]) d->gains[i + l] += get(&d_gain, l);
    }
}

static void leave(const ShadeLight *light, const ShadeCloud *cloud, const unsigned char *visible, int begin, int end)
{
    for (int i = begin; i < end; i += LANES) {
        int n = end - i < LANES ? end - i : LANES;
        real alpha[3], grow[3];
        shade_lanes(light, cloud, i, n, alpha, grow);
        for (int l = 0; l < n; l++)
            for (int k = 0; k < 3 && visible[i + l]; k++)
                cloud->colors[3 * (size_t)(i + l) + (size_t)k] /= get(&grow[k], l);
    }
}
