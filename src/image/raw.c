// RAW files: LibRaw unpacks them. Bayer data are scaled and demosaiced here, because LibRaw's own processing clips at
// 0 and 65535 and rounds; every other kind of sensor (X-Trans, three layers, linear DNG) goes through LibRaw.
#include "image/raw.h"

#include <errno.h>
#include <libraw/libraw.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "image/demosaic.h"
#include "image/extent.h"

#define CLIP_LEVEL 0.98 // of saturation; above it a sensor is not linear
#define BAYER_BYTES 3.0 // a pixel, while a photo is read: the sensor's values, and some
#define PLAIN_BYTES 24.0

static void on_data_error(void *user, const char *file, const int offset)
{
    (void)file, (void)offset;
    *(bool *)user = true;
}

static void on_memory_error(void *user, const char *file, const char *where)
{
    (void)user, (void)file, (void)where;
    fs_error_memory(NULL);
}

static const char *what_it_takes(const char *path)
{
    if (fs_file_has_ext(path, "gpr")) return "GoPro's GPR takes a LibRaw that was built with GoPro's GPR SDK";
    if (fs_file_has_ext(path, "cr3")) return "Canon's newer cameras take LibRaw 0.21";
    if (fs_file_has_ext(path, "dng")) return "damaged, or compressed by JPEG XL, which takes LibRaw 0.22";
    return "damaged, or of a camera newer than it";
}

static int raw_error(const char *path, int code, FsError *err)
{
    if (code == LIBRAW_UNSUFFICIENT_MEMORY || errno == ENOMEM) return fs_error_memory(err);
    if (code == LIBRAW_FILE_UNSUPPORTED)
        return fs_error_input(err,
                              "%s: cannot read as RAW with LibRaw %s, which is at hand (%s): convert it to DNG or use "
                              "JPEGs",
                              path, libraw_version(), what_it_takes(path));
    return fs_error_input(err, "%s: cannot read as RAW: %s", path, code > 0 ? strerror(code) : libraw_strerror(code));
}

// The pixels of Fujifilm's Super CCD stand on their corners: LibRaw means a square that holds them turned.
static bool fits_sensor(const libraw_data_t *raw)
{
    const libraw_image_sizes_t *s = &raw->sizes;
    bool turned = strncasecmp(raw->idata.make, "fuji", 4) == 0 && s->height == s->width - 1;
    if (turned) return s->width <= s->raw_width + s->raw_height;
    return s->width <= s->raw_width && s->height <= s->raw_height;
}

static int open_raw(const char *path, bool *damaged, libraw_data_t **raw, FsError *err)
{
    *damaged = false;
    *raw = NULL;
    MUST(fs_extent_check(path, err));
    *raw = libraw_init(0);
    if (!*raw) return fs_error_memory(err);
    libraw_set_dataerror_handler(*raw, on_data_error, damaged);
    libraw_set_memerror_handler(*raw, on_memory_error, NULL);
    errno = 0;
    int code = libraw_open_file(*raw, path);
    const libraw_image_sizes_t *s = &(*raw)->sizes;
    if (code != LIBRAW_SUCCESS || errno == ENOMEM) { // then it may have left something out
        code = raw_error(path, code, err);
    } else if (s->width < FS_DEMOSAIC_MIN_SIDE || s->height < FS_DEMOSAIC_MIN_SIDE || !fits_sensor(*raw) ||
               (int64_t)s->raw_width * s->raw_height > FS_IMAGE_MAX_PIXELS) {
        code = fs_error_input(err, "%s: a RAW picture of %d x %d pixels on a sensor of %d x %d: damaged?", path,
                              s->width, s->height, s->raw_width, s->raw_height);
    } else {
        return 0;
    }
    libraw_close(*raw);
    *raw = NULL;
    return code;
}

