// Densification of the paper's code: 3DGS's clone and split where the screen-space gradient is large, pruning of the
// transparent, "proximity unpooling" of FSGS (Zhu et al. 2024) while few, opacity reset.
#include <stdlib.h>

#include "base/knn.h"
#include "model/camera.h"
#include "train/cloud_edit.h"
#include "train/train_constants.h"

static float largest_scale(const Cloud *cloud, int i)
{
    const float *s = cloud->field[CLOUD_SCALES] + 3 * i;
    return expf(fmaxf(s[0], fmaxf(s[1], s[2])));
}

// Two samples inside the Gaussian, a factor 1.6 smaller; one takes its place, the other is new.
static void split(Edit *edit, int i, int fresh, Rng *rng)
{
    Cloud *cloud = edit->cloud;
    fs_cloud_edit_copy(edit, fresh, i);
    const float *q = cloud->field[CLOUD_QUATS] + 4 * i;
    double quat[4] = {q[0], q[1], q[2], q[3]}, r[9];
    fs_camera_quat_to_rotation(quat, r);
    float centre[3], scale[3];
    for (int k = 0; k < 3; k++) {
        centre[k] = cloud->field[CLOUD_MEANS][3 * i + k];
        scale[k] = cloud->field[CLOUD_SCALES][3 * i + k];
    }
    int target[2] = {i, fresh};
    for (int t = 0; t < 2; t++) {
        float local[3];
        for (int k = 0; k < 3; k++) local[k] = expf(scale[k]) * fs_rng_normal(rng);
        for (int k = 0; k < 3; k++) {
            cloud->field[CLOUD_MEANS][3 * target[t] + k] = centre[k] + (float)r[3 * k] * local[0] +
                                                           (float)r[3 * k + 1] * local[1] +
                                                           (float)r[3 * k + 2] * local[2];
            cloud->field[CLOUD_SCALES][3 * target[t] + k] = scale[k] - logf(FSGS_SPLIT_SHRINK);
        }
    }
}

static int clone_and_split(Edit *edit, const FsgsArgs *args, Rng *rng, FsError *err)
{
    int n = edit->cloud->n, room = args->max_splats - n, rc = 0;
    for (int i = 0; i < n && room > 0; i++) {
        if (args->screen[i] < FSGS_GRADIENT) continue;
        TRY(fs_cloud_edit_append(edit, 1, err));
        room--;
        if (largest_scale(edit->cloud, i) <= FSGS_DENSE * (float)args->extent)
            fs_cloud_edit_copy(edit, edit->cloud->n - 1, i);
        else
            split(edit, i, edit->cloud->n - 1, rng);
    }
fail:
    return rc;
}

// New Gaussians halfway to the nearest neighbours where these are far and the Gaussian large.
static int unpool(Edit *edit, const FsgsArgs *args, FsError *err)
{
    Cloud *cloud = edit->cloud;
    int n = cloud->n, rc = 0, room = args->max_splats - n;
    if (n <= FSGS_NEIGHBOURS) return 0;
    int *index = malloc(sizeof(int) * FSGS_NEIGHBOURS * (size_t)n);
    float *dist2 = malloc(sizeof(float) * FSGS_NEIGHBOURS * (size_t)n);
    if (!index || !dist2) TRY(fs_error_memory(err));
    rc = fs_knn(cloud->field[CLOUD_MEANS], n, FSGS_NEIGHBOURS, index, dist2, args->threads);
    if (rc < 0) TRY(fs_error_set(err, rc, "a position is not finite, or memory is out"));
    float size_min = FSGS_DENSE * (float)args->extent;
    for (int i = 0; i < n && room >= FSGS_NEIGHBOURS; i++) {
        float mean = 0;
        for (int k = 0; k < FSGS_NEIGHBOURS; k++) mean += sqrtf(dist2[i * FSGS_NEIGHBOURS + k]) / FSGS_NEIGHBOURS;
        if (mean < 5 * size_min || largest_scale(cloud, i) < size_min) continue;
        for (int k = 0; k < FSGS_NEIGHBOURS; k++, room--) {
            int j = index[i * FSGS_NEIGHBOURS + k], fresh = cloud->n;
            TRY(fs_cloud_edit_append(edit, 1, err));
            fs_cloud_edit_copy(edit, fresh, j);
            for (int a = 0; a < 3; a++)
                cloud->field[CLOUD_MEANS][3 * fresh + a] =
                    0.5f * (cloud->field[CLOUD_MEANS][3 * i + a] + cloud->field[CLOUD_MEANS][3 * j + a]);
        }
    }
fail:
    free(index);
    free(dist2);
    return rc;
}

static int prune(Edit *edit, FsError *err)
{
    const Cloud *cloud = edit->cloud;
    unsigned char *keep = calloc((size_t)cloud->n + 1, 1);
    if (!keep) return fs_error_memory(err);
    int kept = 0;
    for (int i = 0; i < cloud->n; i++)
        kept += keep[i] = fs_cloud_edit_sigmoid(cloud->field[CLOUD_OPACITIES][i]) >= FSGS_OPACITY_MIN;
    if (kept) fs_cloud_edit_compact(edit, keep);
    free(keep);
    return kept ? 0 : fs_error_set(err, FS_ERR_NUMERIC, "all its Gaussians are transparent");
}

static void reset_opacity(Edit *edit)
{
    float most = fs_cloud_edit_logit(FSGS_RESET_OPACITY), *opacity = edit->cloud->field[CLOUD_OPACITIES];
    for (int i = 0; i < edit->cloud->n; i++)
        if (opacity[i] > most) opacity[i] = most;
    edit->forget |= 1u << CLOUD_OPACITIES;
}

int fs_fsgs_densify(Edit *edit, const FsgsArgs *args, Rng *rng, FsError *err)
{
    int rc;
    TRY(clone_and_split(edit, args, rng, err));
    if (args->step < FSGS_UNPOOL_UNTIL) TRY(unpool(edit, args, err));
    TRY(prune(edit, err));
    if (args->step >= FSGS_RESET_FROM && args->step % FSGS_RESET_EVERY == 0) reset_opacity(edit);
fail:
    return rc;
}
