#include "poses/sparse.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"

// COLMAP solves problems of up to 50000 residuals, two an observation, with one thread and so always the same way: of
// larger ones each run has other bits. That bounds time and memory, too: a quarter of a minute, 100 MB.
enum { MAX_OBSERVATIONS = 24500, MIN_PER_PHOTO = 200, MOST_PHOTOS = MAX_OBSERVATIONS / MIN_PER_PHOTO };
// More than MOST_PHOTOS share them, and so have fewer each. Off by 12 mm on a made way, cameras came to where they were
// to 0.5 mm with 200 and with 80 observations each (280 photos), to 0.8 mm with 40 (550 photos).
enum { MIN_OF_MANY = 40 };

// Shortest track that takes part so that the observations fit.
static int shortest_track(const Sparse *sparse)
{
    for (int least = 3;; least++) {
        int sum = 0;
        for (int k = 0; k < sparse->n_points; k++) sum += sparse->point[k].n >= least ? sparse->point[k].n : 0;
        if (sum <= MAX_OBSERVATIONS) return least;
    }
}

static int compare_tracks(const void *a, const void *b)
{
    const SparsePoint *p = a, *q = b; // first: no two have the same
    if (p->n != q->n) return p->n > q->n ? -1 : 1;
    return p->error != q->error ? (p->error < q->error ? -1 : 1) : (p->first > q->first) - (p->first < q->first);
}

// Of points, those with the longest tracks first, what gives every photo so many observations: to the front.
// has: (photos). Returns how many observations these are.
static int choose(const Sparse *sparse, int per_photo, int n_photos, SparsePoint *point, int *has, int *n)
{
    int total = 0;
    *n = 0;
    memset(has, 0, (size_t)n_photos * sizeof *has);
    for (int k = 0; k < sparse->n_points; k++) {
        const Sighting *seen = sparse->sighting + sparse->point[k].first;
        bool wanted = false;
        for (int l = 0; l < sparse->point[k].n; l++) wanted |= has[seen[l].photo] < per_photo;
        if (!wanted) continue;
        for (int l = 0; l < sparse->point[k].n; l++) has[seen[l].photo]++;
        total += sparse->point[k].n;
        point[(*n)++] = sparse->point[k];
    }
    return total;
}

// As many for each photo as fit.
static int share_out(const Sparse *sparse, const Capture *capture, int posed, ColmapModel *model, FsError *err)
{
    size_t size = (size_t)sparse->n_points * sizeof *sparse->point;
    int rc = 0, *has = calloc((size_t)capture->n + 1, sizeof *has);
    Sparse sorted = *sparse, some = *sparse;
    some.n_points = 0;
    sorted.point = malloc(size + 1);
    some.point = malloc(size + 1);
    if (!has || !sorted.point || !some.point) TRY(fs_error_memory(err));
    if (size) memcpy(sorted.point, sparse->point, size);
    qsort(sorted.point, (size_t)sparse->n_points, sizeof *sorted.point, compare_tracks);
    for (int each = MAX_OBSERVATIONS / posed; each > 0; each--)
        if (choose(&sorted, each, capture->n, some.point, has, &some.n_points) <= MAX_OBSERVATIONS) break;
    TRY(fs_sparse_to_colmap(&some, capture, 0, true, model, err));
fail:
    free(has);
    free(sorted.point);
    free(some.point);
    return rc;
}

// Every photo takes part with enough observations; else the adjustment could do harm.
static bool worth_it(const ColmapModel *model, const Log *log)
{
    int few = 0, fewest = 0, least = model->n_images > MOST_PHOTOS ? MIN_OF_MANY : MIN_PER_PHOTO;
    for (int i = 0; i < model->n_images; i++) {
        few += model->image[i].n < least;
        if (model->image[i].n < model->image[fewest].n) fewest = i;
    }
    const char *name = few ? model->image[fewest].name : "", *dot = strrchr(name, '.');
    if (few)
        fs_log_info(log,
                    "poses: not refined: %d of %d photos have less than %d points to hold them (%.*s: %d), which could "
                    "do harm",
                    few, model->n_images, least, (int)(dot ? (size_t)(dot - name) : strlen(name)), name,
                    model->image[fewest].n);
    return !few && model->n_images > 1;
}

// All of them, or none where one cannot be used.
static int take_poses(Sparse *sparse, const Capture *capture, const ColmapModel *adjusted, FsError *err)
{
    size_t size = ((size_t)capture->n + 1) * sizeof *sparse->pose;
    Sparse taken = {.pose = malloc(size)};
    if (!taken.pose) return fs_error_memory(err);
    memcpy(taken.pose, sparse->pose, size);
    int rc = fs_sparse_from_colmap(&taken, capture, adjusted, err);
    if (rc == 0) memcpy(sparse->pose, taken.pose, size);
    fs_sparse_free(&taken);
    return rc;
}

int fs_adjust_poses(Colmap *colmap, Sparse *sparse, FsError *err)
{
    int rc = 0, posed = 0;
    ColmapModel model = {0}, adjusted = {0};
    FsError inner = {0};
    FilePath from = fs_file_at("%s/before-adjustment", colmap->dir), to = fs_file_at("%s/adjusted", colmap->dir);
    for (int i = 0; i < colmap->capture->n; i++) posed += sparse->pose[i].known;
    if (posed > MOST_PHOTOS)
        TRY(share_out(sparse, colmap->capture, posed, &model, err));
    else
        TRY(fs_sparse_to_colmap(sparse, colmap->capture, shortest_track(sparse), true, &model, err));
    if (!worth_it(&model, &colmap->project->log)) goto fail;
    TRY(fs_colmap_model_write(from.text, &model, true, err));
    rc = fs_colmap_adjust(colmap, from.text, to.text, &inner);
    if (rc == 0) rc = fs_colmap_model_read(to.text, &adjusted, &inner);
    if (rc == 0 && adjusted.n_images == model.n_images) rc = take_poses(sparse, colmap->capture, &adjusted, &inner);
    if (rc == FS_ERR_INPUT) // the poses found before are good enough to go on
        fs_log_warn(&colmap->project->log, "poses: not refined: %s", inner.message), rc = 0;
    else if (rc < 0 && err)
        *err = inner;
fail:
    fs_colmap_model_free(&model);
    fs_colmap_model_free(&adjusted);
    return rc;
}
