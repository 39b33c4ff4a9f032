#include "poses/sparse.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/arena.h"
#include "base/file.h"
#include "model/cameras_file.h"

#define MOST_WIDENING 1.25 // of a photo without its distortion: what fisheye lenses see beyond has few pixels a degree
#define SLIVER 0.002       // of the side: less is not worth other focal lengths than the lens's

int fs_sparse_new(Sparse *sparse, const Capture *capture, FsError *err)
{
    *sparse = (Sparse){0};
    sparse->pose = calloc((size_t)capture->n + 1, sizeof *sparse->pose);
    return sparse->pose ? 0 : fs_error_memory(err);
}

void fs_sparse_free(Sparse *sparse)
{
    free(sparse->pose);
    free(sparse->point);
    free(sparse->sighting);
    *sparse = (Sparse){0};
}

// The lens at the size of the photo's picture; the model may be of larger or smaller photos of the same frame. image:
// the picture's name in it; NULL: none that COLMAP read.
static int set_pose(Pose *pose, const Photo *photo, const Lens *picture_lens, const double w2c[12], const char *image,
                    const char *file, FsError *err)
{
    ModelFrame frame = fs_model_frame(photo, picture_lens, image);
    const Lens whole = fs_model_frame_lens(&frame, picture_lens), *lens = &whole;
    double a = (double)lens->width / lens->height, b = (double)photo->picture_width / photo->picture_height;
    double slack =
        1.0 / lens->height + 1.0 / photo->picture_height + 1.0 / lens->width + 1.0 / photo->picture_width + 0.005;
    if (fabs(log(a / b)) > slack)
        return fs_error_input(err,
                              "%s: '%s' is %d x %d there, but the photo is %d x %d or a multiple of it; the model must "
                              "be of the same photos",
                              file, photo->name, lens->width, lens->height, photo->picture_width,
                              photo->picture_height);
    pose->known = true;
    pose->frame = frame;
    pose->lens = fs_lens_resized(lens, photo->picture_width, photo->picture_height);
    MUST(fs_lens_camera(&pose->lens, file, &pose->camera, err)); // the model may be one that cannot be used
    double times = fmax(fs_lens_widening(&pose->lens, MOST_WIDENING) - SLIVER, 1);
    pose->camera.fx /= times;
    pose->camera.fy /= times;
    memcpy(pose->camera.w2c, w2c, 12 * sizeof *w2c);
    fs_model_frame_pose(&frame, pose->camera.w2c);
    return 0;
}

// The observation of one track element, undistorted, at the size of the picture; false when it is of no use.
static bool sighting_of(const Sparse *sparse, const Capture *capture, const ColmapModel *model, const int *photo_of,
                        const ColmapTrack *track, Sighting *s)
{
    int i = fs_colmap_model_image(model, track->image_id);
    if (i < 0 || photo_of[i] < 0 || track->index >= (uint32_t)model->image[i].n) return false;
    const ColmapObservation *o = &model->observation[model->image[i].first + (int)track->index];
    const Lens *from = &fs_colmap_model_camera(model, model->image[i].camera_id)->lens;
    const Pose *pose = &sparse->pose[photo_of[i]];
    const Photo *photo = &capture->photo[photo_of[i]];
    const Camera *camera = &pose->camera;
    double pixel[2] = {o->x, o->y}, ray[2];
    fs_model_frame_pixel(&pose->frame, from, pixel);
    pixel[0] *= (double)photo->picture_width / pose->frame.width;
    pixel[1] *= (double)photo->picture_height / pose->frame.height;
    if (!isfinite(pixel[0] + pixel[1]) || !fs_lens_unproject(&pose->lens, pixel, ray)) return false;
    *s = (Sighting){photo_of[i], camera->fx * ray[0] + camera->cx, camera->fy * ray[1] + camera->cy};
    return true;
}

// photo_of: (model->n_images), -1: of no photo.
static int take_points(Sparse *sparse, const Capture *capture, const ColmapModel *model, const int *photo_of,
                       FsError *err)
{
    sparse->point = malloc(((size_t)model->n_points + 1) * sizeof *sparse->point);
    sparse->sighting = malloc(((size_t)model->n_tracks + 1) * sizeof *sparse->sighting);
    if (!sparse->point || !sparse->sighting) return fs_error_memory(err);
    for (int i = 0; i < model->n_points; i++) {
        const ColmapPoint *from = &model->point[i];
        SparsePoint p = {.error = from->error, .first = sparse->n_sightings};
        memcpy(p.xyz, from->xyz, sizeof p.xyz);
        memcpy(p.rgb, from->rgb, sizeof p.rgb);
        for (int k = 0; k < from->n; k++) {
            Sighting s;
            if (!sighting_of(sparse, capture, model, photo_of, &model->track[from->first + k], &s)) continue;
            bool twice = false;
            for (int l = 0; l < p.n; l++) twice |= sparse->sighting[p.first + l].photo == s.photo;
            if (!twice) sparse->sighting[p.first + p.n++] = s;
        }
        if (p.n < 2) continue;
        sparse->n_sightings += p.n;
        sparse->point[sparse->n_points++] = p;
    }
    return 0;
}