static void green_to_one(const float mul[4], double out[3])
{
    bool good = mul[0] > 0 && mul[1] > 0 && mul[2] > 0 && isfinite(mul[0]) && isfinite(mul[1]) && isfinite(mul[2]);
    for (int c = 0; c < 3; c++) out[c] = good ? (double)mul[c] / (double)mul[1] : 0.0;
}

// LibRaw's matrix, when it keeps grey grey; it knows none for some cameras.
static void color_matrix(const libraw_data_t *raw, double matrix[9])
{
    bool good = raw->idata.colors == 3;
    for (int r = 0; r < 3; r++) {
        const float *row = raw->color.rgb_cam[r];
        double sum = (double)row[0] + (double)row[1] + (double)row[2];
        good = good && isfinite(sum) && fabs(sum - 1) < 0.05 && row[r] > 0;
        for (int c = 0; c < 3; c++) matrix[3 * r + c] = (double)row[c];
    }
    if (!good) memset(matrix, 0, 9 * sizeof *matrix);
}

// LibRaw's own table; of a DNG what the file says, under D65 or the light that stands last.
static void xyz_matrix(const libraw_data_t *raw, double matrix[9])
{
    enum { D65 = 21 };
    const libraw_dng_color_t *dng = raw->color.dng_color;
    const libraw_dng_color_t *last = dng[1].colormatrix[1][1] != 0 && dng[0].illuminant != D65 ? &dng[1] : &dng[0];
    bool good = raw->idata.colors == 3, told = raw->color.cam_xyz[1][1] != 0;
    for (int i = 0; i < 9; i++) {
        matrix[i] = (double)(told ? raw->color.cam_xyz[i / 3][i % 3] : last->colormatrix[i / 3][i % 3]);
        good = good && isfinite(matrix[i]) && fabs(matrix[i]) < 20;
    }
    for (int r = 0; r < 3; r++) good = good && fabs(matrix[3 * r]) + fabs(matrix[3 * r + 1]) > 0;
    if (!good) memset(matrix, 0, 9 * sizeof *matrix);
}

int fs_raw_read_info(const char *path, RawInfo *info, FsError *err)
{
    *info = (RawInfo){0};
    bool damaged;
    libraw_data_t *raw;
    MUST(open_raw(path, &damaged, &raw, err));
    static const int exif_of_flip[8] = {1, 2, 4, 3, 5, 8, 6, 7};
    const libraw_imgother_t *shot = &raw->other;
    bool bayer = raw->idata.filters >= 1000 && raw->idata.colors == 3 && !raw->rawdata.ioparams.fuji_width;
    info->memory = (bayer ? BAYER_BYTES : PLAIN_BYTES) * raw->sizes.raw_width * raw->sizes.raw_height;
    info->width = raw->sizes.width;
    info->height = raw->sizes.height;
    info->orientation = exif_of_flip[raw->sizes.flip & 7];
    info->flash = raw->color.flash_used > 0 ? 1 : -1;
    snprintf(info->make, sizeof info->make, "%s", raw->idata.make);
    snprintf(info->model, sizeof info->model, "%s", raw->idata.model);
    green_to_one(raw->color.cam_mul, info->white_balance);
    green_to_one(raw->color.pre_mul, info->daylight);
    color_matrix(raw, info->srgb_from_camera);
    xyz_matrix(raw, info->camera_from_xyz);
    double stops = (double)raw->color.dng_levels.baseline_exposure;
    info->baseline_exposure = fabs(stops) < 10 ? stops : 0; // LibRaw: -999 where there is none
    info->exposure_s = shot->shutter > 0 && isfinite(shot->shutter) ? shot->shutter : 0;
    info->iso = shot->iso_speed > 0 && isfinite(shot->iso_speed) ? shot->iso_speed : 0;
    info->f_number = shot->aperture > 0 && isfinite(shot->aperture) ? shot->aperture : 0;
    info->focal_mm = shot->focal_len > 0 && isfinite(shot->focal_len) ? shot->focal_len : 0;
    libraw_close(raw);
    return 0;
}

