// Area average: every output pixel is the mean of the input it covers, fractions of pixels included.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/image.h"

// The input samples under one output sample: first .. first + n - 1, the outer two weighted by their coverage.
typedef struct Span {
    int first, n;
    double weight_first, weight_last; // the inner ones have `weight`
    double weight;
} Span;

static Span span_of(int i, int to, int from)
{
    double scale = (double)from / to, a = i * scale, b = (i + 1) * scale;
    int first = (int)floor(a), last = (int)ceil(b) - 1;
    if (first > from - 1) first = from - 1;
    if (last > from - 1) last = from - 1;
    if (last < first) last = first;
    // Rounding may leave a sliver of a next pixel; its weight is then as small as the rounding.
    Span s = {.first = first, .n = last - first + 1, .weight = 1.0 / scale};
    if (s.n == 1) {
        s.weight_first = s.weight_last = 1.0;
    } else {
        s.weight_first = (first + 1 - a) / scale;
        s.weight_last = 1.0 - s.weight_first - (s.n - 2) * s.weight;
    }
    return s;
}

static double weight_at(const Span *s, int k)
{
    return k == 0 ? s->weight_first : k == s->n - 1 ? s->weight_last : s->weight;
}

int fs_image_resize_area(const Image *from, int width, int height, Image *to, FsError *err)
{
    if (width == from->width && height == from->height) return fs_image_copy(to, from, err);
    MUST(fs_image_new(to, width, height, from->channels, err));
    size_t c = (size_t)from->channels, row = (size_t)from->width * c;
    double *sum = malloc(row * sizeof *sum); // one row of input pixels, averaged over the rows of a span
    if (!sum) {
        fs_image_free(to);
        return fs_error_memory(err);
    }
    for (int y = 0; y < height; y++) {
        Span sy = span_of(y, height, from->height);
        memset(sum, 0, row * sizeof *sum);
        for (int k = 0; k < sy.n; k++) {
            double w = weight_at(&sy, k);
            const float *in = from->px + (size_t)(sy.first + k) * row;
            for (size_t i = 0; i < row; i++) sum[i] += w * in[i];
        }
        float *out = to->px + (size_t)y * (size_t)width * c;
        for (int x = 0; x < width; x++) {
            Span sx = span_of(x, width, from->width);
            double value[4] = {0};
            for (int k = 0; k < sx.n; k++) {
                double w = weight_at(&sx, k);
                const double *in = sum + (size_t)(sx.first + k) * c;
                for (size_t i = 0; i < c; i++) value[i] += w * in[i];
            }
            for (size_t i = 0; i < c; i++) out[(size_t)x * c + i] = (float)value[i];
        }
    }
    free(sum);
    return 0;
}
