// JPEG through libjpeg. Whatever must be released after its longjmp lives in a struct of the caller's frame.
#include <errno.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>
#include <jerror.h>

#include "base/file.h"
#include "image/image.h"
#include "image/profile.h"

#define MAX_SCANS 1000 // a progressive file of a few bytes a scan would take for ever

typedef struct Jpeg {
    struct jpeg_error_mgr manager; // first: libjpeg hands back its address
    jmp_buf jump;
    const char *path;
    FsError *err;
    int rc;
    struct jpeg_decompress_struct in;
    struct jpeg_compress_struct out;
    struct jpeg_progress_mgr progress;
    JSAMPLE *row;
} Jpeg;

static _Noreturn void stop(Jpeg *s, int rc)
{
    s->rc = rc;
    longjmp(s->jump, 1);
}

static void on_error(j_common_ptr common)
{
    Jpeg *s = (Jpeg *)common->err;
    char text[JMSG_LENGTH_MAX];
    s->manager.format_message(common, text);
    bool memory = common->err->msg_code == JERR_OUT_OF_MEMORY;
    stop(s, memory ? fs_error_memory(s->err) : fs_error_input(s->err, "%s: bad JPEG: %s", s->path, text));
}

// Lost data comes as a warning and a grey rest of the picture: that is an error here.
static void on_message(j_common_ptr common, int level)
{
    int code = common->err->msg_code;
    if (level < 0 && (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE)) on_error(common);
}

static void on_output(j_common_ptr common)
{
    (void)common;
}

static void on_progress(j_common_ptr common)
{
    Jpeg *s = (Jpeg *)common->err;
    if (common->is_decompressor && ((j_decompress_ptr)common)->input_scan_number > MAX_SCANS)
        stop(s, fs_error_input(s->err, "%s: bad JPEG: more than %d scans", s->path, MAX_SCANS));
}

static void set_handlers(Jpeg *s)
{
    jpeg_std_error(&s->manager);
    s->manager.error_exit = on_error;
    s->manager.emit_message = on_message;
    s->manager.output_message = on_output;
    s->progress.progress_monitor = on_progress;
}

// enough: 0, the whole size.
static void decode(Jpeg *s, FILE *f, int enough, Image *image)
{
    jpeg_create_decompress(&s->in);
    s->in.progress = &s->progress;
    jpeg_stdio_src(&s->in, f);
    jpeg_read_header(&s->in, TRUE);
    if (s->in.num_components != 1 && s->in.num_components != 3)
        stop(s, fs_error_input(s->err, "%s: a JPEG of %d components, expected grey or RGB", s->path,
                               s->in.num_components));
    s->in.out_color_space = s->in.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    s->in.dct_method = JDCT_ISLOW;
    unsigned longer = s->in.image_width > s->in.image_height ? s->in.image_width : s->in.image_height;
    while (enough > 0 && s->in.scale_denom < 8 && longer / (2 * s->in.scale_denom) >= (unsigned)enough)
        s->in.scale_denom *= 2;
    jpeg_calc_output_dimensions(&s->in);
    int rc = fs_image_new(image, (int)s->in.output_width, (int)s->in.output_height, s->in.num_components, s->err);
    if (rc < 0) stop(s, fs_error_about(rc, s->path, s->err));
    jpeg_start_decompress(&s->in);
    size_t n = (size_t)image->width * (size_t)image->channels;
    s->row = malloc(n);
    if (!s->row) stop(s, fs_error_memory(s->err));
    while (s->in.output_scanline < s->in.output_height) {
        float *out = image->px + (size_t)s->in.output_scanline * n;
        if (jpeg_read_scanlines(&s->in, &s->row, 1) != 1) ERREXIT(&s->in, JERR_INPUT_EOF);
        for (size_t i = 0; i < n; i++) out[i] = (float)s->row[i] / 255.0f;
    }
    jpeg_finish_decompress(&s->in);
}

static void decode_tag(Jpeg *s, FILE *f, LightTag *tag)
{
    JOCTET *icc = NULL;
    unsigned size = 0;
    jpeg_create_decompress(&s->in);
    jpeg_stdio_src(&s->in, f);
    jpeg_save_markers(&s->in, JPEG_APP0 + 2, 0xffff);
    jpeg_read_header(&s->in, TRUE);
    if (jpeg_read_icc_profile(&s->in, &icc, &size)) tag->icc = icc, tag->icc_size = size;
}

