// Text files of a COLMAP model: one camera or point a line, two lines an image, '#' begins a comment line.
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "model/colmap_model.h"

typedef struct Lines {
    const char *path;
    char *p, *end; // rest of the text
    char *line;    // present line, 0-terminated; its reading goes on at `at`
    char *at;
    int number;
} Lines;

static bool next_line(Lines *l)
{
    if (l->p >= l->end) return false;
    char *stop = memchr(l->p, '\n', (size_t)(l->end - l->p));
    if (!stop) stop = l->end; // fs_file_read put a 0 there
    *stop = 0;
    l->line = l->at = l->p;
    l->p = stop + 1;
    l->number++;
    return true;
}

static bool is_blank(const char *s)
{
    return s[strspn(s, " \t\r")] == 0;
}

// The next line that is neither empty nor a comment.
static bool next_record(Lines *l)
{
    while (next_line(l))
        if (!is_blank(l->line) && l->line[strspn(l->line, " \t")] != '#') return true;
    return false;
}

static char *next_word(Lines *l)
{
    l->at += strspn(l->at, " \t\r");
    if (!*l->at) return NULL;
    char *word = l->at;
    l->at += strcspn(l->at, " \t\r");
    if (*l->at) *l->at++ = 0;
    return word;
}

static bool next_double(Lines *l, double *v)
{
    char *word = next_word(l), *end;
    if (!word) return false;
    *v = strtod(word, &end);
    return *end == 0 && end != word;
}

static bool next_integer(Lines *l, int64_t min, int64_t max, int64_t *v)
{
    char *word = next_word(l), *end;
    if (!word) return false;
    errno = 0;
    long long value = strtoll(word, &end, 10);
    *v = value;
    return *end == 0 && end != word && errno == 0 && value >= min && value <= max;
}

static int bad_line(const Lines *l, const char *expected, FsError *err)
{
    return fs_error_input(err, "%s: line %d: expected %s", l->path, l->number, expected);
}

static int read_cameras(Lines *l, ColmapModel *model, FsError *err)
{
    while (next_record(l)) {
        ColmapCamera *c = fs_colmap_model_add_camera(model, err);
        if (!c) return FS_ERR_MEMORY;
        int64_t id, w, h;
        if (!next_integer(l, 0, UINT32_MAX, &id)) return bad_line(l, "a camera's number", err);
        const char *name = next_word(l);
        c->lens.model = name ? fs_lens_model_find(name) : -1;
        int n_params = 0;
        if (!fs_lens_model_name(c->lens.model, &n_params)) return bad_line(l, "the name of a camera model", err);
        if (!next_integer(l, 1, 1000000, &w) || !next_integer(l, 1, 1000000, &h))
            return bad_line(l, "width and height in pixels", err);
        for (int k = 0; k < n_params; k++)
            if (!next_double(l, &c->lens.param[k])) return bad_line(l, "all the parameters of the camera model", err);
        c->id = (uint32_t)id;
        c->lens.width = (int)w;
        c->lens.height = (int)h;
    }
    return 0;
}

static int read_observations(Lines *l, ColmapModel *model, FsError *err)
{
    double x, y;
    int64_t point;
    while (!is_blank(l->at)) {
        if (!next_double(l, &x) || !next_double(l, &y) || !next_integer(l, -1, INT64_MAX, &point))
            return bad_line(l, "X Y POINT3D_ID", err);
        MUST(fs_colmap_model_add_observation(model, (ColmapObservation){x, y, point}, err));
    }
    return 0;
}

static int read_images(Lines *l, ColmapModel *model, FsError *err)
{
    while (next_record(l)) {
        int64_t id, camera_id;
        double pose[7];
        if (!next_integer(l, 0, UINT32_MAX, &id)) return bad_line(l, "an image's number", err);
        for (int k = 0; k < 7; k++)
            if (!next_double(l, &pose[k])) return bad_line(l, "QW QX QY QZ TX TY TZ", err);
        if (!next_integer(l, 0, UINT32_MAX, &camera_id)) return bad_line(l, "a camera's number", err);
        l->at += strspn(l->at, " \t"); // the name goes on to the end of the line
        size_t n = strlen(l->at);
        while (n > 0 && strchr(" \t\r", l->at[n - 1])) l->at[--n] = 0;
        if (n == 0) return bad_line(l, "an image's name", err);
        ColmapImage *image = fs_colmap_model_add_image(model, l->at, err);
        if (!image) return FS_ERR_MEMORY;
        image->id = (uint32_t)id;
        image->camera_id = (uint32_t)camera_id;
        memcpy(image->quat, pose, sizeof image->quat);
        memcpy(image->t, pose + 4, sizeof image->t);
        if (next_line(l)) MUST(read_observations(l, model, err)); // always there, may be empty
    }
    return 0;
}

