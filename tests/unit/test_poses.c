// The stage poses with a known model, on a made-up capture: what it writes, what it skips, what it refuses.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <sqlite3.h>
#include <string.h>
#include <cmocka.h>

#include "base/process.h"
#include "model/project.h"
#include "poses/colmap.h"
#include "poses/poses.h"
#include "poses/sparse.h"
#include "temp_dir.h"

enum { PHOTOS = 12, POINTS = 40, WIDTH = 30, HEIGHT = 20 };

static const Lens lens = {.model = LENS_RADIAL, .width = 60, .height = 40, .param = {50, 30, 20, -0.08, 0.01}};

static void put_text(const char *path, const char *text)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fputs(text, f);
    assert_int_equal(fclose(f), 0);
}

// OUT/ingest.json and OUT/linear as ingest leaves them; every second photo with flash.
static void make_capture(const char *out)
{
    char *path = fs_file_path("%s/linear/features", out), text[4000] = "{\"photos\": [";
    assert_int_equal(fs_file_mkdirs(path, NULL), 0);
    free(path);
    for (int i = 0; i < PHOTOS; i++) {
        Image photo, mask;
        assert_int_equal(fs_image_new(&photo, WIDTH, HEIGHT, 3, NULL), 0);
        assert_int_equal(fs_image_new(&mask, WIDTH, HEIGHT, 1, NULL), 0);
        for (int k = 0; k < WIDTH * HEIGHT * 3; k++) photo.px[k] = 0.01f * (float)(i + 1);
        for (int k = 0; k < WIDTH * HEIGHT; k++) mask.px[k] = 1;
        path = fs_file_path("%s/linear/IMG_%02d.tif", out, i);
        assert_int_equal(fs_tiff_write_float(path, &photo, NULL), 0);
        free(path);
        path = fs_file_path("%s/linear/IMG_%02d_mask.png", out, i);
        assert_int_equal(fs_png_write(path, &mask, 8, NULL), 0);
        free(path);
        path = fs_file_path("%s/linear/features/IMG_%02d.png", out, i);
        assert_int_equal(fs_png_write(path, &photo, 8, NULL), 0);
        free(path);
        fs_image_free(&photo);
        fs_image_free(&mask);
        sprintf(text + strlen(text),
                "%s{\"name\": \"IMG_%02d\", \"flash\": %s, \"width\": %d, \"height\": %d, \"focal_px\": 25}",
                i ? ", " : "", i, i % 2 ? "true" : "false", WIDTH, HEIGHT);
    }
    strcat(text, "]}");
    path = fs_file_path("%s/ingest.json", out);
    put_text(path, text);
    free(path);
}

static const char MODEL_NAMES[] = "some/IMG_%02d.JPG", *model_names = MODEL_NAMES;

// A COLMAP model of `photos` of them and two views without photo, twice as large as the working images.
static void make_model(const char *dir, int photos, bool points, const Lens *l)
{
    ColmapModel m = {0};
    ColmapCamera *camera = fs_colmap_model_add_camera(&m, NULL);
    camera->id = 1;
    camera->lens = *l;
    for (int i = 0; i < photos + 2; i++) {
        char name[40];
        snprintf(name, sizeof name, i < photos ? model_names : "TEST_%02d.JPG", i);
        ColmapImage *image = fs_colmap_model_add_image(&m, name, NULL);
        image->id = (uint32_t)(100 + i);
        image->camera_id = 1;
        image->t[0] = -0.1 * i;
        image->t[2] = 0.5;
        for (int k = 0; k < POINTS && points; k++) {
            double x[3] = {0.05 * (k % 8) + 0.1, 0.1 * (k / 8) - 0.2, 2 + 0.1 * (k % 3)}, pixel[2];
            double ray[2] = {(x[0] + image->t[0]) / (x[2] + image->t[2]), x[1] / (x[2] + image->t[2])};
            fs_lens_project(l, ray, pixel);
            assert_int_equal(fs_colmap_model_add_observation(&m, (ColmapObservation){pixel[0], pixel[1], k + 1}, NULL),
                             0);
        }
    }
    for (int k = 0; k < POINTS && points; k++) {
        ColmapPoint *p = fs_colmap_model_add_point(&m, NULL);
        p->id = k + 1;
        p->rgb[1] = (unsigned char)k;
        double x[3] = {0.05 * (k % 8) + 0.1, 0.1 * (k / 8) - 0.2, 2 + 0.1 * (k % 3)};
        memcpy(p->xyz, x, sizeof x);
        for (int i = 0; i < photos + 2; i++)
            if (i % 2 == k % 2 || k % 3 == 0) // some in flash photos only, some in the others only
                assert_int_equal(fs_colmap_model_add_track(&m, (ColmapTrack){(uint32_t)(100 + i), (uint32_t)k}, NULL),
                                 0);
    }
    fs_file_remove_tree(dir);
    assert_int_equal(fs_colmap_model_write(dir, &m, true, NULL), 0);
    fs_colmap_model_free(&m);
}