// Colours of the 2 x 2 cell at the top left of the visible area (0 R, 1 G, 2 B); false when it is not a Bayer sensor.
static bool bayer_pattern(libraw_data_t *raw, unsigned char cfa[4])
{
    if (!raw->rawdata.raw_image || raw->idata.colors != 3 || raw->idata.filters < 1000 ||
        raw->rawdata.ioparams.fuji_width || raw->rawdata.ph1_cblack || raw->rawdata.ph1_rblack)
        return false;
    for (int y = 0; y < 16; y++)
        for (int x = 0; x < 16; x++) {
            char name = raw->idata.cdesc[libraw_COLOR(raw, y, x) & 3];
            int color = name == 'R' ? 0 : name == 'G' ? 1 : name == 'B' ? 2 : 3, at = (y & 1) * 2 + (x & 1);
            if (y < 2 && x < 2) cfa[at] = (unsigned char)color;
            if (color == 3 || cfa[at] != color) return false;
        }
    return fs_demosaic_is_bayer(cfa);
}

// The sensor's values as LibRaw hands them over.
typedef struct Sensor {
    const ushort *px; // first visible pixel
    size_t pitch;     // values per row
    int width, height;
    double black[8][8], white; // black: repeated
    double clip;               // value from which on a pixel counts as saturated
    double gain[2][2];         // white balance of the cell's pixels
    ushort *highest;           // (height) of each row
    float *clipped;            // (width) of a row
    PhotoSizes *sizes;         // where the picture goes
} Sensor;

static int find_levels(const char *path, libraw_data_t *raw, Sensor *s, FsError *err)
{
    const libraw_colordata_t *color = &raw->color;
    unsigned rows = color->cblack[4], columns = color->cblack[5];
    if (rows > 8 || columns > 8 || 8 % (rows ? rows : 1) || 8 % (columns ? columns : 1)) rows = columns = 0;
    double highest = 0;
    for (unsigned y = 0; y < 8; y++)
        for (unsigned x = 0; x < 8; x++) {
            double b = (double)color->black + color->cblack[libraw_COLOR(raw, (int)y, (int)x) & 3];
            if (rows && columns) b += color->cblack[6 + (y % rows) * columns + x % columns];
            s->black[y][x] = b;
            highest = fmax(highest, b);
        }
    s->white = color->maximum;
    if (!(s->white > highest + 15))
        return fs_error_input(err, "%s: white level %g is not above black level %g", path, s->white, highest);
    return 0;
}

#define EMPTY_SHARE 0.02 // of the rows: black to the last bit at the end of a picture, no sensor is

// Data that a damaged file does not have come out as zeros, or as one value.
static int check_filled(const char *path, bool one_value, int height, int filled, FsError *err)
{
    if (filled == 0) return fs_error_input(err, "%s: all black: the file is damaged, or the lens was covered", path);
    if (one_value)
        return fs_error_input(err, "%s: all pixels have one value: the file is damaged; copy it again", path);
    if (height - filled > fmax(EMPTY_SHARE * height, 4))
        return fs_error_input(err, "%s: the last %d of its %d rows are empty: damaged or cut short; copy it again",
                              path, height - filled, height);
    return 0;
}

static int check_sensor(const char *path, const Sensor *s, FsError *err)
{
    int filled = 0; // up to the last row with light or noise
    double black = s->black[0][0];
    for (int i = 0; i < 64; i++) black = fmin(black, s->black[i / 8][i % 8]);
    bool one_value = true;
    for (int y = 0; y < s->height; y++) {
        const ushort *row = s->px + (size_t)y * s->pitch;
        for (int x = 0; x < s->width && one_value; x++) one_value = row[x] == s->px[0];
        for (int x = 0; x < s->width && filled <= y; x++)
            if (row[x] > black || row[x] != row[0]) filled = y + 1;
    }
    return check_filled(path, one_value, s->height, filled, err);
}

