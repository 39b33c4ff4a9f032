// PNG through libpng. Whatever libpng must release after its longjmp lives in a struct of the caller's frame.
#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "image/image.h"
#include "image/profile.h"

typedef struct Png {
    const char *path;
    FsError *err;
    int rc;
    png_structp png;
    png_infop info;
    png_byte *row; // rows of one whole (interlaced) image when reading, one row when writing
    png_byte **rows;
} Png;

static _Noreturn void stop(png_structp png, int rc)
{
    ((Png *)png_get_error_ptr(png))->rc = rc;
    png_longjmp(png, 1);
}

static void on_error(png_structp png, const char *message)
{
    Png *s = png_get_error_ptr(png);
    if (s->rc < 0) stop(png, s->rc);
    stop(png, errno == ENOMEM ? fs_error_memory(s->err) : fs_error_input(s->err, "%s: bad PNG: %s", s->path, message));
}

static void on_warning(png_structp png, const char *message)
{
    (void)png, (void)message;
}

static void read_info(Png *s, FILE *f)
{
    png_set_user_limits(s->png, FS_IMAGE_MAX_SIDE, FS_IMAGE_MAX_SIDE);
    png_set_chunk_cache_max(s->png, 128);
    png_set_chunk_malloc_max(s->png, 16 << 20);
    png_set_keep_unknown_chunks(s->png, PNG_HANDLE_CHUNK_NEVER, NULL, 0);
    png_init_io(s->png, f);
    png_read_info(s->png, s->info);
}

static void read_header(Png *s, FILE *f, Image *image)
{
    read_info(s, f);
    png_set_expand(s->png);
    png_set_strip_alpha(s->png);
    png_set_interlace_handling(s->png);
    png_read_update_info(s->png, s->info);
    int color = png_get_color_type(s->png, s->info), channels = png_get_channels(s->png, s->info);
    int width = (int)png_get_image_width(s->png, s->info), height = (int)png_get_image_height(s->png, s->info);
    if ((color != PNG_COLOR_TYPE_GRAY && color != PNG_COLOR_TYPE_RGB) || (channels != 1 && channels != 3))
        png_error(s->png, "unexpected colour type");
    int rc = fs_image_new(image, width, height, channels, s->err);
    if (rc < 0) stop(s->png, fs_error_about(rc, s->path, s->err));
}

static void read_pixels(Png *s, Image *image)
{
    size_t stride = png_get_rowbytes(s->png, s->info), n = (size_t)image->width * (size_t)image->channels;
    bool wide = png_get_bit_depth(s->png, s->info) == 16;
    bool interlaced = png_get_interlace_type(s->png, s->info) != PNG_INTERLACE_NONE;
    size_t rows = interlaced ? (size_t)image->height : 1;
    s->row = malloc(stride * rows);
    s->rows = calloc((size_t)image->height, sizeof *s->rows);
    if (!s->row || !s->rows) stop(s->png, fs_error_memory(s->err));
    for (size_t y = 0; y < (size_t)image->height; y++) s->rows[y] = s->row + (interlaced ? y * stride : 0);
    if (interlaced) png_read_image(s->png, s->rows);
    for (size_t y = 0; y < (size_t)image->height; y++) {
        if (!interlaced) png_read_row(s->png, s->row, NULL);
        float *out = image->px + y * n;
        const png_byte *in = s->rows[y];
        for (size_t i = 0; i < n; i++) {
            out[i] = wide ? (float)(in[2 * i] << 8 | in[2 * i + 1]) / 65535.0f : (float)in[i] / 255.0f;
        }
    }
    png_read_end(s->png, NULL);
}

static void read_tag(Png *s, FILE *f, LightTag *tag)
{
    png_charp name;
    png_bytep profile;
    png_uint_32 size = 0;
    int compression, intent;
    double gamma;
    read_info(s, f);
    tag->deep = png_get_bit_depth(s->png, s->info) == 16;
    if (png_get_iCCP(s->png, s->info, &name, &compression, &profile, &size)) {
        tag->icc = malloc(size ? size : 1);
        if (!tag->icc) stop(s->png, fs_error_memory(s->err));
        memcpy(tag->icc, profile, size);
        tag->icc_size = size;
    }
    tag->srgb = png_get_sRGB(s->png, s->info, &intent) != 0;
    if (!tag->srgb && png_get_gAMA(s->png, s->info, &gamma) && gamma > 0) {
        tag->linear = gamma > 0.99 && gamma < 1.01;
        tag->gamma = 1 / gamma;
    }
}