typedef struct Told {
    char last[2000];
    bool stop;
} Told;

static void hear(void *user, FsLogLevel level, const char *message)
{
    (void)level;
    Told *told = user;
    strncat(told->last, message, sizeof told->last - strlen(told->last) - 1);
}

static bool stop(void *user)
{
    return ((Told *)user)->stop;
}

static int run(const char *out, const char *model, const char *every, Told *told, FsError *err)
{
    FsSettings *settings = fs_settings_new();
    FsCallbacks callbacks = {.log = hear, .cancelled = stop, .user = told};
    FsProject *project;
    told->last[0] = 0;
    assert_int_equal(fs_settings_set(settings, "poses", model, NULL), 0);
    assert_int_equal(fs_settings_set(settings, "test-every", every, NULL), 0);
    assert_int_equal(fs_settings_set(settings, "colmap", "/nonexistent/colmap", NULL), 0);
    assert_int_equal(fs_project_open(&project, out, settings, &callbacks, NULL), 0);
    int rc = fs_poses_run(project, err);
    fs_project_close(project);
    fs_settings_free(settings);
    return rc;
}

static void read_views(const char *out, Dataset *views)
{
    char *path = fs_file_path("%s/views.json", out);
    assert_int_equal(fs_dataset_read(views, path, NULL), 0);
    free(path);
}

static void check_sparse(const char *out, const Dataset *views)
{
    char *dir = fs_file_path("%s/sparse", out);
    ColmapModel m;
    assert_int_equal(fs_colmap_model_read(dir, &m, NULL), 0);
    assert_int_equal(m.n_images, PHOTOS);
    assert_int_equal(m.n_points, POINTS);
    assert_int_equal(m.n_cameras, 1);
    assert_int_equal(m.camera[0].lens.model, LENS_PINHOLE);
    assert_int_equal(m.camera[0].lens.width, WIDTH);
    int one_lighting = 0;
    for (int k = 0; k < m.n_points; k++) {
        const ColmapPoint *p = &m.point[k];
        int seen[2] = {0, 0};
        assert_int_equal(p->n, (p->id - 1) % 3 == 0 ? PHOTOS : PHOTOS / 2);
        assert_int_equal(p->rgb[1], p->id - 1);
        for (int l = 0; l < p->n; l++) {
            const ColmapImage *image = &m.image[fs_colmap_model_image(&m, m.track[p->first + l].image_id)];
            const ColmapObservation *o = &m.observation[image->first + (int)m.track[p->first + l].index];
            int view = fs_dataset_find(views, image->name);
            double pixel[2];
            assert_true(view >= 0);
            assert_int_equal(o->point, p->id);
            fs_camera_project(&views->view[view].camera, p->xyz, pixel); // undistorted, at the working size
            assert_true(hypot(pixel[0] - o->x, pixel[1] - o->y) < 1e-4);
            seen[views->view[view].flash]++;
        }
        one_lighting += !seen[0] || !seen[1];
    }
    assert_int_equal(one_lighting, 26);
    fs_colmap_model_free(&m);
    free(dir);
}