// Saturation may lie below the white level that the file states: then many pixels share the highest value.
static void find_clip(Sensor *s)
{
    ushort top = 0;
    size_t count = 0, all = (size_t)s->width * (size_t)s->height;
    for (int y = 0; y < s->height; y++) {
        const ushort *row = s->px + (size_t)y * s->pitch;
        ushort highest = 0;
        for (int x = 0; x < s->width; x++) highest = row[x] > highest ? row[x] : highest;
        s->highest[y] = highest;
        if (highest > top) top = highest, count = 0;
        for (int x = 0; highest == top && x < s->width; x++) count += row[x] == top;
    }
    double black = s->black[0][0], saturation = s->white;
    if (top < s->white && top > black + 0.5 * (s->white - black) && count > 20 && count > all / 20000) saturation = top;
    s->clip = black + CLIP_LEVEL * (saturation - black);
    double least = fmin(fmin(s->gain[0][0], s->gain[0][1]), fmin(s->gain[1][0], s->gain[1][1]));
    s->sizes->white = (float)(least * (saturation - black) / (s->white - black));
}

// The pixels of a row that saturated ones have a part in the demosaiced colour of; NULL: none.
static const float *clipped_row(const Sensor *s, int y)
{
    bool any = false;
    for (int j = -2; j <= 2; j++) {
        if (y + j < 0 || y + j >= s->height || s->highest[y + j] < s->clip) continue;
        if (!any) memset(s->clipped, 0, (size_t)s->width * sizeof *s->clipped);
        any = true;
        const ushort *row = s->px + (size_t)(y + j) * s->pitch;
        for (int x = 0; x < s->width; x++)
            for (int i = abs(j) - 2; row[x] >= s->clip && i <= 2 - abs(j); i++)
                if (x + i >= 0 && x + i < s->width) s->clipped[x + i] = 1;
    }
    return any ? s->clipped : NULL;
}

// Whitened as fs_sizes_whiten does, before colours are told from neighbours.
static void get_mosaic(const void *user, int y, float *out)
{
    const Sensor *s = user;
    const float *clipped = clipped_row(s, y);
    const ushort *row = s->px + (size_t)y * s->pitch;
    double black[8], gain[8];
    for (int x = 0; x < 8; x++) {
        black[x] = s->black[y & 7][x];
        gain[x] = s->gain[y & 1][x & 1] / (s->white - black[x]);
    }
    for (int x = 0; x < s->width; x++) {
        out[x] = (float)((row[x] - black[x & 7]) * gain[x & 7]);
        if (clipped && clipped[x] > 0) out[x] = fminf(out[x], s->sizes->white);
    }
}

static void put_picture(void *user, int y, const float *rgb)
{
    const Sensor *s = user;
    fs_sizes_row(s->sizes, rgb, clipped_row(s, y));
}

// A pixel for each cell of 2 x 2.
static int put_cells(const Sensor *s, const unsigned char cfa[4], FsError *err)
{
    int width = s->width / 2, height = s->height / 2;
    float *mosaic = malloc((size_t)s->width * 2 * sizeof *mosaic);
    float *rgb = calloc((size_t)width * 4, sizeof *rgb), *clipped = rgb ? rgb + 3 * (size_t)width : NULL;
    int rc = 0;
    if (!mosaic || !rgb) TRY(fs_error_memory(err));
    TRY(fs_sizes_begin(s->sizes, width, height, err));
    for (int y = 0; y < height; y++) {
        memset(rgb, 0, (size_t)width * 4 * sizeof *rgb);
        for (int j = 0; j < 2; j++) get_mosaic(s, 2 * y + j, mosaic + (size_t)j * (size_t)s->width);
        for (int x = 0; x < width; x++)
            for (int i = 0; i < 4; i++) {
                size_t at = (size_t)(i / 2) * (size_t)s->width + 2 * (size_t)x + (size_t)(i % 2);
                rgb[3 * x + cfa[i]] += (cfa[i] == 1 ? 0.5f : 1.0f) * mosaic[at];
                if (s->px[(size_t)(2 * y + i / 2) * s->pitch + 2 * (size_t)x + (size_t)(i % 2)] >= s->clip)
                    clipped[x] = 1;
            }
        fs_sizes_row(s->sizes, rgb, clipped);
    }
fail:
    free(mosaic);
    free(rgb);
    return rc;
}