// Reads the picture into image, or (image NULL) what its values are.
static int read_png(const char *path, Image *image, LightTag *tag, FsError *err)
{
    FILE *f;
    MUST(fs_file_open(path, &f, err));
    Png s = {.path = path, .err = err};
    errno = 0;
    s.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &s, on_error, on_warning);
    s.info = s.png ? png_create_info_struct(s.png) : NULL;
    if (!s.info) {
        s.rc = fs_error_memory(err);
    } else if (setjmp(png_jmpbuf(s.png)) == 0) {
        if (image) {
            read_header(&s, f, image);
            read_pixels(&s, image);
        } else {
            read_tag(&s, f, tag);
        }
    }
    if (s.rc == 0 && errno == ENOMEM) s.rc = fs_error_memory(err); // libpng only leaves a chunk out
    png_destroy_read_struct(&s.png, &s.info, NULL);
    free(s.row);
    free(s.rows);
    fclose(f);
    if (s.rc < 0 && image) fs_image_free(image);
    return s.rc;
}

int fs_png_read(const char *path, Image *image, FsError *err)
{
    *image = (Image){0};
    return read_png(path, image, NULL, err);
}

int fs_png_read_tag(const char *path, LightTag *tag, FsError *err)
{
    *tag = (LightTag){0};
    int rc = read_png(path, NULL, tag, err);
    if (rc < 0) fs_profile_tag_free(tag);
    return rc;
}

static void write_pixels(Png *s, FILE *f, const Image *image, int bits)
{
    size_t n = (size_t)image->width * (size_t)image->channels;
    float scale = bits == 16 ? 65535.0f : 255.0f;
    png_init_io(s->png, f);
    png_set_IHDR(s->png, s->info, (png_uint_32)image->width, (png_uint_32)image->height, bits,
                 image->channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(s->png, 4);
    png_write_info(s->png, s->info);
    for (size_t y = 0; y < (size_t)image->height; y++) {
        for (size_t i = 0; i < n; i++) {
            float x = image->px[y * n + i];
            x = x > 0 ? (x < 1 ? x : 1) : 0; // NaN becomes 0
            unsigned v = (unsigned)(x * scale + 0.5f);
            if (bits == 16) {
                s->row[2 * i] = (png_byte)(v >> 8);
                s->row[2 * i + 1] = (png_byte)v;
            } else {
                s->row[i] = (png_byte)v;
            }
        }
        png_write_row(s->png, s->row);
    }
    png_write_end(s->png, s->info);
}

int fs_png_write(const char *path, const Image *image, int bits, FsError *err)
{
    if ((image->channels != 1 && image->channels != 3) || (bits != 8 && bits != 16))
        return fs_error_set(err, FS_ERR_USAGE, "%s: a PNG of %d channels and %d bits: expected 1 or 3, 8 or 16", path,
                            image->channels, bits);
    AtomicFile file;
    int rc = fs_file_begin(&file, path, err);
    if (rc < 0) return rc;
    FsError why = {0};
    Png s = {.path = path, .err = &why};
    errno = 0;
    s.row = malloc((size_t)image->width * (size_t)image->channels * 2);
    s.png = s.row ? png_create_write_struct(PNG_LIBPNG_VER_STRING, &s, on_error, on_warning) : NULL;
    s.info = s.png ? png_create_info_struct(s.png) : NULL;
    if (!s.info)
        s.rc = fs_error_memory(err);
    else if (setjmp(png_jmpbuf(s.png)) == 0)
        write_pixels(&s, file.f, image, bits);
    else
        s.rc = s.rc == FS_ERR_MEMORY ? fs_error_memory(err) : fs_file_failed(&file, why.message, err);
    png_destroy_write_struct(&s.png, &s.info);
    free(s.row);
    if (s.rc == 0) return fs_file_commit(&file, err);
    fs_file_abort(&file);
    return s.rc;
}
