#include "model/colmap_model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/memory.h"
#include "base/order.h"

#define MAX_FILE ((size_t)4 << 30)

static const char *const parts[COLMAP_PARTS] = {"cameras", "images", "points3D"};

void fs_colmap_model_free(ColmapModel *model)
{
    for (int i = 0; i < model->n_images; i++) free(model->image[i].name);
    free(model->camera);
    free(model->image);
    free(model->point);
    free(model->observation);
    free(model->track);
    *model = (ColmapModel){0};
}

ColmapCamera *fs_colmap_model_add_camera(ColmapModel *model, FsError *err)
{
    if (fs_memory_grow(&model->camera, model->n_cameras, sizeof *model->camera, err) < 0) return NULL;
    ColmapCamera *camera = &model->camera[model->n_cameras++];
    *camera = (ColmapCamera){0};
    return camera;
}

ColmapImage *fs_colmap_model_add_image(ColmapModel *model, const char *name, FsError *err)
{
    if (fs_memory_grow(&model->image, model->n_images, sizeof *model->image, err) < 0) return NULL;
    char *copy = strdup(name);
    if (!copy) {
        fs_error_memory(err);
        return NULL;
    }
    ColmapImage *image = &model->image[model->n_images++];
    *image = (ColmapImage){.quat = {1, 0, 0, 0}, .name = copy, .first = model->n_observations};
    return image;
}

ColmapPoint *fs_colmap_model_add_point(ColmapModel *model, FsError *err)
{
    if (fs_memory_grow(&model->point, model->n_points, sizeof *model->point, err) < 0) return NULL;
    ColmapPoint *point = &model->point[model->n_points++];
    *point = (ColmapPoint){.first = model->n_tracks};
    return point;
}

int fs_colmap_model_add_observation(ColmapModel *model, ColmapObservation observation, FsError *err)
{
    if (fs_memory_grow(&model->observation, model->n_observations, sizeof *model->observation, err) < 0)
        return FS_ERR_MEMORY;
    model->observation[model->n_observations++] = observation;
    model->image[model->n_images - 1].n++;
    return 0;
}

int fs_colmap_model_add_track(ColmapModel *model, ColmapTrack track, FsError *err)
{
    if (fs_memory_grow(&model->track, model->n_tracks, sizeof *model->track, err) < 0) return FS_ERR_MEMORY;
    model->track[model->n_tracks++] = track;
    model->point[model->n_points - 1].n++;
    return 0;
}

const ColmapCamera *fs_colmap_model_camera(const ColmapModel *model, uint32_t id)
{
    for (int i = 0; i < model->n_cameras; i++)
        if (model->camera[i].id == id) return &model->camera[i];
    return NULL;
}

int fs_colmap_model_image(const ColmapModel *model, uint32_t id)
{
    for (int i = 0; i < model->n_images; i++)
        if (model->image[i].id == id) return i;
    return -1;
}

static bool has_files(const char *dir, const char *ext)
{
    return fs_file_exists(fs_file_at("%s/cameras.%s", dir, ext).text) &&
           fs_file_exists(fs_file_at("%s/images.%s", dir, ext).text);
}

char *fs_colmap_model_find(const char *dir)
{
    static const char *const places[] = {"", "/sparse/0", "/sparse", "/0", "/colmap/sparse/0"};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        char *place = fs_file_path("%s%s", dir, places[i]);
        if (place && (has_files(place, "bin") || has_files(place, "txt"))) return place;
        free(place);
    }
    return NULL;
}

static int check_unique(const char *dir, const ColmapModel *model, FsError *err)
{
    size_t n = (size_t)(model->n_images > model->n_cameras ? model->n_images : model->n_cameras);
    double *id = malloc((n + 1) * sizeof *id);
    if (!id) return fs_error_memory(err);
    int rc = 0;
    for (int pass = 0; pass < 2 && rc == 0; pass++) {
        int count = pass ? model->n_images : model->n_cameras;
        for (int i = 0; i < count; i++) id[i] = pass ? model->image[i].id : model->camera[i].id;
        fs_order_doubles(id, (size_t)count);
        for (int i = 1; i < count && rc == 0; i++)
            if (id[i] == id[i - 1])
                rc = fs_error_input(err, "%s: two %s have the number %.0f", dir, pass ? "images" : "cameras", id[i]);
    }
    free(id);
    return rc;
}

// What the readers do not see line by line: cameras exist, poses and points are finite.
static int check(const char *dir, const ColmapModel *model, FsError *err)
{
    if (model->n_cameras < 1 || model->n_images < 1)
        return fs_error_input(err, "%s: the COLMAP model has %d cameras and %d images, expected some of both", dir,
                              model->n_cameras, model->n_images);
    for (int i = 0; i < model->n_images; i++) {
        const ColmapImage *image = &model->image[i];
        double sum = 0, norm = 0;
        for (int k = 0; k < 4; k++) norm += image->quat[k] * image->quat[k];
        for (int k = 0; k < 3; k++) sum += image->t[k];
        if (!isfinite(sum) || !isfinite(norm) || norm < 1e-12)
            return fs_error_input(err, "%s: image '%s' has no finite pose", dir, image->name);
        if (!fs_colmap_model_camera(model, image->camera_id))
            return fs_error_input(err, "%s: image '%s' uses camera %u, which is not there", dir, image->name,
                                  image->camera_id);
    }
    for (int i = 0; i < model->n_points; i++) {
        const double *x = model->point[i].xyz;
        if (!isfinite(x[0] + x[1] + x[2]))
            return fs_error_input(err, "%s: point %lld is not finite", dir, (long long)model->point[i].id);
    }
    return check_unique(dir, model, err);
}

// Points may lack.
static int read_part(const char *dir, const ColmapFormat *format, ColmapPart part, ColmapModel *model, FsError *err)
{
    FilePath path = fs_file_at("%s/%s.%s", dir, parts[part], format->ext);
    char *data;
    size_t size;
    if (part == COLMAP_POINTS && !fs_file_exists(path.text)) return 0;
    MUST(fs_file_read(path.text, MAX_FILE, &data, &size, err));
    int rc = format->read(path.text, data, size, part, model, err);
    free(data);
    return rc;
}

int fs_colmap_model_read(const char *dir, ColmapModel *model, FsError *err)
{
    *model = (ColmapModel){0};
    char *place = fs_colmap_model_find(dir);
    if (!place)
        return fs_error_input(
            err, "%s: no COLMAP model here (expected cameras.bin and images.bin, or cameras.txt and images.txt)", dir);
    const ColmapFormat *format = has_files(place, "bin") ? &fs_colmap_binary : &fs_colmap_text;
    int rc = 0;
    for (int k = 0; k < COLMAP_PARTS; k++) TRY(read_part(place, format, (ColmapPart)k, model, err));
    TRY(check(place, model, err));
fail:
    if (rc < 0) fs_colmap_model_free(model);
    free(place);
    return rc;
}

int fs_colmap_model_write(const char *dir, const ColmapModel *model, bool binary, FsError *err)
{
    const ColmapFormat *format = binary ? &fs_colmap_binary : &fs_colmap_text;
    MUST(fs_file_mkdirs(dir, err));
    for (int k = 0; k < COLMAP_PARTS; k++) {
        AtomicFile file;
        MUST(fs_file_begin(&file, fs_file_at("%s/%s.%s", dir, parts[k], format->ext).text, err));
        format->write[k](file.f, model);
        MUST(fs_file_commit(&file, err));
    }
    return 0;
}
