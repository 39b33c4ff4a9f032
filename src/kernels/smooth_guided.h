// The guided term of smooth.h in plain C, for the scalar definition and its twins.
#include <math.h>

static inline float guided_weight(const SmoothArgs *args, int x, int y, int xn, int yn)
{
    float differ = 0;
    for (int c = 0; c < args->guide->channels; c++)
        differ += fabsf(fs_planes_row(args->guide, c, y)[x] - fs_planes_row(args->guide, c, yn)[xn]);
    return expf(-differ / args->g);
}

// Every pixel's pairs, of which those that start at it count in the value.
static double guided(const SmoothArgs *args, int y0, int y1)
{
    static const int dx[4] = {1, 0, 1, -1}, dy[4] = {0, 1, 1, 1};
    const Planes *map = args->map;
    const SmoothScales scales = fs_smooth_scales(map->width, map->height);
    const float scale[4] = {scales.right, scales.down, scales.diagonal, scales.diagonal};
    double sum = 0;
    for (int y = y0; y < y1; y++)
        for (int x = 0; x < map->width; x++)
            for (int k = 0; k < 8; k++) {
                int side = k < 4 ? 1 : -1, xn = x + side * dx[k & 3], yn = y + side * dy[k & 3];
                if (xn < 0 || xn >= map->width || yn < 0 || yn >= map->height) continue;
                float d = fs_planes_row(map, 0, y)[x] - fs_planes_row(map, 0, yn)[xn];
                float w = scale[k & 3] * guided_weight(args, x, y, xn, yn);
                if (k < 4) sum += (double)(w * fabsf(d));
                if (args->d_map)
                    fs_planes_row(args->d_map, 0, y)[x] += d > 0 ? args->weight * w : d < 0 ? -args->weight * w : 0;
            }
    return sum;
}
