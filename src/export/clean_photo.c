#include "export/clean_photo.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/bicubic.h"
#include "image/bilinear.h"
#include "image/blur.h"
#include "image/tone.h"

// Chosen on synth's seed 31 (docs/measurements.md).
#define LEVEL_SIGMA 2.0f  // pixels of the working image
#define DETAIL_SIGMA 1.0f // what is finer than this is detail
#define AROUND_SIGMA 1.0f // over which its power is averaged
#define AGAINST_R 3.0f    // k
#define DARK 1e-5f        // of white: no ratio is taken of less
#define NO_DETAIL 1e-10f
#define FARTHEST 10.0f    // that a level may be from 1
#define NEARLY_FULL 0.85f // beside what is clipped, demosaicing mixes
#define STRIP 64          // rows of a job

void fs_clean_photo_free(CleanGuide *g)
{
    fs_image_free(&g->T);
    fs_image_free(&g->whole);
    fs_image_free(&g->level);
    fs_image_free(&g->gate);
}

// ---- at working size ----

static int blurred(Image *image, float sigma, FsError *err)
{
    Image out = {0};
    float *scratch = malloc(fs_image_values(image) * sizeof *scratch);
    int rc = scratch ? fs_image_new(&out, image->width, image->height, image->channels, err) : fs_error_memory(err);
    if (rc == 0) {
        fs_blur_image(image, scratch, out.px, sigma);
        fs_image_free(image);
        *image = out;
    }
    free(scratch);
    return rc;
}

// Mean over the channels of the squared difference to the Gaussian, around each pixel.
static int detail_power(const Image *image, Image *power, FsError *err)
{
    Image coarse = {0};
    int rc;
    TRY(fs_image_copy(&coarse, image, err));
    TRY(blurred(&coarse, DETAIL_SIGMA, err));
    TRY(fs_image_new(power, image->width, image->height, 1, err));
    for (size_t i = 0; i < fs_image_pixels(power); i++)
        for (size_t c = 0; c < 3; c++) {
            float d = image->px[3 * i + c] - coarse.px[3 * i + c];
            power->px[i] += d * d / 3;
        }
    TRY(blurred(power, AROUND_SIGMA, err));
fail:
    fs_image_free(&coarse);
    return rc;
}

static int make_gate(CleanGuide *g, const Image *T, const Image *whole, const Image *masked, FsError *err)
{
    Image R = {0}, power = {0};
    int rc;
    TRY(fs_image_copy(&R, whole, err));
    for (size_t i = 0; i < fs_image_values(&R); i++) R.px[i] -= T->px[i];
    TRY(detail_power(T, &g->gate, err));
    TRY(detail_power(&R, &power, err));
    for (size_t i = 0; i < fs_image_pixels(&power); i++) {
        float t = g->gate.px[i] + NO_DETAIL;
        g->gate.px[i] = t / (t + AGAINST_R * power.px[i]);
        if (masked) g->gate.px[i] *= 1 - masked->px[i];
    }
fail:
    fs_image_free(&R);
    fs_image_free(&power);
    return rc;
}

static int make_level(CleanGuide *g, const Image *whole, const Image *small, const Image *clipped, const Image *masked,
                      FsError *err)
{
    Image light = {0}, of = {0};
    int rc;
    TRY(fs_image_copy(&light, small, err));
    TRY(fs_image_copy(&of, whole, err));
    for (size_t i = 0; i < fs_image_values(&of); i++) {
        float w = masked ? 1 - masked->px[i / 3] : 1;
        float missing = fmaxf(of.px[i] - light.px[i], 0) * clipped->px[i / 3];
        light.px[i] = w * (light.px[i] + missing);
        of.px[i] *= w;
    }
    TRY(blurred(&light, LEVEL_SIGMA, err));
    TRY(blurred(&of, LEVEL_SIGMA, err));
    TRY(fs_image_new(&g->level, of.width, of.height, 3, err));
    for (size_t i = 0; i < fs_image_values(&of); i++) {
        float ratio = fmaxf(light.px[i], DARK) / fmaxf(of.px[i], DARK);
        g->level.px[i] = fminf(fmaxf(ratio, 1 / FARTHEST), FARTHEST);
    }
fail:
    fs_image_free(&light);
    fs_image_free(&of);
    return rc;
}

int fs_clean_photo_guide(CleanGuide *g, const Image *small, const Image *clipped, const Image *masked, FsError *err)
{
    Image T = {0}, whole = {0};
    int rc;
    TRY(fs_image_resize_area(&g->T, small->width, small->height, &T, err));
    TRY(fs_image_resize_area(&g->whole, small->width, small->height, &whole, err));
    TRY(make_gate(g, &T, &whole, masked, err));
    TRY(make_level(g, &whole, small, clipped, masked, err));
    fs_tone_encode_image(&g->T); // in between pixels as eyes see it: dark places beside bright ones stay dark
    fs_tone_encode_image(&g->whole);
fail:
    fs_image_free(&T);
    fs_image_free(&whole);
    return rc;
}