// A finer image of one photo, with a place that is not to be trusted.
static void put_fine(const char *out)
{
    Image photo, mask;
    char *path = fs_file_path("%s/linear/fine", out);
    assert_int_equal(fs_file_mkdirs(path, NULL), 0);
    free(path);
    assert_int_equal(fs_image_new(&photo, 2 * WIDTH, 2 * HEIGHT, 3, NULL), 0);
    assert_int_equal(fs_image_new(&mask, 2 * WIDTH, 2 * HEIGHT, 1, NULL), 0);
    for (size_t k = 0; k < fs_image_values(&photo); k++) photo.px[k] = 0.75f;
    for (size_t k = 0; k < fs_image_pixels(&mask); k++) mask.px[k] = k != (size_t)(2 * WIDTH * 10 + 41);
    path = fs_file_path("%s/linear/fine/IMG_04.tif", out);
    assert_int_equal(fs_tiff_write_half(path, &photo, NULL), 0);
    free(path);
    path = fs_file_path("%s/linear/fine/IMG_04_mask.png", out);
    assert_int_equal(fs_png_write(path, &mask, 8, NULL), 0);
    free(path);
    fs_image_free(&photo);
    fs_image_free(&mask);
}

// The corner of the photo, which the lens pulls in, is in the frame, and just so.
static void check_camera(const Camera *camera)
{
    double ray[2];
    assert_true(fs_lens_unproject(&lens, (double[2]){0, 0}, ray));
    double x = camera->fx * ray[0] + camera->cx;
    assert_true(x > -0.1 && x < 0.1);
    assert_true(camera->fx < 24.5 && fabs(camera->fx - camera->fy) < 1e-12);
}

static void test_known(void **state)
{
    char *out = fs_file_path("%s/out", (char *)*state), *model = fs_file_path("%s/model", (char *)*state);
    FsError err = {0};
    Told told = {0};
    Dataset views;
    make_capture(out);
    put_fine(out);
    make_model(model, PHOTOS, true, &lens);
    int rc = run(out, model, "0", &told, &err);
    if (rc) print_error("%s\n", err.message);
    assert_int_equal(rc, 0);
    assert_non_null(strstr(told.last, "12 of 12 photos, 40 points (13 in flash photos only, 13 in the others only)"));
    read_views(out, &views);
    assert_int_equal(views.n, PHOTOS);
    for (int i = 0; i < PHOTOS; i++) {
        Image photo, mask;
        assert_int_equal(views.view[i].flash, i % 2);
        assert_false(views.view[i].held_out);
        check_camera(&views.view[i].camera);
        assert_true(fabs(views.view[i].camera.w2c[3] + 0.1 * i) < 1e-12);
        assert_int_equal(fs_dataset_load_view(out, &views.view[i], &photo, &mask, NULL), 0);
        assert_true(fabsf(photo.px[3 * (10 * WIDTH + 15)] - (i == 4 ? 0.75f : 0.01f * (float)(i + 1))) < 1e-6f);
        assert_true(mask.px[10 * WIDTH + 15] == 1);
        int lost = 0;
        for (int y = 3; y < 8; y++)
            for (int x = 17; x < 24; x++) lost += mask.px[y * WIDTH + x] == 0;
        assert_true(i == 4 ? lost >= 1 && lost <= 4 : lost == 0);
        fs_image_free(&photo);
        fs_image_free(&mask);
    }
    check_sparse(out, &views);
    fs_dataset_free(&views);

    assert_int_equal(run(out, model, "3", &told, &err), 0); // not posed again, but others held out
    assert_non_null(strstr(told.last, "skipped"));
    read_views(out, &views);
    int held_out[2] = {0, 0};
    for (int i = 0; i < PHOTOS; i++) held_out[views.view[i].flash] += views.view[i].held_out;
    assert_int_equal(held_out[0], 2);
    assert_int_equal(held_out[1], 2);
    fs_dataset_free(&views);
    assert_int_equal(run(out, model, "12", &told, &err), FS_ERR_USAGE); // the 7th of 6 without flash
    assert_non_null(strstr(err.message, "2 to 11"));
    assert_int_equal(run(out, model, "11", &told, &err), 0);
    read_views(out, &views);
    for (int i = 0; i < PHOTOS; i++) assert_int_equal(views.view[i].held_out, i / 2 == 5);
    fs_dataset_free(&views);
    free(out);
    free(model);
}