static bool half_is_enough(const PhotoSizes *sizes, int width, int height)
{
    return sizes->enough > 0 && (width > height ? width : height) / 2 >= sizes->enough;
}

static int read_bayer(const char *path, libraw_data_t *raw, const unsigned char cfa[4], const double white_balance[3],
                      PhotoSizes *sizes, FsError *err)
{
    const libraw_image_sizes_t *size = &raw->sizes;
    Sensor s = {.pitch = size->raw_pitch / 2, .width = size->width, .height = size->height, .sizes = sizes};
    int rc = 0;
    if (s.pitch < size->raw_width || size->left_margin + s.width > size->raw_width ||
        size->top_margin + s.height > size->raw_height)
        return fs_error_input(err, "%s: the picture lies outside the sensor: damaged?", path);
    s.px = raw->rawdata.raw_image + size->top_margin * s.pitch + size->left_margin;
    for (int i = 0; i < 4; i++) s.gain[i / 2][i % 2] = white_balance[cfa[i]];
    TRY(find_levels(path, raw, &s, err));
    s.highest = malloc((size_t)s.height * sizeof *s.highest);
    s.clipped = malloc((size_t)s.width * sizeof *s.clipped);
    if (!s.highest || !s.clipped) TRY(fs_error_memory(err));
    TRY(check_sensor(path, &s, err));
    find_clip(&s);
    if (half_is_enough(sizes, s.width, s.height)) {
        rc = put_cells(&s, cfa, err);
        goto fail;
    }
    TRY(fs_sizes_begin(sizes, s.width, s.height, err));
    TRY(fs_demosaic(&(DemosaicRows){get_mosaic, put_picture, &s}, s.width, s.height, cfa, err));
fail:
    free(s.highest);
    free(s.clipped);
    return rc;
}

// Black level of a channel, over all positions.
static double mean_black(const libraw_colordata_t *color, int channel)
{
    double sum = 0;
    unsigned n = color->cblack[4] * color->cblack[5];
    if (n > 64) n = 0;
    for (unsigned i = 0; i < n; i++) sum += color->cblack[6 + i];
    return (double)color->black + color->cblack[channel] + (n ? sum / n : 0);
}

// What LibRaw made, times scale.
static int put_processed(const char *path, const libraw_processed_image_t *made, const double scale[3],
                         const double white_balance[3], bool turned, PhotoSizes *sizes, FsError *err)
{
    size_t width = made->width;
    int filled = 0, rc = 0;
    bool one_value = true;
    ushort first[3] = {0}, v;
    float *rgb = malloc(width * 4 * sizeof *rgb);
    if (!rgb) return fs_error_memory(err);
    float *clipped = rgb + 3 * width;
    TRY(fs_sizes_begin(sizes, made->width, made->height, err));
    sizes->white = (float)fmin(white_balance[0], fmin(white_balance[1], white_balance[2]));
    for (size_t y = 0; y < made->height; y++) {
        memset(clipped, 0, width * sizeof *clipped);
        for (size_t i = 0; i < width * 3; i++) {
            size_t x = i / 3, c = i % 3, at = y * width + x;
            memcpy(&v, made->data + 2 * (made->colors == 3 ? 3 * at + c : at), sizeof v);
            if (at == 0) first[c] = v;
            one_value = one_value && v == first[c];
            if (v) filled = (int)y + 1;
            double linear = v / 65535.0 * scale[c];
            rgb[i] = (float)linear;
            if (linear >= CLIP_LEVEL * white_balance[c]) clipped[x] = 1;
        }
        fs_sizes_whiten(sizes, rgb, clipped);
        fs_sizes_row(sizes, rgb, clipped);
    }
    rc = check_filled(path, one_value, turned && filled ? filled : made->height, filled, err);
fail:
    free(rgb);
    return rc;
}

