#include "render/view_list.h"

#include <math.h>
#include <stdlib.h>

#include "base/linalg.h"
#include "base/order.h"
#include "model/similarity.h"

#define MIN_COMMON 3
#define SAME_FRAME 0.02 // distance of a camera from its other pose, in extents of the capture: no need to move
#define GOOD_FIT 0.05   // the same after a similarity: believe it
#define SAME_TURN 0.02  // radians

// The views that both have.
typedef struct Common {
    Camera *view, *photo;
    int n;
} Common;

static int find_common(const Dataset *views, const Dataset *photos, Common *common, FsError *err)
{
    common->view = malloc(((size_t)views->n * 2 + 1) * sizeof(Camera));
    if (!common->view) return fs_error_memory(err);
    common->photo = common->view + views->n;
    for (int i = 0; i < views->n; i++) {
        int p = fs_dataset_find(photos, views->view[i].name);
        if (p < 0) continue;
        common->view[common->n] = views->view[i].camera;
        common->photo[common->n++] = photos->view[p].camera;
    }
    return 0;
}

// Angle between two cameras' orientations.
static double turn(const Camera *a, const Camera *b)
{
    double trace = 0;
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < 3; k++) trace += a->w2c[4 * r + k] * b->w2c[4 * r + k];
    return acos(fmax(-1, fmin(1, (trace - 1) / 2)));
}

// Medians over the common views, the model's moved first where there is a similarity.
static int disagreement(const Common *common, const Similarity *move, double *shift, double *angle, FsError *err)
{
    double *shifts = malloc(sizeof *shifts * 2 * (size_t)common->n), *angles = shifts + common->n;
    if (!shifts) return fs_error_memory(err);
    for (int i = 0; i < common->n; i++) {
        Camera camera = move ? fs_similarity_camera(move, &common->view[i]) : common->view[i];
        double a[3], b[3];
        fs_camera_centre(&camera, a);
        fs_camera_centre(&common->photo[i], b);
        shifts[i] = sqrt(v3_distance2(a, b));
        angles[i] = turn(&camera, &common->photo[i]);
    }
    *shift = fs_order_median(shifts, (size_t)common->n);
    *angle = fs_order_median(angles, (size_t)common->n);
    free(shifts);
    return 0;
}

// In the photos' own place they would be taken for the photos' renders.
static int disagree(const Common *common, const char *file, bool own_place, const Log *log, FsError *err)
{
    const char *what = "disagree with those in views.json, and no change of frame brings them together";
    if (own_place)
        return fs_error_input(err,
                              "%s: its poses of %d photos %s: give another folder for their renders, with -o DIR, or "
                              "the views other names",
                              file, common->n, what);
    fs_log_warn(log, "%s: its poses of %d photos %s; rendered as they are", file, common->n, what);
    return 0;
}

int fs_frame_align(Dataset *views, const Dataset *photos, const char *file, bool own_place, const Log *log,
                   FsError *err)
{
    Common common = {0};
    Similarity move;
    double shift, angle, centre[3], extent = fs_dataset_extent(photos, centre);
    int rc;
    TRY(find_common(views, photos, &common, err));
    if (common.n < MIN_COMMON)
        fs_log_debug(log, "%s: %d views in common with the photos, taken to be in their frame", file, common.n);
    if (common.n == 0) goto fail;
    TRY(disagreement(&common, NULL, &shift, &angle, err));
    if (shift <= SAME_FRAME * extent && angle <= SAME_TURN) goto fail;
    bool fits =
        common.n >= MIN_COMMON && fs_similarity_fit_cameras(common.view, common.photo, common.n, &move, NULL) == 0;
    if (fits) TRY(disagreement(&common, &move, &shift, &angle, err));
    if (!fits || shift > GOOD_FIT * extent || angle > 2 * SAME_TURN) {
        rc = disagree(&common, file, own_place, log, err);
        goto fail;
    }
    for (int i = 0; i < views->n; i++) views->view[i].camera = fs_similarity_camera(&move, &views->view[i].camera);
    fs_log_info(log, "%s: moved into the frame of the photos by %d views in common (scale %.4g, left over %.2g)", file,
                common.n, move.scale, shift);
fail:
    free(common.view);
    return rc;
}
