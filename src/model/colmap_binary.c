// Binary files of a COLMAP model: little-endian, counts as 64-bit numbers in front.
#include <limits.h>
#include <string.h>

#include "model/colmap_model.h"

typedef struct Reader {
    const char *path, *p, *end;
    bool short_of; // read past the end
} Reader;

// The next `size` bytes as a little-endian number; 0 past the end.
static uint64_t get_uint(Reader *r, int size)
{
    if (r->end - r->p < size) {
        r->p = r->end;
        r->short_of = true;
        return 0;
    }
    uint64_t v = 0;
    for (int i = 0; i < size; i++) v |= (uint64_t)(unsigned char)r->p[i] << (8 * i);
    r->p += size;
    return v;
}

static double get_double(Reader *r)
{
    uint64_t bits = get_uint(r, 8);
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static int cut_short(const Reader *r, FsError *err)
{
    return fs_error_input(err, "%s: ends too early; the file is cut short or not a COLMAP file", r->path);
}

// A count in front of records of at least `least` bytes: more of them than fit into the rest is a lie.
static int get_count(Reader *r, size_t least, int *count, FsError *err)
{
    uint64_t n = get_uint(r, 8);
    if (r->short_of) return cut_short(r, err);
    if (n > (uint64_t)(r->end - r->p) / least || n > INT_MAX / 2)
        return fs_error_input(err,
                              "%s: claims %llu entries, but only %lld bytes follow; not a COLMAP file or cut short",
                              r->path, (unsigned long long)n, (long long)(r->end - r->p));
    *count = (int)n;
    return 0;
}

static int read_cameras(Reader *r, ColmapModel *model, FsError *err)
{
    int n;
    MUST(get_count(r, 4 + 4 + 16 + 16, &n, err));
    for (int i = 0; i < n; i++) {
        ColmapCamera *c = fs_colmap_model_add_camera(model, err);
        if (!c) return FS_ERR_MEMORY;
        c->id = (uint32_t)get_uint(r, 4);
        c->lens.model = (int)(uint32_t)get_uint(r, 4);
        uint64_t w = get_uint(r, 8), h = get_uint(r, 8);
        int n_params = 0;
        if (!r->short_of && !fs_lens_model_name(c->lens.model, &n_params))
            return fs_error_input(err, "%s: camera %u has unknown model number %d", r->path, c->id, c->lens.model);
        for (int k = 0; k < n_params; k++) c->lens.param[k] = get_double(r);
        if (r->short_of) return cut_short(r, err);
        if (w < 1 || h < 1 || w > 1000000 || h > 1000000)
            return fs_error_input(err, "%s: camera %u has a size of %llu x %llu pixels", r->path, c->id,
                                  (unsigned long long)w, (unsigned long long)h);
        c->lens.width = (int)w;
        c->lens.height = (int)h;
    }
    return 0;
}

static int read_observations(Reader *r, ColmapModel *model, FsError *err)
{
    int n;
    MUST(get_count(r, 24, &n, err));
    for (int i = 0; i < n; i++) {
        ColmapObservation o = {.x = get_double(r)}; // each by itself: initializers are evaluated in any order
        o.y = get_double(r);
        o.point = (int64_t)get_uint(r, 8); // 2^64 - 1 becomes -1
        if (o.point < 0) o.point = -1;
        MUST(fs_colmap_model_add_observation(model, o, err));
    }
    return 0;
}

static int read_images(Reader *r, ColmapModel *model, FsError *err)
{
    int n;
    MUST(get_count(r, 4 + 32 + 24 + 4 + 2 + 8, &n, err));
    for (int i = 0; i < n; i++) {
        double pose[7];
        uint32_t id = (uint32_t)get_uint(r, 4);
        for (int k = 0; k < 7; k++) pose[k] = get_double(r);
        uint32_t camera_id = (uint32_t)get_uint(r, 4);
        const char *end = memchr(r->p, 0, (size_t)(r->end - r->p));
        if (r->short_of || !end) return cut_short(r, err);
        ColmapImage *image = fs_colmap_model_add_image(model, r->p, err);
        if (!image) return FS_ERR_MEMORY;
        r->p = end + 1;
        image->id = id;
        image->camera_id = camera_id;
        memcpy(image->quat, pose, sizeof image->quat);
        memcpy(image->t, pose + 4, sizeof image->t);
        MUST(read_observations(r, model, err));
    }
    return 0;
}

static int read_points(Reader *r, ColmapModel *model, FsError *err)
{
    int n, length;
    MUST(get_count(r, 8 + 24 + 3 + 8 + 8, &n, err));
    for (int i = 0; i < n; i++) {
        ColmapPoint *point = fs_colmap_model_add_point(model, err);
        if (!point) return FS_ERR_MEMORY;
        point->id = (int64_t)(get_uint(r, 8) & INT64_MAX);
        for (int k = 0; k < 3; k++) point->xyz[k] = get_double(r);
        for (int k = 0; k < 3; k++) point->rgb[k] = (unsigned char)get_uint(r, 1);
        point->error = get_double(r);
        MUST(get_count(r, 8, &length, err));
        for (int k = 0; k < length; k++) {
            ColmapTrack track = {.image_id = (uint32_t)get_uint(r, 4)};
            track.index = (uint32_t)get_uint(r, 4);
            MUST(fs_colmap_model_add_track(model, track, err));
        }
    }
    return 0;
}

static int read(const char *path, char *data, size_t size, ColmapPart part, ColmapModel *model, FsError *err)
{
    static int (*const readers[COLMAP_PARTS])(Reader *, ColmapModel *, FsError *) = {read_cameras, read_images,
                                                                                     read_points};
    Reader r = {path, data, data + size, false};
    MUST(readers[part](&r, model, err));
    return r.short_of ? cut_short(&r, err) : 0;
}

static void put_uint(FILE *f, uint64_t v, int size)
{
    for (int i = 0; i < size; i++) putc((int)(v >> (8 * i) & 255), f);
}

static void put_double(FILE *f, double v)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    put_uint(f, bits, 8);
}