static void test_missing(void **state)
{
    char *out = fs_file_path("%s/out", (char *)*state), *model = fs_file_path("%s/model", (char *)*state);
    FsError err = {0};
    Told told = {0};
    Dataset views;
    make_capture(out);
    make_model(model, PHOTOS - 2, true, &lens);
    assert_int_equal(run(out, model, "0", &told, &err), 0);
    assert_non_null(strstr(told.last, "10 of 12 photos have a pose in "));
    assert_non_null(strstr(told.last, "/model; left out: IMG_10, IMG_11"));
    read_views(out, &views);
    assert_int_equal(views.n, PHOTOS - 2);
    fs_dataset_free(&views);
    free(out);
    free(model);
}

static void assert_refused(const char *out, const char *model, int code, const char *word, const char *other)
{
    FsError err = {0};
    Told told = {.stop = code == FS_ERR_CANCELLED};
    char *views = fs_file_path("%s/views.json", out);
    int rc = run(out, model, "0", &told, &err);
    if (rc != code || !strstr(err.message, word)) print_error("expected '%s', got '%s'\n", word, err.message);
    assert_int_equal(rc, code);
    assert_non_null(strstr(err.message, word));
    assert_non_null(strstr(err.message, other));
    assert_false(fs_file_exists(views)); // nothing half done
    free(views);
}

static void test_refused(void **state)
{
    char *out = fs_file_path("%s/out", (char *)*state), *model = fs_file_path("%s/model", (char *)*state);
    assert_int_equal(fs_file_mkdirs(out, NULL), 0);
    assert_refused(out, "", FS_ERR_INPUT, "ingest.json", "flashsplat ingest");
    make_capture(out);
    assert_refused(out, "", FS_ERR_INPUT, "/nonexistent/colmap", "install");
    assert_refused(out, model, FS_ERR_INPUT, "model", "no such");
    make_model(model, 7, true, &lens);
    assert_refused(out, model, FS_ERR_INPUT, "7 of the 12", "IMG_07, IMG_08, IMG_09, IMG_10, IMG_11");
    make_model(model, PHOTOS, false, &lens); // no points: they would have to be triangulated
    assert_refused(out, model, FS_ERR_INPUT, "/nonexistent/colmap", "not found");
    Lens tall = lens;
    tall.height = 80;
    make_model(model, PHOTOS, true, &tall);
    assert_refused(out, model, FS_ERR_INPUT, "60 x 80", "same photos");
    make_model(model, PHOTOS, true, &lens);
    assert_refused(out, model, FS_ERR_CANCELLED, "cancelled", "poses");
    char *path = fs_file_path("%s/linear/IMG_03.tif", out);
    put_text(path, "II*");
    assert_refused(out, model, FS_ERR_INPUT, "IMG_03.tif", "");
    free(path);
    path = fs_file_path("%s/ingest.json", out);
    put_text(path, "{\"photos\": [{\"name\": \"../x\", \"width\": 3, \"height\": 3}]}");
    assert_refused(out, model, FS_ERR_INPUT, "ingest.json", "ingest");
    put_text(path, "{\"photos\": 7");
    assert_refused(out, model, FS_ERR_INPUT, "ingest.json", "ingest");
    free(path);
    free(out);
    free(model);
}

