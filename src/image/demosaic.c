// Demosaicing by directional linear minimum mean square error estimation (after Zhang and Wu 2005).
//
// Along a row, and along a column, green minus the other colour d is smooth. Interpolating gives a noisy d at every
// pixel: d = x + noise. With l = d low-passed, over 9 samples of the line, mean m and variance p of l stand for x's,
// and r = mean (d - l)^2 for the noise's, so that the best linear estimate and its error's variance are
//
//     x = m + p / (p + r) (d - m),    e = p r / (p + r)
//
// Row's and column's estimates are averaged with weights 1/e: across an edge e is large. Green = colour + x; red and
// blue follow by averaging green minus colour over the neighbours that have it.
#include "image/demosaic.h"

#include <stdlib.h>
#include <string.h>

#define PAD 12  // rows and columns around a band that its results depend on; even, so that the pattern goes on
#define BAND 64 // rows at a time; even

// Planes of a band with its padding, (rows, stride) each.
typedef struct Band {
    int rows, stride;
    unsigned char cfa[4];
    float *mosaic, *row_d, *row_l, *column_d, *column_l; // d and l along rows and columns
    float *green, *red_d, *blue_d;                       // green; green minus red where red is, likewise blue
    float *rgb;                                          // a row of the picture
} Band;

static int color_at(const Band *b, int x, int y) // PAD is even, so the band's pattern is the image's
{
    return b->cfa[(y & 1) * 2 + (x & 1)];
}

static int mirrored(int i, int n)
{
    if (i < 0) i = -i;
    if (i > n - 1) i = 2 * (n - 1) - i;
    return i < 0 ? 0 : i;
}

static void fill(Band *b, const DemosaicRows *rows, int width, int height, int first_row)
{
    for (int y = 0; y < b->rows; y++) {
        float *out = b->mosaic + (size_t)y * (size_t)b->stride, *in = out + PAD;
        rows->get(rows->user, mirrored(first_row - PAD + y, height), in);
        for (int x = 0; x < PAD; x++) {
            out[x] = in[mirrored(x - PAD, width)];
            in[width + x] = in[mirrored(width + x, width)];
        }
    }
}

// d along a line of step `step`, for the pixels 2 away from the border on: green minus the line's other colour.
static void differences(const Band *b, int step, float *d)
{
    for (int y = 2; y < b->rows - 2; y++)
        for (int x = 2; x < b->stride - 2; x++) {
            const float *m = b->mosaic + (size_t)y * (size_t)b->stride + x;
            float other = 0.5f * (m[-step] + m[step]) + 0.25f * (2 * m[0] - m[-2 * step] - m[2 * step]);
            d[(size_t)y * (size_t)b->stride + x] = color_at(b, x, y) == 1 ? m[0] - other : other - m[0];
        }
}

static void low_pass(const Band *b, int step, const float *d, float *l)
{
    int border = 6, border_x = step == 1 ? border : 2, border_y = step == 1 ? 2 : border;
    for (int y = border_y; y < b->rows - border_y; y++)
        for (int x = border_x; x < b->stride - border_x; x++) {
            const float *p = d + (size_t)y * (size_t)b->stride + x;
            l[(size_t)y * (size_t)b->stride + x] =
                (26 * p[0] + 23 * (p[-step] + p[step]) + 15 * (p[-2 * step] + p[2 * step]) +
                 9 * (p[-3 * step] + p[3 * step]) + 4 * (p[-4 * step] + p[4 * step])) /
                128.0f;
        }
}

static void estimate(const float *d, const float *l, int step, float *x, float *error)
{
    float mean = 0, p = 0, r = 0;
    for (int k = -4; k <= 4; k++) mean += l[k * step];
    mean *= 1 / 9.0f;
    for (int k = -4; k <= 4; k++) {
        float a = l[k * step] - mean, n = d[k * step] - l[k * step];
        p += a * a, r += n * n;
    }
    p = p / 9 + 1e-12f, r = r / 9 + 1e-12f;
    *x = mean + p / (p + r) * (d[0] - mean);
    *error = p * r / (p + r);
}

