// Thresholds from the four rendered captures, truth and results: T_N is under a twentieth of a T_F that is brighter
// than half the mean flash photo in up to 4 % of the picture, R holds 44 to 48 % of a photo's light.
#include "render/verdict.h"

#include <math.h>

#include "image/tone.h"

#define BRIGHT 0.5       // of the mean I_F
#define BLACK 0.05       // of T_F
#define LOST_MOST 0.08   // share of the picture
#define SHARE_LEAST 0.03 // of I_N's light, of either layer
#define PSNR_LEAST 24.0  // dB

static float grey(const Image *image, size_t pixel)
{
    const float *p = image->px + 3 * pixel;
    return (p[0] + p[1] + p[2]) / 3;
}

static void add_layers(Verdict *v, const Renders *renders)
{
    const Image *layer = renders->layer;
    size_t n = fs_image_pixels(&layer[RENDER_T_N]);
    double flash = 0;
    for (size_t i = 0; i < n; i++) {
        flash += (double)grey(&layer[RENDER_I_F], i) / (double)n;
        v->t += (double)grey(&layer[RENDER_T_N], i);
        v->r += (double)grey(&layer[RENDER_R], i);
        v->i += (double)grey(&layer[RENDER_I_N], i);
    }
    for (size_t i = 0; i < n; i++) {
        double lit = (double)grey(&layer[RENDER_T_F], i);
        v->lost += lit > BRIGHT * flash && (double)grey(&layer[RENDER_T_N], i) < BLACK * lit;
    }
    v->pixels += (double)n;
    v->views++;
}

static void add_photo(Verdict *v, const Image *composite, const Image *photo, const Image *mask)
{
    for (size_t i = 0; i < fs_image_pixels(photo); i++) {
        if (mask && mask->px && mask->px[i] < 0.5f) continue;
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            double d = (double)(fs_tone_encode(composite->px[c]) - fs_tone_encode(photo->px[c]));
            if (!isfinite(d)) continue;
            v->error2 += d * d;
            v->compared++;
        }
    }
    v->photos++;
}

void fs_verdict_add(Verdict *verdict, const Renders *renders, const Image *composite, const Image *photo,
                    const Image *mask)
{
    add_layers(verdict, renders);
    if (photo && photo->px && photo->width == composite->width && photo->height == composite->height)
        add_photo(verdict, composite, photo, mask);
}

void fs_verdict_tell(const Verdict *v, const Log *log)
{
    if (!v->views || !(v->i > 0)) return;
    double lost = v->lost / v->pixels, mirrored = v->r / v->i, behind = v->t / v->i;
    fs_log_info(
        log,
        "render: T_N and R hold %.0f and %.0f %% of the light without flash; T_N is black beside a bright T_F in "
        "%.1f %% of the picture",
        100 * behind, 100 * mirrored, 100 * lost);
    if (lost > LOST_MOST)
        fs_log_warn(
            log,
            "in %.0f %% of the picture the scene behind the pane is black without flash and bright with it (up to "
            "%.0f %% is usual): its light went to the mirrored scene there; look at T_N and R before using them",
            100 * lost, 100 * LOST_MOST);
    if (mirrored < SHARE_LEAST)
        fs_log_warn(log, "R is empty (%.1f %% of the light without flash): nothing mirrored was found", 100 * mirrored);
    if (behind < SHARE_LEAST)
        fs_log_warn(log, "T_N is empty (%.1f %% of the light without flash): all of it went to the mirrored scene",
                    100 * behind);
    if (!(v->compared > 0)) return;
    double psnr = -10 * log10(fmax(v->error2 / v->compared, 1e-12));
    fs_log_info(log, "render: the layers put together match the photos to %.1f dB", psnr);
    if (psnr < PSNR_LEAST)
        fs_log_warn(log,
                    "the layers put together match the photos to %.1f dB only (%.0f or more is usual): poses are off, "
                    "something moved, or the training was too short",
                    psnr, PSNR_LEAST);
}