// ---- at full size ----

// Of each output column or row, the four samples around its place and their weights (Catmull-Rom).
typedef struct Taps {
    int at[4];
    float weight[4];
} Taps;

static Taps taps_at(int i, int n, int from)
{
    double place = (i + 0.5) * from / n - 0.5;
    int first = (int)floor(place) - 1;
    float t = (float)(place - first - 1);
    Taps taps;
    fs_bicubic_weights(t, taps.weight);
    for (int k = 0; k < 4; k++) taps.at[k] = first + k < 0 ? 0 : first + k >= from ? from - 1 : first + k;
    return taps;
}

typedef struct Job {
    const CleanGuide *guide;
    Image *photo;
    const Image *clipped;
    Taps *column;  // (photo width) into the guide's
    float *rows;   // (workers, 2, guide width * 3)
    size_t n_rows; // values of a worker's
} Job;

// A row of a guide's image between its rows.
static void guide_row(const Image *image, const Taps *taps, float *row)
{
    size_t n = (size_t)image->width * 3;
    memset(row, 0, n * sizeof *row);
    for (int k = 0; k < 4; k++) {
        const float *from = image->px + (size_t)taps->at[k] * n;
        for (size_t i = 0; i < n; i++) row[i] += taps->weight[k] * from[i];
    }
}

static float along(const float *row, const Taps *taps, int c)
{
    float sum = 0;
    for (int k = 0; k < 4; k++) sum += taps->weight[k] * row[3 * taps->at[k] + c];
    return sum;
}

static Bilinear small_place(const Image *small, const Image *photo, int x, int y)
{
    double u = (x + 0.5) * small->width / photo->width - 0.5, v = (y + 0.5) * small->height / photo->height - 0.5;
    return fs_bilinear_at(fmax(u, 0), fmax(v, 0), small->width, small->height);
}

static void clean_row(const Job *job, int y, float *rows)
{
    const CleanGuide *g = job->guide;
    float *T_row = rows, *whole_row = rows + (size_t)g->T.width * 3;
    const Taps taps = taps_at(y, job->photo->height, g->T.height);
    guide_row(&g->T, &taps, T_row);
    guide_row(&g->whole, &taps, whole_row);
    for (int x = 0; x < job->photo->width; x++) {
        Bilinear b = small_place(&g->gate, job->photo, x, y);
        float gate = fs_bilinear_value(&b, g->gate.px, 1, 0), *px = fs_image_at(job->photo, x, y);
        bool clipped = job->clipped->px[(size_t)y * (size_t)job->photo->width + (size_t)x] > 0;
        for (int c = 0; c < 3; c++) {
            float T = fs_tone_decode(along(T_row, &job->column[x], c));
            float whole = fmaxf(fs_tone_decode(along(whole_row, &job->column[x], c)), T);
            float share = whole > T ? (T + DARK) / (whole + DARK) : 1; // also of what is none, as colours beyond sRGB's
            float light = clipped && px[c] > NEARLY_FULL * g->full ? fmaxf(px[c], whole) : px[c];
            float level = fs_bilinear_value(&b, g->level.px, 3, c);
            px[c] = (1 - gate) * level * T + gate * share * light;
        }
    }
}

static void clean_strip(void *context, int strip, int worker)
{
    const Job *job = context;
    int end = (strip + 1) * STRIP < job->photo->height ? (strip + 1) * STRIP : job->photo->height;
    for (int y = strip * STRIP; y < end; y++) clean_row(job, y, job->rows + (size_t)worker * job->n_rows);
}

int fs_clean_photo_apply(const CleanGuide *g, Threads *threads, Image *photo, const Image *clipped, FsError *err)
{
    size_t workers = threads ? (size_t)fs_threads_count(threads) : 1;
    Job job = {.guide = g, .photo = photo, .clipped = clipped, .n_rows = (size_t)g->T.width * 6};
    job.column = malloc((size_t)photo->width * sizeof *job.column);
    job.rows = malloc(workers * job.n_rows * sizeof *job.rows);
    int rc = job.column && job.rows ? 0 : fs_error_memory(err);
    for (int x = 0; x < photo->width && rc == 0; x++) job.column[x] = taps_at(x, photo->width, g->T.width);
    if (rc == 0) fs_threads_for(threads, (photo->height + STRIP - 1) / STRIP, clean_strip, &job);
    free(job.column);
    free(job.rows);
    return rc;
}