static void find_green(Band *b)
{
    differences(b, 1, b->row_d);
    differences(b, b->stride, b->column_d);
    low_pass(b, 1, b->row_d, b->row_l);
    low_pass(b, b->stride, b->column_d, b->column_l);
    for (int y = PAD - 2; y < b->rows - PAD + 2; y++)
        for (int x = PAD - 2; x < b->stride - PAD + 2; x++) {
            size_t i = (size_t)y * (size_t)b->stride + (size_t)x;
            int color = color_at(b, x, y);
            b->green[i] = b->mosaic[i];
            if (color == 1) continue;
            float row, column, row_error, column_error;
            estimate(b->row_d + i, b->row_l + i, 1, &row, &row_error);
            estimate(b->column_d + i, b->column_l + i, b->stride, &column, &column_error);
            float d = (column_error * row + row_error * column) / (row_error + column_error);
            b->green[i] += d;
            (color == 0 ? b->red_d : b->blue_d)[i] = d;
        }
}

// Green minus `color` at any pixel out of the plane that has it at that colour's pixels.
static float difference_at(const Band *b, const float *plane, int color, int x, int y)
{
    const float *p = plane + (size_t)y * (size_t)b->stride + x;
    int s = b->stride, here = color_at(b, x, y);
    if (here == color) return p[0];
    if (here != 1) return 0.25f * (p[-s - 1] + p[-s + 1] + p[s - 1] + p[s + 1]);
    return color_at(b, x + 1, y) == color ? 0.5f * (p[-1] + p[1]) : 0.5f * (p[-s] + p[s]);
}

static int new_band(Band *b, int width, const unsigned char cfa[4], FsError *err)
{
    *b = (Band){.rows = BAND + 2 * PAD, .stride = width + 2 * PAD};
    memcpy(b->cfa, cfa, 4);
    size_t plane = (size_t)b->rows * (size_t)b->stride;
    float **planes[] = {&b->mosaic, &b->row_d, &b->row_l, &b->column_d, &b->column_l, &b->green, &b->red_d, &b->blue_d};
    b->mosaic = calloc(plane * (sizeof planes / sizeof *planes) + 3 * (size_t)width, sizeof(float));
    if (!b->mosaic) return fs_error_memory(err);
    for (size_t i = 1; i < sizeof planes / sizeof *planes; i++) *planes[i] = b->mosaic + i * plane;
    b->rgb = b->mosaic + sizeof planes / sizeof *planes * plane;
    return 0;
}

bool fs_demosaic_is_bayer(const unsigned char cfa[4])
{
    return (cfa[0] == 1 && cfa[3] == 1 && cfa[1] + cfa[2] == 2 && cfa[1] != 1) ||
           (cfa[1] == 1 && cfa[2] == 1 && cfa[0] + cfa[3] == 2 && cfa[0] != 1);
}

int fs_demosaic(const DemosaicRows *rows, int width, int height, const unsigned char cfa[4], FsError *err)
{
    if (!fs_demosaic_is_bayer(cfa) || width < FS_DEMOSAIC_MIN_SIDE || height < FS_DEMOSAIC_MIN_SIDE)
        return fs_error_input(err, "a Bayer mosaic of %d x %d: expected sides of at least %d", width, height,
                              FS_DEMOSAIC_MIN_SIDE);
    Band b;
    MUST(new_band(&b, width, cfa, err));
    for (int first = 0; first < height; first += BAND) {
        int n = height - first < BAND ? height - first : BAND;
        b.rows = n + 2 * PAD;
        fill(&b, rows, width, height, first);
        find_green(&b);
        for (int y = PAD; y < PAD + n; y++) {
            for (int x = 0; x < width; x++) {
                float green = b.green[(size_t)y * (size_t)b.stride + (size_t)(x + PAD)];
                b.rgb[3 * x] = green - difference_at(&b, b.red_d, 0, x + PAD, y);
                b.rgb[3 * x + 1] = green;
                b.rgb[3 * x + 2] = green - difference_at(&b, b.blue_d, 2, x + PAD, y);
            }
            rows->put(rows->user, first + y - PAD, b.rgb);
        }
    }
    free(b.mosaic);
    return 0;
}