static void write_cameras(FILE *f, const ColmapModel *model)
{
    put_uint(f, (uint64_t)model->n_cameras, 8);
    for (int i = 0; i < model->n_cameras; i++) {
        const ColmapCamera *c = &model->camera[i];
        int n_params = 0;
        fs_lens_model_name(c->lens.model, &n_params);
        put_uint(f, c->id, 4);
        put_uint(f, (uint32_t)c->lens.model, 4);
        put_uint(f, (uint64_t)c->lens.width, 8);
        put_uint(f, (uint64_t)c->lens.height, 8);
        for (int k = 0; k < n_params; k++) put_double(f, c->lens.param[k]);
    }
}

static void write_images(FILE *f, const ColmapModel *model)
{
    put_uint(f, (uint64_t)model->n_images, 8);
    for (int i = 0; i < model->n_images; i++) {
        const ColmapImage *image = &model->image[i];
        put_uint(f, image->id, 4);
        for (int k = 0; k < 4; k++) put_double(f, image->quat[k]);
        for (int k = 0; k < 3; k++) put_double(f, image->t[k]);
        put_uint(f, image->camera_id, 4);
        fwrite(image->name, 1, strlen(image->name) + 1, f);
        put_uint(f, (uint64_t)image->n, 8);
        for (int k = 0; k < image->n; k++) {
            const ColmapObservation *o = &model->observation[image->first + k];
            put_double(f, o->x);
            put_double(f, o->y);
            put_uint(f, (uint64_t)o->point, 8);
        }
    }
}

static void write_points(FILE *f, const ColmapModel *model)
{
    put_uint(f, (uint64_t)model->n_points, 8);
    for (int i = 0; i < model->n_points; i++) {
        const ColmapPoint *p = &model->point[i];
        put_uint(f, (uint64_t)p->id, 8);
        for (int k = 0; k < 3; k++) put_double(f, p->xyz[k]);
        for (int k = 0; k < 3; k++) put_uint(f, p->rgb[k], 1);
        put_double(f, p->error);
        put_uint(f, (uint64_t)p->n, 8);
        for (int k = 0; k < p->n; k++) {
            put_uint(f, model->track[p->first + k].image_id, 4);
            put_uint(f, model->track[p->first + k].index, 4);
        }
    }
}

const ColmapFormat fs_colmap_binary = {"bin", read, {write_cameras, write_images, write_points}};
