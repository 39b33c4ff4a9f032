#include "kernels/smooth.h"

#include <math.h>

// f(t) = t exp(-t / g) of a signed difference; *slope = f'(|d|) sign(d).
static float pair(float d, float g, float *slope)
{
    float t = fabsf(d), w = expf(-t / g), s = w * (1 - t / g);
    *slope = d > 0 ? s : d < 0 ? -s : 0;
    return t * w;
}

// Value of the pairs that start at a pixel, gradient of all pairs it is in.
static double pixel(const SmoothArgs *args, SmoothScales scales, int x, int y, float *grad)
{
    static const int dx[4] = {1, 0, 1, -1}, dy[4] = {0, 1, 1, 1};
    const float scale[4] = {scales.right, scales.down, scales.diagonal, scales.diagonal};
    int w = args->map->width, h = args->map->height;
    float u = fs_planes_row(args->map, 0, y)[x], slope;
    double sum = 0;
    *grad = 0;
    for (int k = 0; k < 4; k++) {
        int xn = x + dx[k], yn = y + dy[k];
        if (xn >= 0 && xn < w && yn < h) {
            sum += scale[k] * pair(u - fs_planes_row(args->map, 0, yn)[xn], args->g, &slope);
            *grad += scale[k] * slope;
        }
        xn = x - dx[k], yn = y - dy[k];
        if (xn >= 0 && xn < w && yn >= 0) {
            pair(u - fs_planes_row(args->map, 0, yn)[xn], args->g, &slope);
            *grad += scale[k] * slope;
        }
    }
    return sum;
}

static double loss(const SmoothArgs *args, int y0, int y1)
{
    SmoothScales scales = fs_smooth_scales(args->map->width, args->map->height);
    double sum = 0;
    for (int y = y0; y < y1; y++)
        for (int x = 0; x < args->map->width; x++) {
            float grad;
            sum += pixel(args, scales, x, y, &grad);
            if (args->d_map) fs_planes_row(args->d_map, 0, y)[x] += args->weight * grad;
        }
    return sum;
}

#include "kernels/smooth_guided.h"

const SmoothKernels fs_smooth_scalar = {loss, guided};
