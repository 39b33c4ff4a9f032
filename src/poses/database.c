#include "poses/database.h"

#include <math.h>
#include <sqlite3.h>
#include <stdlib.h>
#include <string.h>

#define MAX_FEATURES 1000000
#define MAX_IMAGE_ID 2147483647LL // COLMAP's pair number is id1 * this + id2

struct Database {
    sqlite3 *db;
    char *path;
};

static int fail(Database *d, FsError *err)
{
    if (!d->db || sqlite3_errcode(d->db) == SQLITE_NOMEM) return fs_error_memory(err);
    return fs_error_set(err, FS_ERR_IO, "%s: %s", d->path, sqlite3_errmsg(d->db));
}

int fs_database_open(Database **database, const char *path, FsError *err)
{
    int rc = 0;
    Database *d = calloc(1, sizeof *d);
    if (!d || !(d->path = strdup(path))) TRY(fs_error_memory(err));
    if (sqlite3_open_v2(path, &d->db, SQLITE_OPEN_READWRITE, NULL) != SQLITE_OK) TRY(fail(d, err));
    sqlite3_busy_timeout(d->db, 10000);
fail:
    if (rc < 0) fs_database_close(d);
    *database = rc < 0 ? NULL : d;
    return rc;
}

void fs_database_close(Database *d)
{
    if (!d) return;
    sqlite3_close_v2(d->db);
    free(d->path);
    free(d);
}

static int prepare(Database *d, const char *sql, sqlite3_stmt **statement, FsError *err)
{
    return sqlite3_prepare_v2(d->db, sql, -1, statement, NULL) == SQLITE_OK ? 0 : fail(d, err);
}

static int finish(Database *d, sqlite3_stmt *statement, FsError *err)
{
    int rc = sqlite3_step(statement) == SQLITE_DONE ? 0 : fail(d, err);
    sqlite3_finalize(statement);
    return rc;
}

// Whether there is a row; 0: none.
static int read_row(Database *d, sqlite3_stmt *statement, FsError *err)
{
    int step = sqlite3_step(statement);
    return step == SQLITE_ROW ? 1 : step == SQLITE_DONE ? 0 : fail(d, err);
}

static int execute(Database *d, const char *sql, FsError *err)
{
    return sqlite3_exec(d->db, sql, NULL, NULL, NULL) == SQLITE_OK ? 0 : fail(d, err);
}

int fs_database_begin(Database *d, FsError *err)
{
    return execute(d, "BEGIN", err);
}

int fs_database_end(Database *d, FsError *err)
{
    return execute(d, "COMMIT", err);
}

int fs_database_has_frames(Database *d, FsError *err)
{
    sqlite3_stmt *s;
    MUST(prepare(d, "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = 'frames'", &s, err));
    int found = read_row(d, s, err);
    sqlite3_finalize(s);
    return found;
}

int fs_database_add_camera(Database *d, int id, const Lens *lens, bool focal_known, FsError *err)
{
    sqlite3_stmt *s;
    int n_params;
    fs_lens_model_name(lens->model, &n_params);
    MUST(prepare(
        d, "INSERT INTO cameras(camera_id, model, width, height, params, prior_focal_length) VALUES(?, ?, ?, ?, ?, ?)",
        &s, err));
    sqlite3_bind_int(s, 1, id);
    sqlite3_bind_int(s, 2, lens->model);
    sqlite3_bind_int(s, 3, lens->width);
    sqlite3_bind_int(s, 4, lens->height);
    sqlite3_bind_blob(s, 5, lens->param, n_params * (int)sizeof *lens->param, SQLITE_STATIC);
    sqlite3_bind_int(s, 6, focal_known);
    return finish(d, s, err);
}

int fs_database_add_image(Database *d, int id, const char *name, int camera_id, FsError *err)
{
    sqlite3_stmt *s;
    MUST(prepare(d, "INSERT INTO images(image_id, name, camera_id) VALUES(?, ?, ?)", &s, err));
    sqlite3_bind_int(s, 1, id);
    sqlite3_bind_text(s, 2, name, -1, SQLITE_STATIC);
    sqlite3_bind_int(s, 3, camera_id);
    return finish(d, s, err);
}

// The number of at least `least` in the only column of the row, 0 where there is no row; a failure's code.
static int read_number(Database *d, sqlite3_stmt *statement, int least, FsError *err)
{
    int found = read_row(d, statement, err), n = found == 1 ? sqlite3_column_int(statement, 0) : found;
    sqlite3_finalize(statement);
    return found == 1 && n < least ? fs_error_input(err, "%s: not what COLMAP writes", d->path) : n;
}

int fs_database_image(Database *d, const char *name, FsError *err)
{
    sqlite3_stmt *s;
    MUST(prepare(d, "SELECT image_id FROM images WHERE name = ?", &s, err));
    sqlite3_bind_text(s, 1, name, -1, SQLITE_STATIC);
    return read_number(d, s, 1, err);
}

void fs_database_features_free(Features *f)
{
    free(f->xy);
    free(f->scale);
    free(f->angle);
    free(f->descriptor);
    *f = (Features){0};
}

// One row of "keypoints" or "descriptors": its blob, checked against its counts. NULL blob: no row or no features.
typedef struct Blob {
    sqlite3_stmt *statement; // holds data
    int rows, cols;
    const void *data;
} Blob;

