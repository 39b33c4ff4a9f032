// occlusion.h in plain C: the scalar definition, and its twins by what the compiler makes of it for their instruction
// sets.
#include <math.h>
#include <string.h>

typedef struct Place {
    int at, next;
    float share; // of next
} Place;

static inline Place place(int i, int n, int cells)
{
    float g = ((float)i + 0.5f) * (float)cells / (float)n - 0.5f;
    g = g < 0 ? 0 : g > (float)(cells - 1) ? (float)(cells - 1) : g;
    int at = (int)g;
    return (Place){at, at + 1 < cells ? at + 1 : at, g - (float)at};
}

// The grid between its rows, at an image's row.
static void grid_row(const float *q, Place y, float *row)
{
    const float *a = q + y.at * OCCLUSION_WIDTH, *b = q + y.next * OCCLUSION_WIDTH;
    for (int i = 0; i < OCCLUSION_WIDTH; i++) row[i] = a[i] + y.share * (b[i] - a[i]);
}

static inline float between(const float *row, Place x)
{
    return row[x.at] + x.share * (row[x.next] - row[x.at]);
}

static void forward(const float *q, const Planes *beta, const Planes *hidden, int y0, int y1)
{
    float row[OCCLUSION_WIDTH];
    for (int y = y0; y < y1; y++) {
        const float *from = fs_planes_row(beta, 0, y);
        float *to = fs_planes_row(hidden, 0, y);
        grid_row(q, place(y, beta->height, OCCLUSION_HEIGHT), row);
        for (int x = 0; x < beta->stride; x++) // the padding stays finite
            to[x] = from[x] * (1 - between(row, place(x, beta->width, OCCLUSION_WIDTH)));
    }
}

static void backward(const float *q, const Planes *beta, const Planes *d_hidden, const Planes *d_beta, int y0, int y1,
                     float *d_q)
{
    float row[OCCLUSION_WIDTH], d_row[OCCLUSION_WIDTH];
    for (int y = y0; y < y1; y++) {
        const float *b = fs_planes_row(beta, 0, y), *from = fs_planes_row(d_hidden, 0, y);
        float *to = fs_planes_row(d_beta, 0, y);
        Place py = place(y, beta->height, OCCLUSION_HEIGHT);
        grid_row(q, py, row);
        memset(d_row, 0, sizeof d_row);
        for (int x = 0; x < beta->width; x++) {
            Place px = place(x, beta->width, OCCLUSION_WIDTH);
            float d = -from[x] * b[x];
            d_row[px.at] += d * (1 - px.share);
            d_row[px.next] += d * px.share;
            to[x] = from[x] * (1 - between(row, px));
        }
        float *d_at = d_q + py.at * OCCLUSION_WIDTH, *d_next = d_q + py.next * OCCLUSION_WIDTH;
        for (int i = 0; i < OCCLUSION_WIDTH; i++) {
            d_at[i] += d_row[i] * (1 - py.share);
            d_next[i] += d_row[i] * py.share;
        }
    }
}

static void open_cells(const float *q, const Planes *R, OcclusionSums *sums, int y0, int y1)
{
    float row[OCCLUSION_WIDTH];
    for (int y = y0; y < y1; y++) {
        const float *const rgb[3] = {fs_planes_row(R, 0, y), fs_planes_row(R, 1, y), fs_planes_row(R, 2, y)};
        int first = y * OCCLUSION_HEIGHT / R->height * OCCLUSION_WIDTH;
        grid_row(q, place(y, R->height, OCCLUSION_HEIGHT), row);
        for (int x = 0; x < R->width; x++) {
            int at = first + x * OCCLUSION_WIDTH / R->width;
            sums->all[at]++;
            if (between(row, place(x, R->width, OCCLUSION_WIDTH)) >= OCCLUSION_OPEN) continue;
            for (int c = 0; c < 3; c++) sums->rgb[3 * at + c] += rgb[c][x];
            sums->n[at]++;
        }
    }
}

static void differ(const Planes *photo, const Planes *render, const Planes *weight, OcclusionSums *sums, int y0, int y1)
{
    for (int y = y0; y < y1; y++) {
        const float *w = fs_planes_row(weight, 0, y);
        int first = y * OCCLUSION_HEIGHT / photo->height * OCCLUSION_WIDTH;
        for (int c = 0; c < 3; c++) {
            const float *a = fs_planes_row(photo, c, y), *b = fs_planes_row(render, c, y);
            for (int x = 0; x < photo->width; x++)
                sums->rgb[3 * (first + x * OCCLUSION_WIDTH / photo->width) + c] += w[x] * (a[x] - b[x]);
        }
        for (int x = 0; x < photo->width; x++) {
            sums->n[first + x * OCCLUSION_WIDTH / photo->width] += w[x];
            sums->all[first + x * OCCLUSION_WIDTH / photo->width]++;
        }
    }
}

static double apart(const OcclusionAroundArgs *args, int y0, int y1)
{
    const Planes *R = args->R;
    float row[OCCLUSION_WIDTH], rgb[3][OCCLUSION_WIDTH], each = args->weight / (3 * (float)R->width * (float)R->height);
    double sum = 0;
    for (int y = y0; y < y1; y++) {
        Place py = place(y, R->height, OCCLUSION_HEIGHT);
        const float *a = args->around + 3 * py.at * OCCLUSION_WIDTH, *b = args->around + 3 * py.next * OCCLUSION_WIDTH;
        grid_row(args->q, py, row);
        for (int i = 0; i < OCCLUSION_WIDTH; i++)
            for (int c = 0; c < 3; c++) rgb[c][i] = a[3 * i + c] + py.share * (b[3 * i + c] - a[3 * i + c]);
        for (int x = 0; x < R->width; x++) {
            Place px = place(x, R->width, OCCLUSION_WIDTH);
            if (between(row, px) < OCCLUSION_HIDES) continue;
            for (int c = 0; c < 3; c++) {
                float e = fs_planes_row(R, c, y)[x] - between(rgb[c], px);
                fs_planes_row(args->d_R, c, y)[x] += e > 0 ? each : e < 0 ? -each : 0;
                sum += (double)fabsf(e);
            }
        }
    }
    return sum / (3.0 * R->width * R->height);
}