// Names in a file of poses: of a folder as Windows writes it, and in another case where that can mean one photo only.
static void test_names(void **state)
{
    static char *names[] = {"A", "B", "De", "F", "b", "f"};
    static const char *const views[] = {"images\\\\a.png", "images\\\\B.png", "x/dE.png",
                                        "dE2.png",         "DE.png",          "sub/F.JPG"};
    static const bool known[] = {true, true, false, true, false, false}; // De: dE or DE; b: B is the other's
    Photo photo[6] = {0};
    Capture capture = {.photo = photo, .n = 6};
    Sparse sparse;
    FsError err = {0};
    FilePath path = fs_file_at("%s/transforms.json", (char *)*state);
    FILE *f = fopen(path.text, "wb");
    assert_non_null(f);
    fprintf(f, "{\"w\": 60, \"h\": 40, \"fl_x\": 55, \"frames\": [");
    for (int i = 0; i < 6; i++) {
        photo[i] = (Photo){.name = names[i], .file = names[i], .picture_width = 60, .picture_height = 40};
        fprintf(f, "%s{\"file_path\": \"%s\", \"transform_matrix\": [[1,0,0,%d],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}",
                i ? ", " : "", views[i], i);
    }
    fprintf(f, "]}");
    assert_int_equal(fclose(f), 0);
    assert_int_equal(fs_sparse_new(&sparse, &capture, NULL), 0);
    if (fs_sparse_from_file(&sparse, &capture, path.text, &err) != 0) fail_msg("%s", err.message);
    for (int i = 0; i < 6; i++) assert_int_equal(sparse.pose[i].known, known[i]);
    static const int view[] = {0, 1, -1, 5};
    for (int i = 0; i < 4; i++)
        if (known[i]) assert_true(sparse.pose[i].camera.w2c[3] == -view[i]);
    fs_sparse_free(&sparse);
    put_text(path.text, "{\"w\": 60, \"h\": 40, \"fl_x\": 55, \"frames\": [{\"file_path\": \"images\\\\\"}]}");
    assert_int_equal(fs_sparse_from_file(&sparse, &capture, path.text, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "file_path"));
}

// A COLMAP model of names in another case has its points, too.
static void test_names_of_model(void **state)
{
    char *out = fs_file_path("%s/out", (char *)*state), *model = fs_file_path("%s/model", (char *)*state);
    FsError err = {0};
    Told told = {0};
    make_capture(out);
    model_names = "some\\img_%02d.JPG";
    make_model(model, PHOTOS, true, &lens);
    model_names = MODEL_NAMES;
    if (run(out, model, "0", &told, &err) != 0) fail_msg("%s", err.message);
    assert_non_null(strstr(told.last, "12 of 12 photos, 40 points (13 in flash photos only, 13 in the others only)"));
    free(out);
    free(model);
}

// Where the poses are known, features are looked for in pictures of twice the working size.
static void test_pixels(void **state)
{
    (void)state;
    FsProject known = {.set = {.poses = "model"}}, unknown = {.set = {.poses = ""}};
    RunSize size = {.photos = 30, .width = 800, .height = 1200, .picture_pixels = 1600 * 2400};
    assert_true(fs_poses_pixels(&unknown, &size) == 1600 * 2400);
    assert_true(fs_poses_pixels(&known, &size) == 1600 * 2400);
    size.width = 360, size.height = 240;
    assert_true(fs_poses_pixels(&known, &size) == 720 * 480);
    size.width = 150, size.height = 100;
    assert_true(fs_poses_pixels(&known, &size) == 600 * 400);
    size.picture_pixels = 300 * 200;
    assert_true(fs_poses_pixels(&known, &size) == 300 * 200);
}

// A zoom, or a phone's other lens, is another camera to COLMAP.
static void test_cameras(void **state)
{
    static const struct {
        int width;
        double focal;
        int camera;
        double mm; // where the sensor's size is not told
    } photos[9] = {{60, 50, 1},   {60, 50.3, 1},  {60, 70, 2},    {60, 0, 1},    {40, 50, 3},
                   {60, 70.1, 2}, {30, 0, 4, 18}, {30, 0, 5, 55}, {30, 0, 4, 18}};
    FsProject project = {.out = *state, .set = {.colmap = "colmap"}};
    Photo photo[9] = {0};
    char name[9][10];
    Capture capture = {.photo = photo, .n = 9, .pictures = *state};
    Colmap colmap;
    FsError err = {0};
    if (!fs_process_found("colmap")) skip();
    for (int i = 0; i < 9; i++) {
        sprintf(name[i], "%d.png", i);
        photo[i] = (Photo){.name = name[i], .picture = name[i], .width = photos[i].width, .height = 40};
        photo[i].picture_width = photos[i].width, photo[i].picture_height = 40, photo[i].focal_px = photos[i].focal;
        photo[i].focal_mm = photos[i].mm;
    }
    if (fs_colmap_open(&colmap, &project, &capture, &err) != 0) fail_msg("%s", err.message);
    sqlite3 *db;
    sqlite3_stmt *row;
    assert_int_equal(sqlite3_open(colmap.database, &db), SQLITE_OK);
    assert_int_equal(sqlite3_prepare_v2(db, "SELECT camera_id FROM images ORDER BY image_id", -1, &row, NULL),
                     SQLITE_OK);
    for (int i = 0; i < 9; i++) {
        assert_int_equal(sqlite3_step(row), SQLITE_ROW);
        assert_int_equal(sqlite3_column_int(row, 0), photos[i].camera);
    }
    sqlite3_finalize(row);
    sqlite3_close(db);
    fs_colmap_close(&colmap);
}