static int read_points(Lines *l, ColmapModel *model, FsError *err)
{
    while (next_record(l)) {
        int64_t id, rgb[3], image_id, index;
        double xyz[3], error;
        bool ok = next_integer(l, 0, INT64_MAX, &id);
        for (int k = 0; k < 3; k++) ok = ok && next_double(l, &xyz[k]);
        for (int k = 0; k < 3; k++) ok = ok && next_integer(l, 0, 255, &rgb[k]);
        if (!ok || !next_double(l, &error)) return bad_line(l, "POINT3D_ID X Y Z R G B ERROR", err);
        ColmapPoint *p = fs_colmap_model_add_point(model, err);
        if (!p) return FS_ERR_MEMORY;
        p->id = id;
        p->error = error;
        for (int k = 0; k < 3; k++) {
            p->xyz[k] = xyz[k];
            p->rgb[k] = (unsigned char)rgb[k];
        }
        while (!is_blank(l->at)) {
            if (!next_integer(l, 0, UINT32_MAX, &image_id) || !next_integer(l, 0, UINT32_MAX, &index))
                return bad_line(l, "pairs of IMAGE_ID POINT2D_IDX", err);
            MUST(fs_colmap_model_add_track(model, (ColmapTrack){(uint32_t)image_id, (uint32_t)index}, err));
        }
    }
    return 0;
}

// COLMAP writes how many records follow: "# Number of points: 192, mean track length: 8.6". 0: nothing is said.
static long long declared_count(const char *text)
{
    static const char words[] = "# Number of ";
    const char *header = strstr(text, words);
    if (!header) return 0;
    const char *colon = header + sizeof words - 1 + strcspn(header + sizeof words - 1, ":\n");
    return *colon == ':' ? strtoll(colon + 1, NULL, 10) : 0;
}

static int read(const char *path, char *data, size_t size, ColmapPart part, ColmapModel *model, FsError *err)
{
    static int (*const readers[COLMAP_PARTS])(Lines *, ColmapModel *, FsError *) = {read_cameras, read_images,
                                                                                    read_points};
    const int *const count[COLMAP_PARTS] = {&model->n_cameras, &model->n_images, &model->n_points};
    if (memchr(data, 0, size)) return fs_error_input(err, "%s: not a text file", path);
    Lines l = {.path = path, .p = data, .end = data + size};
    long long declared = declared_count(data); // before it is cut into lines
    MUST(readers[part](&l, model, err));
    if (*count[part] >= declared) return 0;
    return fs_error_input(err, "%s: cut short: its header says %lld records, found %d", path, declared, *count[part]);
}

static void write_cameras(FILE *f, const ColmapModel *model)
{
    fprintf(f, "# Number of cameras: %d\n", model->n_cameras);
    fprintf(f, "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n");
    for (int i = 0; i < model->n_cameras; i++) {
        const ColmapCamera *c = &model->camera[i];
        int n_params = 0;
        const char *name = fs_lens_model_name(c->lens.model, &n_params);
        fprintf(f, "%u %s %d %d", c->id, name, c->lens.width, c->lens.height);
        for (int k = 0; k < n_params; k++) fprintf(f, " %.17g", c->lens.param[k]);
        fputc('\n', f);
    }
}

static void write_images(FILE *f, const ColmapModel *model)
{
    fprintf(f, "# Number of images: %d\n", model->n_images);
    fprintf(f, "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of X Y POINT3D_ID\n");
    for (int i = 0; i < model->n_images; i++) {
        const ColmapImage *image = &model->image[i];
        fprintf(f, "%u", image->id);
        for (int k = 0; k < 4; k++) fprintf(f, " %.17g", image->quat[k]);
        for (int k = 0; k < 3; k++) fprintf(f, " %.17g", image->t[k]);
        fprintf(f, " %u %s\n", image->camera_id, image->name);
        for (int k = 0; k < image->n; k++) {
            const ColmapObservation *o = &model->observation[image->first + k];
            fprintf(f, "%s%.9g %.9g %" PRId64, k ? " " : "", o->x, o->y, o->point);
        }
        fputc('\n', f);
    }
}

static void write_points(FILE *f, const ColmapModel *model)
{
    fprintf(f, "# Number of points: %d\n", model->n_points);
    fprintf(f, "# POINT3D_ID X Y Z R G B ERROR, then pairs of IMAGE_ID POINT2D_IDX\n");
    for (int i = 0; i < model->n_points; i++) {
        const ColmapPoint *p = &model->point[i];
        fprintf(f, "%" PRId64 " %.9g %.9g %.9g %d %d %d %.6g", p->id, p->xyz[0], p->xyz[1], p->xyz[2], p->rgb[0],
                p->rgb[1], p->rgb[2], p->error);
        for (int k = 0; k < p->n; k++)
            fprintf(f, " %u %u", model->track[p->first + k].image_id, model->track[p->first + k].index);
        fputc('\n', f);
    }
}

const ColmapFormat fs_colmap_text = {"txt", read, {write_cameras, write_images, write_points}};
