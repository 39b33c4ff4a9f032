// The maths of shade.h over `real`, as in project_body.h; r_pow(x, e) for x > 0.
FN void shade_lanes(const ShadeLight *light, const ShadeCloud *cloud, int i, int n, real alpha[3], real grow[3])
{
    const float *means = cloud->means, *gains = cloud->gains;
    real d2 = r_set(0), gain;
    for (int k = 0; k < 3; k++) {
        real m;
        for (int l = 0; l < LANES; l++) put(&m, l, means[3 * (size_t)(i + (l < n ? l : 0)) + (size_t)k]);
        m = m - r_set(light->centre[k]);
        d2 = d2 + m * m;
    }
    for (int l = 0; l < LANES; l++) put(&gain, l, gains ? gains[i + (l < n ? l : 0)] : 0);
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
        for (int l = 0; l < n; l++) {
            if (d->gains) d->gains[i + l] = 0;
            for (int k = 0; k < 3; k++) {
                size_t j = 3 * (size_t)(i + l) + (size_t)k;
                float a = get(&alpha[k], l), g = get(&grow[k], l);
                float d_log_alpha = d_out[j] * cloud->colors[j] * FS_OPTICS_GAMMA * g * a / (1 + a);
                d->colors[j] = d_out[j] * g;
                if (d->gains) d->gains[i + l] += d_log_alpha;
                d_tint[k] += (double)(d_log_alpha / light->tint[k]);
            }
        }
    }
}

static void enter(const ShadeLight *light, const ShadeCloud *cloud, const unsigned char *visible, int begin, int end,
                  const ShadeGradients *d)
{
    for (int i = begin; i < end; i += LANES) {
        int n = end - i < LANES ? end - i : LANES;
        real alpha[3], grow[3];
        shade_lanes(light, cloud, i, n, alpha, grow);
        for (int l = 0; l < n; l++)
            for (int k = 0; k < 3 && visible[i + l]; k++) {
                size_t j = 3 * (size_t)(i + l) + (size_t)k;
                float a = get(&alpha[k], l), g = get(&grow[k], l);
                d->gains[i + l] -= d->colors[j] * cloud->colors[j] * FS_OPTICS_GAMMA * a / (1 + a);
                d->colors[j] /= g;
                cloud->colors[j] *= g;
            }
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
