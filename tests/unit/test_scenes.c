// The scale of developed RAW files against rendered scenes with known light: at the photos whose layers are known,
// T + R is the photo, with no gain to fit. Skipped where the scenes are not there.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "image/exif.h"
#include "image/raw.h"
#include "image/tone.h"

static int failures;

static bool read_layer(const char *truth, const char *layer, const char *name, Image *image)
{
    bool good = false;
    char *png = fs_file_path("%s/%s/%s.png", truth, layer, name),
         *jpg = fs_file_path("%s/%s/%s.jpg", truth, layer, name);
    if (png && fs_file_exists(png))
        good = fs_png_read(png, image, NULL) == 0;
    else if (jpg && fs_file_exists(jpg))
        good = fs_jpeg_read(jpg, image, NULL) == 0;
    if (good) fs_tone_decode_image(image);
    free(png);
    free(jpg);
    return good;
}

// Channel means of photo and T + R over the pixels that are nowhere near white; the error's size, in linear light.
static void compare(const char *what, bool flash, const Image *photo, const Image *clipped, const Image *t,
                    const Image *r)
{
    double sum[3] = {0}, want[3] = {0}, error = 0, n = 0;
    for (int i = 0; i < photo->width * photo->height; i++) {
        bool trusted = clipped->px[i] == 0;
        for (int c = 0; c < 3; c++) trusted &= t->px[3 * i + c] + r->px[3 * i + c] < 0.9f;
        if (!trusted) continue;
        n += 3;
        for (int c = 0; c < 3; c++) {
            double x = photo->px[3 * i + c], y = t->px[3 * i + c] + r->px[3 * i + c];
            sum[c] += x, want[c] += y, error += (x - y) * (x - y);
        }
    }
    double least = flash ? 1.0 : 0.99, most = flash ? 1.045 : 1.01; // the flash brightens R by 3 to 12 %
    bool good = n > 0.9 * 3 * photo->width * photo->height && sqrt(error / n) < (flash ? 0.03 : 0.015);
    for (int c = 0; c < 3; c++) good &= sum[c] / want[c] > least && sum[c] / want[c] < most;
    printf("%s %s %s: %.4f %.4f %.4f, rms %.4f\n", good ? "ok  " : "FAIL", what, flash ? "flash" : "ambient",
           sum[0] / want[0], sum[1] / want[1], sum[2] / want[2], sqrt(error / n));
    failures += !good;
}

static int check_photo(const char *scene, const char *name)
{
    int seen = 0;
    FsError err;
    ExifInfo exif;
    RawInfo info;
    PhotoSizes sizes = {.n = 1};
    Image *photo = &sizes.size[0].rgb, *clipped = &sizes.size[0].clipped, t = {0}, r = {0};
    char *raw = fs_file_path("%s/capture/raw/%s.DNG", scene, name), *truth = fs_file_path("%s/truth", scene);
    if (!read_layer(truth, "R", name, &r)) goto done;
    seen = 1;
    if (fs_exif_read(raw, &exif, &err) < 0 || fs_raw_read_info(raw, &info, &err) < 0 ||
        fs_raw_read(raw, info.white_balance, false, &sizes, &err) < 0) {
        printf("FAIL %s\n", err.message);
        failures++;
        goto done;
    }
    bool flash = fs_exif_flash_fired(&exif) == 1, same = false;
    if (read_layer(truth, flash ? "T_F" : "T_N", name, &t)) same = t.width == photo->width && t.height == photo->height;
    if (same && r.width == t.width && r.height == t.height && fs_exif_flash_fired(&exif) >= 0) {
        compare(raw + strlen(SCENES) + 1, flash, photo, clipped, &t, &r);
    } else {
        printf("FAIL %s: the truth has another size\n", raw);
        failures++;
    }
done:
    fs_sizes_free(&sizes);
    fs_image_free(&t);
    fs_image_free(&r);
    free(raw);
    free(truth);
    return seen;
}

int main(void)
{
    static const char *const names[] = {"poster", "shelf", "controller", "lab"};
    int checked = 0;
    for (int s = 0; s < 4; s++) {
        char *scene = fs_file_path("%s/%s", SCENES, names[s]);
        for (int i = 1; i <= 30; i++) {
            char name[20];
            snprintf(name, sizeof name, "IMG_%04d", i);
            checked += check_photo(scene, name);
        }
        free(scene);
    }
    if (checked == 0) {
        printf("skipped: no scenes at %s\n", SCENES);
        return 77;
    }
    return failures ? 1 : 0;
}
