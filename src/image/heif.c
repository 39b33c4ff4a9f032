// HEIC, HEIF and AVIF through libheif: the primary picture, upright; gain maps, depth and other pictures are left
// alone.
#include <errno.h>
#include <libheif/heif.h>
#include <stdlib.h>
#include <string.h>

#include "image/heif.h"

enum { TRANSFER_LINEAR = 8, TRANSFER_PQ = 16, TRANSFER_HLG = 18 }; // of ISO 23091-2
enum { PRIMARIES_2020 = 9, PRIMARIES_P3 = 12 };

typedef struct Heif {
    const char *path;
    struct heif_context *context;
    struct heif_image_handle *handle; // of the primary picture
    struct heif_image *image;
} Heif;

static const char *advice(struct heif_error e)
{
    if (e.code != heif_error_Unsupported_filetype && e.code != heif_error_Unsupported_feature)
        return "copy it again, or convert it to JPEG";
    if (e.subcode == heif_suberror_Unsupported_codec && !heif_have_decoder_for_format(heif_compression_HEVC))
        return "libheif is here without libde265, which decodes HEIC: install it, or convert it to JPEG";
    if (e.subcode == heif_suberror_Unsupported_codec && !heif_have_decoder_for_format(heif_compression_AV1))
        return "libheif is here without dav1d or libaom, which decode AVIF: install one, or convert it to JPEG";
    return "of a kind that this libheif cannot read: convert it to JPEG";
}

static int failed(const Heif *h, struct heif_error e, FsError *err)
{
    bool refused = e.subcode == heif_suberror_Security_limit_exceeded; // by the limits that are set here
    if ((e.code == heif_error_Memory_allocation_error && !refused) || errno == ENOMEM) return fs_error_memory(err);
    const char *what = e.message ? e.message : "damaged";
    return fs_error_input(err, "%s: bad HEIF: %s: %s", h->path, what, advice(e));
}

bool fs_heif_is(const unsigned char head[12])
{
    static const char brands[] = "heic heix heim heis hevc hevx mif1 mif2 msf1 avif avis MiHE";
    char brand[6] = {(char)head[8], (char)head[9], (char)head[10], (char)head[11]};
    return memcmp(head + 4, "ftyp", 4) == 0 && strlen(brand) == 4 && strstr(brands, brand) && !strchr(brand, ' ');
}

static void close_heif(Heif *h)
{
    if (h->image) heif_image_release(h->image);
    if (h->handle) heif_image_handle_release(h->handle);
    if (h->context) heif_context_free(h->context);
}

enum { MOST_TILE = 4096 }; // pixels a side: tiles may be larger than what is made of them

static int open_heif(Heif *h, const char *path, FsError *err)
{
    *h = (Heif){.path = path};
    MUST(fs_heif_links_check(path, err));
    h->context = heif_context_alloc();
    int rc = 0;
    struct heif_error e;
    if (!h->context) return fs_error_memory(err);
    errno = 0;
    heif_context_set_maximum_image_size_limit(h->context, FS_IMAGE_MAX_SIDE);
    heif_context_set_max_decoding_threads(h->context, 0); // photos are read side by side already
    e = heif_context_read_from_file(h->context, path, NULL);
    if (e.code) TRY(failed(h, e, err));
    e = heif_context_get_primary_image_handle(h->context, &h->handle);
    if (e.code) TRY(failed(h, e, err));
    int w = heif_image_handle_get_width(h->handle), large = heif_image_handle_get_height(h->handle);
    double pixels = (double)w * large;
    if (!(pixels >= 1 && pixels <= FS_IMAGE_MAX_PIXELS))
        TRY(fs_error_input(err, "%s: bad HEIF: a picture of %g pixels", path, pixels));
    if (large < w) large = w;
    if (large < MOST_TILE) large = MOST_TILE;
    heif_context_set_maximum_image_size_limit(h->context, large); // a grid may say another size than its picture's
fail:
    if (rc < 0) close_heif(h);
    return rc;
}

// ---- what its values mean ----

static int read_profile(const Heif *h, LightTag *tag, FsError *err)
{
    size_t size = heif_image_handle_get_raw_color_profile_size(h->handle);
    if (size < 1 || size > 1 << 24) return 0;
    tag->icc = malloc(size);
    if (!tag->icc) return fs_error_memory(err);
    tag->icc_size = size;
    struct heif_error e = heif_image_handle_get_raw_color_profile(h->handle, tag->icc);
    return e.code ? failed(h, e, err) : 0;
}