int fs_sparse_from_colmap(Sparse *sparse, const Capture *capture, const ColmapModel *model, FsError *err)
{
    for (int i = 0; i < model->n_images; i++) {
        const ColmapImage *image = &model->image[i];
        const Lens *lens = &fs_colmap_model_camera(model, image->camera_id)->lens;
        double w2c[12];
        char *stem = fs_file_stem(image->name);
        int at = stem ? fs_capture_find(capture, stem) : -1;
        free(stem);
        if (at < 0) continue;
        fs_camera_pose_from_quat(image->quat, image->t, w2c);
        MUST(set_pose(&sparse->pose[at], &capture->photo[at], lens, w2c, NULL, "COLMAP's model", err));
    }
    return 0;
}

// The view whose name is the photo's but for the case of letters: where no other photo or view is left that it may be.
static int find_in_any_case(const Dataset *views, const Capture *capture, const int *view_of, const bool *taken, int i)
{
    int found = -1, n = 0;
    for (int k = 0; k < views->n; k++)
        if (!taken[k] && strcasecmp(views->view[k].name, capture->photo[i].name) == 0) found = k, n++;
    for (int k = 0; k < capture->n && n == 1; k++)
        if (k != i && view_of[k] < 0 && strcasecmp(capture->photo[k].name, capture->photo[i].name) == 0) n++;
    return n == 1 ? found : -1;
}

// A photo that has its folder's name before its own, as copies of it lay in other folders: by its own where no other
// photo or view is left that it may be.
static int find_by_file(const Dataset *views, const Capture *capture, const int *view_of, const bool *taken, int i)
{
    char *stem = fs_file_stem(capture->photo[i].file);
    int at = stem ? fs_dataset_find(views, stem) : -1;
    for (int k = 0; k < capture->n && at >= 0; k++) {
        char *other = k != i && view_of[k] < 0 ? fs_file_stem(capture->photo[k].file) : NULL;
        if (other && strcmp(other, stem) == 0) at = -1;
        free(other);
    }
    free(stem);
    return at >= 0 && !taken[at] ? at : -1;
}

// view_of: (capture->n), -1: the photo has none.
static int match_names(const Dataset *views, const Capture *capture, int *view_of, FsError *err)
{
    bool *taken = calloc((size_t)views->n + 1, sizeof *taken);
    if (!taken) return fs_error_memory(err);
    for (int i = 0; i < capture->n; i++) {
        view_of[i] = fs_dataset_find(views, capture->photo[i].name);
        if (view_of[i] >= 0) taken[view_of[i]] = true;
    }
    for (int i = 0; i < capture->n; i++)
        if (view_of[i] < 0) view_of[i] = find_in_any_case(views, capture, view_of, taken, i);
    for (int i = 0; i < capture->n; i++)
        if (view_of[i] >= 0) taken[view_of[i]] = true;
    for (int i = 0; i < capture->n; i++) {
        if (view_of[i] < 0) view_of[i] = find_by_file(views, capture, view_of, taken, i);
        if (view_of[i] >= 0) taken[view_of[i]] = true;
    }
    free(taken);
    return 0;
}

int fs_sparse_from_file(Sparse *sparse, const Capture *capture, const char *path, FsError *err)
{
    int rc = 0;
    CamerasFile file;
    int *view_of = malloc(((size_t)capture->n + 1) * sizeof *view_of), *photo_of = NULL;
    if (!view_of) return fs_error_memory(err);
    TRY(fs_cameras_file_read(path, &file, err));
    TRY(match_names(&file.views, capture, view_of, err));
    photo_of = malloc(((size_t)file.model.n_images + 1) * sizeof *photo_of);
    if (!photo_of) TRY(fs_error_memory(err));
    for (int k = 0; k < file.model.n_images; k++) photo_of[k] = -1;
    for (int i = 0; i < capture->n; i++) {
        int at = view_of[i];
        if (at < 0) continue;
        const ColmapImage *image = file.model.n_images > 0 ? &file.model.image[file.image[at]] : NULL;
        TRY(set_pose(&sparse->pose[i], &capture->photo[i], &file.lens[at], file.views.view[at].camera.w2c,
                     image ? image->name : NULL, path, err));
        if (image) photo_of[file.image[at]] = i;
    }
    if (file.model.n_images > 0) TRY(take_points(sparse, capture, &file.model, photo_of, err));
fail:
    free(view_of);
    free(photo_of);
    fs_cameras_file_free(&file);
    return rc;
}