// Reads the picture into image, or (image NULL) what its values are.
static int read_jpeg(const char *path, int enough, Image *image, LightTag *tag, FsError *err)
{
    FILE *f;
    MUST(fs_file_open(path, &f, err));
    Jpeg s = {.path = path, .err = err};
    set_handlers(&s);
    s.in.err = &s.manager;
    if (setjmp(s.jump) == 0) {
        if (image)
            decode(&s, f, enough, image);
        else
            decode_tag(&s, f, tag);
    }
    jpeg_destroy_decompress(&s.in);
    free(s.row);
    fclose(f);
    if (s.rc < 0 && image) fs_image_free(image);
    return s.rc;
}

int fs_jpeg_read(const char *path, Image *image, FsError *err)
{
    *image = (Image){0};
    return read_jpeg(path, 0, image, NULL, err);
}

int fs_jpeg_read_small(const char *path, int enough, Image *image, FsError *err)
{
    *image = (Image){0};
    return read_jpeg(path, enough, image, NULL, err);
}

int fs_jpeg_read_tag(const char *path, LightTag *tag, FsError *err)
{
    *tag = (LightTag){0};
    int rc = read_jpeg(path, 0, NULL, tag, err);
    if (rc < 0) fs_profile_tag_free(tag);
    return rc;
}

static void write_exif(Jpeg *s, const void *exif, size_t size)
{
    static const char head[6] = "Exif\0"; // and a second 0
    if (size > 65533 - sizeof head)
        stop(s, fs_error_set(s->err, FS_ERR_USAGE, "%s: an EXIF block of %zu bytes, at most 65527 fit", s->path, size));
    jpeg_write_m_header(&s->out, JPEG_APP0 + 1, (unsigned)(size + sizeof head));
    for (size_t i = 0; i < sizeof head; i++) jpeg_write_m_byte(&s->out, head[i]);
    for (size_t i = 0; i < size; i++) jpeg_write_m_byte(&s->out, ((const unsigned char *)exif)[i]);
}

static void encode(Jpeg *s, FILE *f, const Image *image, int quality, const JpegExtras *extras)
{
    jpeg_create_compress(&s->out);
    jpeg_stdio_dest(&s->out, f);
    s->out.image_width = (JDIMENSION)image->width;
    s->out.image_height = (JDIMENSION)image->height;
    s->out.input_components = image->channels;
    s->out.in_color_space = image->channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(&s->out);
    jpeg_set_quality(&s->out, quality, TRUE);
    s->out.dct_method = JDCT_ISLOW;
    s->out.optimize_coding = TRUE;
    if (quality >= 90) s->out.comp_info[0].h_samp_factor = s->out.comp_info[0].v_samp_factor = 1;
    if (extras->exif) s->out.write_JFIF_header = FALSE;
    jpeg_start_compress(&s->out, TRUE);
    if (extras->exif) write_exif(s, extras->exif, extras->exif_size);
    if (extras->icc) jpeg_write_icc_profile(&s->out, extras->icc, (unsigned)extras->icc_size);
    size_t n = (size_t)image->width * (size_t)image->channels;
    while (s->out.next_scanline < s->out.image_height) {
        const float *in = image->px + (size_t)s->out.next_scanline * n;
        for (size_t i = 0; i < n; i++) {
            float x = in[i] > 0 ? (in[i] < 1 ? in[i] : 1) : 0; // NaN becomes 0
            s->row[i] = (JSAMPLE)(x * 255.0f + 0.5f);
        }
        jpeg_write_scanlines(&s->out, &s->row, 1);
    }
    jpeg_finish_compress(&s->out);
}

int fs_jpeg_write(const char *path, const Image *image, int quality, const JpegExtras *extras, FsError *err)
{
    if (image->channels != 1 && image->channels != 3)
        return fs_error_set(err, FS_ERR_USAGE, "%s: a JPEG of %d channels: expected 1 or 3", path, image->channels);
    AtomicFile file;
    int rc = fs_file_begin(&file, path, err);
    if (rc < 0) return rc;
    FsError why = {0};
    Jpeg s = {.path = path, .err = &why};
    set_handlers(&s);
    s.out.err = &s.manager;
    s.row = malloc((size_t)image->width * (size_t)image->channels);
    if (!s.row)
        s.rc = fs_error_memory(err);
    else if (setjmp(s.jump) == 0)
        encode(&s, file.f, image, quality, extras ? extras : &(JpegExtras){0});
    else if (s.rc == FS_ERR_INPUT)
        s.rc = fs_file_failed(&file, why.message, err);
    else if (err)
        *err = why;
    jpeg_destroy_compress(&s.out);
    free(s.row);
    if (s.rc == 0) return fs_file_commit(&file, err);
    fs_file_abort(&file);
    return s.rc;
}