// LibRaw's multipliers are scaled so that the largest becomes 1 (highlight 1): nothing but sensor white clips. It
// forgets to take the black level off the white one where a file tells it for each channel.
static int read_plain(const char *path, libraw_data_t *raw, const double white_balance[3], PhotoSizes *sizes,
                      FsError *err)
{
    int code, rc = 0;
    double largest = fmax(white_balance[0], fmax(white_balance[1], white_balance[2]));
    libraw_output_params_t *p = &raw->params;
    double range[3]; // from black to white
    for (int c = 0; c < 3; c++) range[c] = raw->color.maximum - mean_black(&raw->color, c);
    if (!(range[0] > 15 && range[1] > 15 && range[2] > 15))
        return fs_error_input(err, "%s: white level %u is not above the black level", path, raw->color.maximum);
    for (int c = 0; c < 4; c++) p->user_mul[c] = (float)white_balance[c == 3 ? 1 : c];
    p->use_camera_wb = p->use_auto_wb = 0;
    p->output_color = 0;
    p->gamm[0] = p->gamm[1] = 1;
    p->no_auto_bright = 1;
    p->adjust_maximum_thr = 0;
    p->bright = 1;
    p->highlight = 1;
    p->output_bps = 16;
    p->user_qual = 3; // adaptive homogeneity-directed
    p->user_flip = 0;
    p->half_size = half_is_enough(sizes, raw->sizes.width, raw->sizes.height);
    errno = 0;
    code = libraw_dcraw_process(raw);
    if (code != LIBRAW_SUCCESS || errno == ENOMEM) return raw_error(path, code, err);
    libraw_processed_image_t *made = libraw_dcraw_make_mem_image(raw, &code);
    if (!made) return raw_error(path, code, err);
    if (made->type != LIBRAW_IMAGE_BITMAP || made->bits != 16 || (made->colors != 3 && made->colors != 1))
        TRY(fs_error_input(err, "%s: a sensor of %d colours, expected red, green and blue", path, made->colors));
    const double scale[3] = {largest * raw->color.maximum / range[0], largest * raw->color.maximum / range[1],
                             largest * raw->color.maximum / range[2]};
    TRY(put_processed(path, made, scale, white_balance, raw->rawdata.ioparams.fuji_width, sizes, err));
fail:
    libraw_dcraw_clear_mem(made);
    return rc;
}

int fs_raw_read(const char *path, const double white_balance[3], bool plain, PhotoSizes *sizes, FsError *err)
{
    bool damaged;
    libraw_data_t *raw;
    fs_sizes_clear(sizes);
    int rc = open_raw(path, &damaged, &raw, err);
    if (rc < 0) return rc;
    unsigned char cfa[4] = {0};
    errno = 0;
    int code = libraw_unpack(raw);
    if (code != LIBRAW_SUCCESS || errno == ENOMEM)
        rc = raw_error(path, code, err);
    else if (damaged)
        rc = fs_error_input(err, "%s: RAW data damaged or cut short: copy the file again", path);
    else if (!plain && bayer_pattern(raw, cfa))
        rc = read_bayer(path, raw, cfa, white_balance, sizes, err);
    else
        rc = read_plain(path, raw, white_balance, sizes, err);
    libraw_close(raw);
    fs_sizes_end(sizes);
    if (rc < 0) fs_sizes_free(sizes);
    return rc;
}