static int read_nclx(const Heif *h, LightTag *tag, FsError *err)
{
    struct heif_color_profile_nclx *nclx = NULL;
    bool read = heif_image_handle_get_nclx_color_profile(h->handle, &nclx).code == 0;
    if (!read && nclx) heif_nclx_color_profile_free(nclx); // values it does not know
    if (!read || !nclx) return 0;
    int transfer = (int)nclx->transfer_characteristics, primaries = (int)nclx->color_primaries;
    heif_nclx_color_profile_free(nclx);
    tag->linear = transfer == TRANSFER_LINEAR;
    tag->srgb = !tag->linear;
    tag->colors = primaries == PRIMARIES_P3 ? COLORS_P3 : primaries == PRIMARIES_2020 ? COLORS_2020 : COLORS_SRGB;
    if (transfer != TRANSFER_PQ && transfer != TRANSFER_HLG) return 0;
    return fs_error_input(err,
                          "%s: an HDR picture (%s): expected one for ordinary screens; set the camera so, or to RAW",
                          h->path, transfer == TRANSFER_PQ ? "PQ" : "HLG");
}

int fs_heif_read_tag(const char *path, LightTag *tag, FsError *err)
{
    Heif h;
    *tag = (LightTag){0};
    int rc = open_heif(&h, path, err);
    if (rc < 0) return rc;
    enum heif_color_profile_type type = heif_image_handle_get_color_profile_type(h.handle);
    if (type == heif_color_profile_type_nclx) rc = read_nclx(&h, tag, err);
    if (type == heif_color_profile_type_prof || type == heif_color_profile_type_rICC) rc = read_profile(&h, tag, err);
    close_heif(&h);
    if (rc < 0) fs_profile_tag_free(tag);
    return rc;
}

// ---- EXIF ----

// The block begins with how far its TIFF header is.
static void read_exif(const Heif *h, ExifInfo *info)
{
    heif_item_id id;
    if (heif_image_handle_get_list_of_metadata_block_IDs(h->handle, "Exif", &id, 1) < 1) return;
    size_t size = heif_image_handle_get_metadata_size(h->handle, id);
    unsigned char *data = size > 4 && size < 1 << 24 ? malloc(size) : NULL;
    if (!data && size > 4 && size < 1 << 24) fs_error_memory(NULL);
    if (data && !heif_image_handle_get_metadata(h->handle, id, data).code) {
        uint64_t skip = 4 + ((uint64_t)data[0] << 24 | (uint64_t)data[1] << 16 | (uint64_t)data[2] << 8 | data[3]);
        if (skip < size) fs_ifd_read(&(Block){.fd = -1, .memory = data + skip, .size = size - skip}, info);
    }
    free(data);
}

void fs_heif_read_exif(const char *path, ExifInfo *info)
{
    Heif h;
    if (open_heif(&h, path, NULL) < 0) return;
    read_exif(&h, info);
    info->width = heif_image_handle_get_width(h.handle);
    info->height = heif_image_handle_get_height(h.handle);
    info->orientation = 1; // libheif turns it, by what the file itself says
    close_heif(&h);
}

// ---- the picture ----

static int copy_picture(const Heif *h, Image *image, FsError *err)
{
    int stride, bits = heif_image_get_bits_per_pixel_range(h->image, heif_channel_interleaved);
    const uint8_t *px = heif_image_get_plane_readonly(h->image, heif_channel_interleaved, &stride);
    int width = heif_image_get_width(h->image, heif_channel_interleaved);
    int height = heif_image_get_height(h->image, heif_channel_interleaved);
    size_t n = (size_t)width * 3, bytes = bits > 8 ? 2 : 1;
    if (!px || bits < 8 || bits > 16 || width < 1 || height < 1 || stride < 0 || (size_t)stride < n * bytes)
        return fs_error_input(err, "%s: bad HEIF: %d x %d pixels of %d bits", h->path, width, height, bits);
    MUST(fs_error_about(fs_image_new(image, width, height, 3, err), h->path, err));
    float scale = 1.0f / (float)((1 << bits) - 1);
    for (size_t y = 0; y < (size_t)height; y++) {
        const uint8_t *row = px + y * (size_t)stride;
        for (size_t i = 0; i < n; i++)
            image->px[y * n + i] = scale * (float)(bytes == 2 ? row[2 * i] | row[2 * i + 1] << 8 : row[i]);
    }
    return 0;
}

int fs_heif_read(const char *path, Image *image, FsError *err)
{
    Heif h;
    *image = (Image){0};
    int rc = open_heif(&h, path, err);
    if (rc < 0) return rc;
    bool deep = heif_image_handle_get_luma_bits_per_pixel(h.handle) > 8;
    errno = 0;
    struct heif_error e =
        heif_decode_image(h.handle, &h.image, heif_colorspace_RGB,
                          deep ? heif_chroma_interleaved_RRGGBB_LE : heif_chroma_interleaved_RGB, NULL);
    rc = e.code ? failed(&h, e, err) : copy_picture(&h, image, err);
    close_heif(&h);
    if (rc < 0) fs_image_free(image);
    return rc;
}