// COLMAP's adjustment gave the second photo a lens of this focal length and moved all cameras by 1.
static void make_adjusted(const char *dir, const Capture *capture, double focal)
{
    ColmapModel m = {0};
    for (int i = 0; i < capture->n; i++) {
        ColmapCamera *camera = fs_colmap_model_add_camera(&m, NULL);
        camera->id = (uint32_t)i + 1;
        camera->lens = lens;
        if (i == 1) camera->lens.param[0] = focal;
        ColmapImage *image = fs_colmap_model_add_image(&m, capture->photo[i].picture, NULL);
        image->id = image->camera_id = camera->id;
        image->t[0] = 1;
    }
    assert_int_equal(fs_colmap_model_write(dir, &m, true, NULL), 0);
    fs_colmap_model_free(&m);
}

// `seen` points that all photos see, and as many for every three photos that only these see.
static void make_seen(Sparse *sparse, const Capture *capture, int seen)
{
    int n = capture->n, groups = n / 3, total = seen * n + seen * groups * 3;
    assert_int_equal(fs_sparse_new(sparse, capture, NULL), 0);
    sparse->point = calloc((size_t)(seen + seen * groups), sizeof *sparse->point);
    sparse->sighting = calloc((size_t)total, sizeof *sparse->sighting);
    for (int k = 0; k < seen * n; k++) sparse->sighting[k] = (Sighting){k % n, 20 + k % 7, 20};
    for (int k = 0; k < seen; k++) sparse->point[k] = (SparsePoint){.xyz = {0, 0, 1}, .first = k * n, .n = n};
    sparse->n_points = seen, sparse->n_sightings = seen * n;
    for (int k = 0; k < seen * groups && groups > 1; k++) {
        sparse->point[sparse->n_points++] =
            (SparsePoint){.xyz = {0, 0, 1}, .error = 0.1, .first = sparse->n_sightings, .n = 3};
        for (int l = 0; l < 3; l++)
            sparse->sighting[sparse->n_sightings++] = (Sighting){3 * (k % groups) + l, 20 + k % 7, 20};
    }
    for (int i = 0; i < n; i++) {
        sparse->pose[i] = (Pose){.known = true, .lens = lens};
        assert_int_equal(fs_lens_camera(&lens, "", &sparse->pose[i].camera, NULL), 0);
        sparse->pose[i].camera.w2c[0] = sparse->pose[i].camera.w2c[5] = sparse->pose[i].camera.w2c[10] = 1;
    }
}

// What COLMAP was given holds each photo by so many points.
static void check_given(const char *dir, int n, int seen)
{
    ColmapModel m;
    FilePath from = fs_file_at("%s/before-adjustment", dir);
    assert_int_equal(fs_colmap_model_read(from.text, &m, NULL), 0);
    assert_int_equal(m.n_images, n);
    for (int i = 0; i < n; i++) assert_int_equal(m.image[i].n, seen);
    assert_int_equal(m.n_points, seen); // the longest tracks
    fs_colmap_model_free(&m);
}

enum { MOST_ADJUSTED = 150 };