static int read_blob(Database *d, const char *sql, int image_id, int element, Blob *b, FsError *err)
{
    MUST(prepare(d, sql, &b->statement, err));
    sqlite3_bind_int(b->statement, 1, image_id);
    int found = read_row(d, b->statement, err);
    if (found != 1) return found;
    b->rows = sqlite3_column_int(b->statement, 0);
    b->cols = sqlite3_column_int(b->statement, 1);
    int64_t size = sqlite3_column_bytes(b->statement, 2);
    if (b->rows < 0 || b->rows > MAX_FEATURES || b->cols < 1 || b->cols > 1024 ||
        size != (int64_t)b->rows * b->cols * element)
        return fs_error_input(err, "%s: features of photo %d are not what COLMAP writes", d->path, image_id);
    b->data = b->rows ? sqlite3_column_blob(b->statement, 2) : NULL;
    if (b->rows && !b->data) return fail(d, err);
    return 0;
}

// False where COLMAP's rows are not what it writes: x y, then scale and angle or an affine shape, all finite.
static bool take_keypoint(const void *row, int cols, float xy[2], float *scale, float *angle)
{
    float k[6] = {0, 0, 1};
    if (cols != 2 && cols != 4 && cols != 6) return false;
    memcpy(k, row, (size_t)cols * sizeof *k); // a blob may lie anywhere
    xy[0] = k[0], xy[1] = k[1];
    *scale = cols == 6 ? hypotf(k[2], k[4]) : k[2];
    *angle = cols == 6 ? atan2f(k[4], k[2]) : k[3];
    return isfinite(k[0]) && isfinite(k[1]) && isfinite(*scale) && isfinite(*angle);
}

static int take_keypoints(Features *f, const char *k, int cols, const char *path, FsError *err)
{
    size_t n = (size_t)f->n;
    f->xy = malloc(n * 2 * sizeof *f->xy);
    f->scale = malloc(n * sizeof *f->scale);
    f->angle = malloc(n * sizeof *f->angle);
    if (!f->xy || !f->scale || !f->angle) return fs_error_memory(err);
    for (size_t i = 0; i < n; i++)
        if (!take_keypoint(k + i * (size_t)cols * sizeof(float), cols, &f->xy[2 * i], &f->scale[i], &f->angle[i]))
            return fs_error_input(err, "%s: its features are not what COLMAP writes", path);
    return 0;
}

int fs_database_features(Database *d, int image_id, Features *f, FsError *err)
{
    *f = (Features){0};
    int rc = 0;
    Blob k = {0}, v = {0};
    TRY(read_blob(d, "SELECT rows, cols, data FROM keypoints WHERE image_id = ?", image_id, 4, &k, err));
    TRY(read_blob(d, "SELECT rows, cols, data FROM descriptors WHERE image_id = ?", image_id, 1, &v, err));
    if (!k.data || !v.data) goto fail; // no features: an empty photo is no error here
    int n = k.rows;
    if (v.rows != n || v.cols != FS_DESCRIPTOR)
        TRY(fs_error_input(err, "%s: %d descriptors of %d bytes for %d features of photo %d", d->path, v.rows, v.cols,
                           n, image_id));
    f->n = n;
    TRY(take_keypoints(f, k.data, k.cols, d->path, err));
    f->descriptor = malloc((size_t)n * FS_DESCRIPTOR * sizeof *f->descriptor);
    if (!f->descriptor) TRY(fs_error_memory(err));
    for (size_t i = 0; i < (size_t)n * FS_DESCRIPTOR; i++) f->descriptor[i] = ((const unsigned char *)v.data)[i];
fail:
    sqlite3_finalize(k.statement);
    sqlite3_finalize(v.statement);
    if (rc < 0) fs_database_features_free(f);
    return rc;
}

static int64_t pair_id(int id1, int id2)
{
    return (id1 < id2 ? id1 : id2) * MAX_IMAGE_ID + (id1 < id2 ? id2 : id1);
}

int fs_database_verified(Database *d, int id1, int id2, FsError *err)
{
    sqlite3_stmt *s;
    MUST(prepare(d, "SELECT rows FROM two_view_geometries WHERE pair_id = ?", &s, err));
    sqlite3_bind_int64(s, 1, pair_id(id1, id2));
    return read_number(d, s, 0, err);
}

int fs_database_add_matches(Database *d, int id1, int id2, const MatchList *list, FsError *err)
{
    sqlite3_stmt *s;
    int rc = 0;
    bool swap = id1 > id2;
    uint32_t *data = malloc(((size_t)list->n + 1) * 2 * sizeof *data);
    if (!data) return fs_error_memory(err);
    for (int i = 0; i < list->n; i++) {
        data[2 * i + swap] = (uint32_t)list->match[i].a;
        data[2 * i + !swap] = (uint32_t)list->match[i].b;
    }
    TRY(prepare(d, "INSERT INTO matches(pair_id, rows, cols, data) VALUES(?, ?, 2, ?)", &s, err));
    sqlite3_bind_int64(s, 1, pair_id(id1, id2));
    sqlite3_bind_int(s, 2, list->n);
    sqlite3_bind_blob(s, 3, data, list->n * 2 * (int)sizeof *data, SQLITE_STATIC);
    rc = finish(d, s, err);
fail:
    free(data);
    return rc;
}
