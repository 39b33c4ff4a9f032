// PlayCanvas's SOG, version 2: pictures of a pixel a Gaussian as lossless WebP, and meta.json, in one ZIP. Positions
// are 16 bits of sign(x) log(1 + |x|); scales and colours are numbers of a codebook; rotations three bytes and which
// component is left out; opacity a byte.
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <webp/encode.h>

#include "base/json_file.h"
#include "export/codebook.h"
#include "export/formats.h"
#include "export/zip.h"

#define EFFORT 6 // of the encoder, 0..9

enum { MEANS_LOW, MEANS_HIGH, SCALES, QUATS, COLORS, PICTURES };
static const char *const names[PICTURES] = {"means_l.webp", "means_u.webp", "scales.webp", "quats.webp", "sh0.webp"};

typedef struct Sog {
    const Splats *splats;
    int width, height;
    unsigned char *pixels; // (height, width, 4) of the picture at hand
    float least[3], greatest[3];
    float scales[CODEBOOK], colors[CODEBOOK];
} Sog;

static float in_log(float v)
{
    return copysignf(log1pf(fabsf(v)), v);
}

static int make_codebooks(Sog *sog, FsError *err)
{
    size_t n = 3 * (size_t)sog->splats->n;
    float *dc = malloc(sizeof(float) * (n + 1));
    if (!dc) return fs_error_memory(err);
    for (size_t i = 0; i < n; i++) dc[i] = (float)(((double)sog->splats->srgb[i] - 0.5) / FS_SPLATS_SH0);
    int rc = fs_codebook_make(dc, n, sog->colors, err);
    if (rc == 0) rc = fs_codebook_make(sog->splats->scale, n, sog->scales, err);
    free(dc);
    for (int a = 0; a < 3; a++) {
        float range[2];
        fs_splats_range(sog->splats->mean + a, sog->splats->n, range);
        sog->least[a] = in_log(range[0]), sog->greatest[a] = in_log(range[1]);
    }
    return rc;
}

static void fill_pixel(const Sog *sog, int picture, size_t i, unsigned char px[4])
{
    const Splats *s = sog->splats;
    float other[3];
    px[3] = 255;
    if (picture == QUATS) px[3] = (unsigned char)(252 + fs_splats_smallest_three(s->rotation + 4 * i, other));
    if (picture == COLORS) px[3] = (unsigned char)fs_splats_level(255 * fs_splats_opacity(s, i), 255);
    for (size_t a = 0; a < 3; a++) {
        double span = (double)sog->greatest[a] - (double)sog->least[a];
        double from = (double)in_log(s->mean[3 * i + a]) - (double)sog->least[a];
        unsigned place = fs_splats_level(span > 0 ? from / span * 65535 : 0, 65535);
        float dc = (float)(((double)s->srgb[3 * i + a] - 0.5) / FS_SPLATS_SH0);
        switch (picture) {
        case MEANS_LOW: px[a] = (unsigned char)(place & 255); break;
        case MEANS_HIGH: px[a] = (unsigned char)(place >> 8); break;
        case SCALES: px[a] = fs_codebook_nearest(sog->scales, s->scale[3 * i + a]); break;
        case QUATS:
            px[a] = (unsigned char)fs_splats_level(255 * ((double)other[a] * FS_SPLATS_HALF_ROOT + 0.5), 255);
            break;
        default: px[a] = fs_codebook_nearest(sog->colors, dc);
        }
    }
}

// Lossless, also where alpha is 0.
static int encode(const Sog *sog, int picture, ZipEntry *entry, FsError *err)
{
    WebPConfig config;
    WebPPicture webp;
    WebPMemoryWriter memory;
    WebPMemoryWriterInit(&memory);
    bool ok = WebPConfigInit(&config) && WebPConfigLosslessPreset(&config, EFFORT) && WebPPictureInit(&webp);
    if (!ok) return fs_error_set(err, FS_ERR_INPUT, "libwebp: its version does not fit its headers");
    config.exact = 1;
    webp.use_argb = 1, webp.width = sog->width, webp.height = sog->height;
    webp.writer = WebPMemoryWrite, webp.custom_ptr = &memory;
    ok = WebPPictureImportRGBA(&webp, sog->pixels, 4 * sog->width) && WebPEncode(&config, &webp);
    int code = webp.error_code;
    WebPPictureFree(&webp);
    if (ok) {
        *entry = (ZipEntry){names[picture], memory.mem, memory.size};
        return 0;
    }
    WebPMemoryWriterClear(&memory);
    if (code == VP8_ENC_OK || code == VP8_ENC_ERROR_OUT_OF_MEMORY || code == VP8_ENC_ERROR_BITSTREAM_OUT_OF_MEMORY)
        return fs_error_memory(err);
    return fs_error_set(err, FS_ERR_INPUT, "%s: libwebp fails with error %d", names[picture], code);
}

static int make_meta(const Sog *sog, ZipEntry *entry, FsError *err)
{
    json_t *root =
        json_pack("{s:i, s:i, s:b, s:{s:o, s:o, s:[ss]}, s:{s:o, s:[s]}, s:{s:[s]}, s:{s:o, s:[s]}}", "version", 2,
                  "count", sog->splats->n, "antialias", 0, "means", "mins", fs_json_file_floats(sog->least, 3), "maxs",
                  fs_json_file_floats(sog->greatest, 3), "files", names[MEANS_LOW], names[MEANS_HIGH], "scales",
                  "codebook", fs_json_file_floats(sog->scales, CODEBOOK), "files", names[SCALES], "quats", "files",
                  names[QUATS], "sh0", "codebook", fs_json_file_floats(sog->colors, CODEBOOK), "files", names[COLORS]);
    char *text = root ? json_dumps(root, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
    json_decref(root);
    if (!text) return fs_error_memory(err);
    *entry = (ZipEntry){"meta.json", text, strlen(text)};
    return 0;
}

int fs_sog_write(const Splats *splats, const char *path, FsError *err)
{
    int rc, side = (int)ceil(sqrt((double)splats->n));
    ZipEntry entry[PICTURES + 1] = {0};
    Sog sog = {.splats = splats, .width = side > 0 ? side : 1};
    sog.height = (splats->n + sog.width - 1) / sog.width;
    if (sog.height < 1) sog.height = 1;
    sog.pixels = calloc((size_t)sog.width * (size_t)sog.height, 4);
    if (!sog.pixels) return fs_error_memory(err);
    TRY(make_codebooks(&sog, err));
    TRY(make_meta(&sog, &entry[0], err));
    for (int p = 0; p < PICTURES; p++) {
        for (size_t i = 0; i < (size_t)splats->n; i++) fill_pixel(&sog, p, i, sog.pixels + 4 * i);
        TRY(encode(&sog, p, &entry[1 + p], err));
    }
    TRY(fs_zip_write(entry, PICTURES + 1, path, err));
fail:
    for (int k = 0; k <= PICTURES; k++) free(entry[k].data);
    free(sog.pixels);
    return rc;
}