static void check_adjust(const char *dir, int n, int seen, bool refined)
{
    static char name[MOST_ADJUSTED][8], picture[MOST_ADJUSTED][12];
    Told told = {{0}, false};
    FsProject project = {.out = (char *)dir, .set = {.colmap = "true"}, .log = {.log = hear, .user = &told}};
    Photo photo[MOST_ADJUSTED];
    Capture capture = {.photo = photo, .n = n, .pictures = (char *)dir};
    Colmap colmap = {.project = &project, .capture = &capture, .dir = (char *)dir};
    FilePath log = fs_file_at("%s/log.txt", colmap.dir), adjusted = fs_file_at("%s/adjusted", colmap.dir);
    Sparse sparse;
    FsError err = {0};
    colmap.log_path = log.text;
    for (int i = 0; i < n; i++) {
        sprintf(name[i], "p%03d", i);
        sprintf(picture[i], "p%03d.png", i);
        photo[i] = (Photo){.name = name[i],
                           .picture = picture[i],
                           .width = WIDTH,
                           .height = HEIGHT,
                           .picture_width = lens.width,
                           .picture_height = lens.height};
    }
    make_seen(&sparse, &capture, seen);
    for (int usable = 0; usable < 2; usable++) {
        make_adjusted(adjusted.text, &capture, usable ? 51 : -51);
        if (fs_adjust_poses(&colmap, &sparse, &err) != 0) fail_msg("%s", err.message);
        for (int i = 0; i < n; i++) assert_true(sparse.pose[i].camera.w2c[3] == (usable && refined));
        assert_true(sparse.pose[1].lens.param[0] == (usable && refined ? 51 : 50));
        assert_int_equal(strstr(told.last, "poses: not refined: ") != NULL, !usable || !refined);
        if (!refined) assert_non_null(strstr(told.last, "(p000: 199)"));
        if (refined) check_given(dir, n, seen * n <= 24500 ? seen : 24500 / n);
        told.last[0] = 0;
    }
    fs_sparse_free(&sparse);
}

// All poses are the adjusted ones, or none is; photos with few points are left alone, and that is said.
static void test_adjust(void **state)
{
    check_adjust(*state, 3, 200, true);
    check_adjust(*state, MOST_ADJUSTED, 200, true); // more observations than COLMAP takes lightly
    check_adjust(*state, 3, 199, false);
}

// What cannot be read is an error, and not a photo that is missing.
static void test_database(void **state)
{
    FilePath path = fs_file_at("%s/colmap.db", (char *)*state);
    sqlite3 *db;
    Database *database;
    FsError err = {0};
    assert_int_equal(sqlite3_open(path.text, &db), SQLITE_OK);
    assert_int_equal(
        sqlite3_exec(db,
                     "CREATE TABLE images(image_id, name); CREATE TABLE two_view_geometries(pair_id, rows);"
                     "INSERT INTO images VALUES(3, 'a.png'), (-1, 'b.png');"
                     "INSERT INTO two_view_geometries VALUES(2147483647 + 2, 17);",
                     NULL, NULL, NULL),
        SQLITE_OK);
    assert_int_equal(fs_database_open(&database, path.text, NULL), 0);
    assert_int_equal(fs_database_has_frames(database, NULL), 0);
    assert_int_equal(fs_database_image(database, "a.png", NULL), 3);
    assert_int_equal(fs_database_image(database, "c.png", NULL), 0);
    assert_int_equal(fs_database_image(database, "b.png", NULL), FS_ERR_INPUT);
    assert_int_equal(fs_database_verified(database, 2, 1, NULL), 17);
    assert_int_equal(fs_database_verified(database, 2, 3, NULL), 0);
    assert_int_equal(sqlite3_exec(db, "DROP TABLE images; DROP TABLE two_view_geometries", NULL, NULL, NULL),
                     SQLITE_OK);
    assert_int_equal(fs_database_image(database, "a.png", &err), FS_ERR_IO);
    assert_non_null(strstr(err.message, path.text));
    assert_int_equal(fs_database_verified(database, 2, 1, NULL), FS_ERR_IO);
    fs_database_close(database);
    sqlite3_close(db);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_known, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_missing, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_names, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_names_of_model, temp_dir_make, temp_dir_remove),
        cmocka_unit_test(test_pixels),
        cmocka_unit_test_setup_teardown(test_cameras, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_database, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_adjust, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_refused, temp_dir_make, temp_dir_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
