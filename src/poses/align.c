#include "poses/sparse.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/arena.h"
#include "base/file.h"
#include "model/similarity.h"
#include "poses/match.h"

typedef struct Described { // a point with the descriptor of its first observation
    const ColmapPoint *point;
    const int16_t *descriptor;
} Described;

// COLMAP's model keeps all features of a photo in their order, so an observation's index is the feature's.
static int describe(const Capture *capture, const Features *features, const ColmapModel *model, Described *out)
{
    int n = 0;
    for (int k = 0; k < model->n_points; k++) {
        const ColmapPoint *p = &model->point[k];
        for (int l = 0; l < p->n; l++) {
            const ColmapTrack *t = &model->track[p->first + l];
            int i = fs_colmap_model_image(model, t->image_id);
            char *stem = i >= 0 ? fs_file_stem(model->image[i].name) : NULL;
            int photo = stem ? fs_capture_find(capture, stem) : -1;
            free(stem);
            if (photo < 0 || t->index >= (uint32_t)features[photo].n) continue;
            out[n++] = (Described){p, features[photo].descriptor + (size_t)t->index * FS_DESCRIPTOR};
            break;
        }
    }
    return n;
}

// Most alike in b, when it is clearly more alike than the second.
static int nearest(const Described *a, const Described *b, int nb)
{
    MatchBest best = {-1, 0, 0};
    for (int j = 0; j < nb; j++) fs_match_keep(&best, j, fs_match_dot(a->descriptor, b[j].descriptor));
    bool clear = fs_match_distance(best.first) < 0.9f * fs_match_distance(best.second);
    return clear ? best.at : -1;
}

// Root mean square distance of the cameras from their mean, to measure agreement with.
static double spread(const ColmapModel *model)
{
    double mean[3] = {0}, sum = 0;
    for (int k = 0; k < model->n_images; k++) {
        Camera camera;
        double c[3];
        fs_camera_pose_from_quat(model->image[k].quat, model->image[k].t, camera.w2c);
        fs_camera_centre(&camera, c);
        for (int i = 0; i < 3; i++) {
            mean[i] += c[i] / model->n_images;
            sum += c[i] * c[i] / model->n_images;
        }
    }
    return sqrt(fmax(sum - mean[0] * mean[0] - mean[1] * mean[1] - mean[2] * mean[2], 0));
}

static void move(ColmapModel *model, const Similarity *s)
{
    for (int k = 0; k < model->n_points; k++) fs_similarity_apply(s, model->point[k].xyz, model->point[k].xyz);
    for (int k = 0; k < model->n_images; k++) {
        ColmapImage *image = &model->image[k];
        Camera camera = {.width = 1, .height = 1, .fx = 1, .fy = 1};
        fs_camera_pose_from_quat(image->quat, image->t, camera.w2c);
        camera = fs_similarity_camera(s, &camera);
        fs_camera_pose_to_quat(camera.w2c, image->quat, image->t);
    }
}

int fs_align_groups(const Capture *capture, const Features *features, const ColmapModel *fixed, ColmapModel *moving,
                    const Log *log, FsError *err)
{
    int rc = 0, n = 0, inliers = 0;
    FsError inner = {0};
    Similarity s;
    if (fixed->n_images == 0 || moving->n_images == 0)
        return fs_error_input(err, "no %s photo could be posed on its own; use --align joint",
                              fixed->n_images ? "flash" : "no-flash");
    Arena arena = {0};
    size_t size = (size_t)moving->n_points + 1;
    Described *a = ARENA_NEW(&arena, Described, size), *b = ARENA_NEW(&arena, Described, (size_t)fixed->n_points + 1);
    double(*from)[3] = fs_arena_alloc(&arena, size * sizeof *from);
    double(*to)[3] = fs_arena_alloc(&arena, size * sizeof *to);
    if (arena.failed) TRY(fs_error_memory(err));
    int na = describe(capture, features, moving, a), nb = describe(capture, features, fixed, b);
    for (int i = 0; i < na; i++) {
        int j = nearest(&a[i], b, nb);
        if (j < 0 || nearest(&b[j], a, na) != i) continue;
        memcpy(from[n], a[i].point->xyz, sizeof *from);
        memcpy(to[n++], b[j].point->xyz, sizeof *to);
    }
    rc = fs_similarity_fit_robust((const double(*)[3])from, (const double(*)[3])to, n, 0.1 * spread(fixed), &s,
                                  &inliers, &inner);
    if (rc < 0 || inliers < 12)
        TRY(fs_error_set(
            err, rc == FS_ERR_MEMORY ? rc : FS_ERR_INPUT,
            "the flash and the no-flash photos, posed apart, cannot be aligned: %d of %d common points agree; use "
            "--align joint",
            inliers, n));
    fs_log_info(log, "poses: flash photos aligned to the others by %d of %d common points, scale %.4f", inliers, n,
                s.scale);
    move(moving, &s);
fail:
    fs_arena_free(&arena);
    return rc;
}
