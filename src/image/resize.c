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

int fs_resize_begin(Resize *r, int from_width, int from_height, Image *to, FsError *err)
{
    size_t row = (size_t)from_width * (size_t)to->channels;
    *r = (Resize){.to = to, .from_width = from_width, .from_height = from_height, .sum = calloc(row, sizeof *r->sum)};
    return r->sum ? 0 : fs_error_memory(err);
}

static void put_row(const Resize *r)
{
    size_t c = (size_t)r->to->channels;
    float *out = r->to->px + (size_t)r->done * (size_t)r->to->width * c;
    for (int x = 0; x < r->to->width; x++) {
        Span sx = span_of(x, r->to->width, r->from_width);
        double value[4] = {0};
        for (int k = 0; k < sx.n; k++) {
            double w = weight_at(&sx, k);
            const double *in = r->sum + (size_t)(sx.first + k) * c;
            for (size_t i = 0; i < c; i++) value[i] += w * in[i];
        }
        for (size_t i = 0; i < c; i++) out[(size_t)x * c + i] = (float)value[i];
    }
}

void fs_resize_row(Resize *r, const float *row)
{
    size_t n = (size_t)r->from_width * (size_t)r->to->channels;
    int y = r->y++;
    for (; r->done < r->to->height; r->done++) {
        Span sy = span_of(r->done, r->to->height, r->from_height);
        if (sy.first > y) return;
        double w = weight_at(&sy, y - sy.first);
        for (size_t i = 0; row && i < n; i++) r->sum[i] += w * row[i];
        r->touched |= row != NULL;
        if (sy.first + sy.n - 1 > y) return;
        if (!r->touched) continue;
        put_row(r);
        memset(r->sum, 0, n * sizeof *r->sum);
        r->touched = false;
    }
}

void fs_resize_end(Resize *r)
{
    free(r->sum);
    *r = (Resize){0};
}

int fs_image_resize_area(const Image *from, int width, int height, Image *to, FsError *err)
{
    if (width == from->width && height == from->height) return fs_image_copy(to, from, err);
    Resize r = {0};
    int rc;
    TRY(fs_image_new(to, width, height, from->channels, err));
    TRY(fs_resize_begin(&r, from->width, from->height, to, err));
    for (int y = 0; y < from->height; y++)
        fs_resize_row(&r, from->px + (size_t)y * (size_t)from->width * (size_t)from->channels);
    fs_resize_end(&r);
    return 0;
fail:
    fs_image_free(to);
    return rc;
}

void fs_image_limit(int long_edge, int *width, int *height)
{
    int side = *width > *height ? *width : *height;
    if (long_edge <= 0 || side <= long_edge) return;
    double s = (double)long_edge / side;
    int w = (int)lround(*width * s), h = (int)lround(*height * s);
    *width = w < 1 ? 1 : w;
    *height = h < 1 ? 1 : h;
}