// Where an ideal pinhole camera would have seen the features. One that cannot be undone is moved out of all lines.
static float *undistorted(const Lens *lens, const Camera *camera, const Features *f, Arena *arena)
{
    bool pinhole = fs_lens_is_pinhole(lens);
    float *xy = ARENA_NEW(arena, float, 2 * ((size_t)f->n + 1));
    for (int i = 0; i < f->n && xy; i++) {
        double ray[2], pixel[2] = {f->xy[2 * i], f->xy[2 * i + 1]};
        bool ok = pinhole || fs_lens_unproject(lens, pixel, ray);
        xy[2 * i] = pinhole ? f->xy[2 * i] : ok ? (float)(camera->fx * ray[0] + camera->cx) : -1e6f;
        xy[2 * i + 1] = pinhole ? f->xy[2 * i + 1] : ok ? (float)(camera->fy * ray[1] + camera->cy) : -1e6f;
    }
    return xy;
}

int fs_sparse_colour(Sparse *sparse, const Capture *capture, FsError *err)
{
    int rc = 0;
    double(*sum)[4] = calloc((size_t)sparse->n_points + 1, sizeof *sum);
    if (!sum) return fs_error_memory(err);
    for (int i = 0; i < capture->n; i++) {
        if (!sparse->pose[i].known) continue;
        Image picture = {0};
        TRY(fs_png_read(fs_file_at("%s/%s", capture->pictures, capture->photo[i].picture).text, &picture, err));
        for (int k = 0; k < sparse->n_points; k++)
            for (int l = 0; l < sparse->point[k].n; l++) {
                const Sighting *s = &sparse->sighting[sparse->point[k].first + l];
                if (s->photo != i || !(s->x >= 0 && s->y >= 0 && s->x < picture.width && s->y < picture.height))
                    continue;
                const float *px = fs_image_at(&picture, (int)s->x, (int)s->y);
                for (int c = 0; c < 3; c++) sum[k][c] += px[picture.channels >= 3 ? c : 0];
                sum[k][3]++;
            }
        fs_image_free(&picture);
    }
    for (int k = 0; k < sparse->n_points; k++)
        for (int c = 0; c < 3; c++)
            sparse->point[k].rgb[c] = (unsigned char)lround(255 * sum[k][c] / fmax(sum[k][3], 1));
fail:
    free(sum);
    return rc;
}

static int take_triangulated(Sparse *sparse, const PointSet *set, const int *photo_of, const Features *features,
                             FsError *err)
{
    free(sparse->point);
    free(sparse->sighting);
    sparse->n_points = sparse->n_sightings = 0;
    sparse->point = malloc(((size_t)set->n + 1) * sizeof *sparse->point);
    sparse->sighting = malloc(((size_t)set->n_seen + 1) * sizeof *sparse->sighting);
    if (!sparse->point || !sparse->sighting) return fs_error_memory(err);
    for (int k = 0; k < set->n; k++) {
        const Point *from = &set->point[k];
        SparsePoint p = {.error = from->error, .first = from->first, .n = from->n};
        memcpy(p.xyz, from->xyz, sizeof p.xyz);
        sparse->point[k] = p;
    }
    for (int k = 0; k < set->n_seen; k++) {
        const float *xy = features[set->seen[k].photo].xy + 2 * set->seen[k].feature;
        sparse->sighting[k] = (Sighting){photo_of[set->seen[k].photo], xy[0], xy[1]};
    }
    sparse->n_points = set->n;
    sparse->n_sightings = set->n_seen;
    return 0;
}

int fs_sparse_triangulate(Sparse *sparse, const FsProject *project, const Capture *capture, const Features *features,
                          FsError *err)
{
    int rc = 0, n = 0;
    PointSet set = {0};
    Threads *threads = fs_threads_new(project->set.threads);
    Arena arena = {0};
    Camera *camera = ARENA_NEW(&arena, Camera, (size_t)capture->n + 1);
    Features *posed = ARENA_NEW(&arena, Features, (size_t)capture->n + 1); // borrowed, but for the places
    int *photo_of = ARENA_NEW(&arena, int, (size_t)capture->n + 1);
    if (!threads || arena.failed) TRY(fs_error_memory(err));
    for (int i = 0; i < capture->n; i++) {
        if (!sparse->pose[i].known) continue;
        camera[n] = sparse->pose[i].camera;
        photo_of[n] = i;
        posed[n] = features[i];
        posed[n].xy = undistorted(&sparse->pose[i].lens, &camera[n], &features[i], &arena);
        if (!posed[n++].xy) TRY(fs_error_memory(err));
    }
    TRY(fs_triangulate(&(PosedFeatures){posed, camera, n}, &fs_triangulate_defaults, threads, &project->log, &set,
                       err));
    TRY(take_triangulated(sparse, &set, photo_of, posed, err));
fail:
    fs_triangulate_free(&set);
    fs_threads_free(threads);
    fs_arena_free(&arena);
    return rc;
}
