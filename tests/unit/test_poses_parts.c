// Parts of the stage poses on made-up scenes: matching, triangulation at known poses, undistortion.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/linalg.h"
#include "base/rng.h"
#include "poses/match.h"
#include "poses/model_frame.h"
#include "poses/refine.h"
#include "poses/triangulate.h"
#include "model/dataset.h"
#include "poses/undistort.h"

enum { PHOTOS = 8, WALK_PHOTOS = 40, POINTS = 300, CLUTTER = 100 };

typedef struct Scene {
    int n;
    double xyz[POINTS][3];
    Camera camera[WALK_PHOTOS];
    Features features[WALK_PHOTOS];
    int truth[WALK_PHOTOS][POINTS + CLUTTER]; // point of each feature, or -1
} Scene;
typedef enum Path {
    CLOSE,
    OVERVIEW, // the last photo is from far back
    WALK,     // 10 m along what is 1.2 to 2 m away
} Path;

static void random_descriptor(Rng *rng, int16_t *d) // about as long as COLMAP's: 512
{
    double sum = 0, v[FS_DESCRIPTOR];
    for (int k = 0; k < FS_DESCRIPTOR; k++) {
        v[k] = fabs(fs_rng_normal(rng));
        v[k] *= v[k];
        sum += v[k] * v[k];
    }
    for (int k = 0; k < FS_DESCRIPTOR; k++) d[k] = (int16_t)fmin(255, 512 * v[k] / sqrt(sum));
}

static void add_feature(Features *f, Rng *rng, double x, double y, const int16_t *descriptor)
{
    f->xy[2 * f->n] = (float)x;
    f->xy[2 * f->n + 1] = (float)y;
    f->scale[f->n] = 2;
    f->angle[f->n] = 0;
    for (int k = 0; k < FS_DESCRIPTOR; k++) {
        int v = descriptor[k] + (int)(4 * fs_rng_normal(rng));
        f->descriptor[f->n * FS_DESCRIPTOR + k] = (int16_t)(v < 0 ? 0 : v > 255 ? 255 : v);
    }
    f->n++;
}

static void place_camera(Rng *rng, Path path, int a, Camera *c)
{
    double r[9], quat[4] = {1, 0.02 * fs_rng_normal(rng), 0.02 * fs_rng_normal(rng), 0.02 * fs_rng_normal(rng)};
    *c = (Camera){.width = 600, .height = 400, .fx = 640, .fy = 640, .cx = 300, .cy = 200};
    fs_camera_quat_to_rotation(quat, r);
    for (int k = 0; k < 3; k++) memcpy(c->w2c + 4 * k, r + 3 * k, 3 * sizeof *r);
    c->w2c[3] = path == WALK ? 5 - 0.25 * a : 0.15 * (a % 4) - 0.2;
    c->w2c[7] = path == WALK ? 0 : 0.2 * (a / 4);
    if (path == OVERVIEW && a == PHOTOS - 1) c->w2c[11] = 15;
}

static Scene *make_scene(Path path)
{
    Scene *s = calloc(1, sizeof *s);
    s->n = path == WALK ? WALK_PHOTOS : PHOTOS;
    Rng rng = fs_rng_new(11);
    static int16_t descriptor[POINTS][FS_DESCRIPTOR];
    for (int i = 0; i < POINTS; i++) {
        for (int k = 0; k < 2; k++) s->xyz[i][k] = 3 * fs_rng_uniform(&rng) - 1.5;
        s->xyz[i][2] = 3 + 2 * fs_rng_uniform(&rng);
        if (path == WALK) s->xyz[i][0] *= 10.0 / 3, s->xyz[i][1] *= 0.3, s->xyz[i][2] *= 0.4;
        random_descriptor(&rng, descriptor[i]);
    }
    for (int a = 0; a < s->n; a++) {
        Camera *c = &s->camera[a];
        place_camera(&rng, path, a, c);
        Features *f = &s->features[a];
        f->xy = calloc(2 * (POINTS + CLUTTER), sizeof *f->xy);
        f->scale = calloc(POINTS + CLUTTER, sizeof *f->scale);
        f->angle = calloc(POINTS + CLUTTER, sizeof *f->angle);
        f->descriptor = calloc((POINTS + CLUTTER) * FS_DESCRIPTOR, sizeof *f->descriptor);
        for (int i = 0; i < POINTS; i++) {
            double p[2];
            fs_camera_project(c, s->xyz[i], p);
            if (p[0] < 0 || p[1] < 0 || p[0] > 600 || p[1] > 400) continue;
            s->truth[a][f->n] = i;
            add_feature(f, &rng, p[0] + 0.3 * fs_rng_normal(&rng), p[1] + 0.3 * fs_rng_normal(&rng), descriptor[i]);
        }
        for (int i = 0; i < CLUTTER; i++) { // looks like some point, is elsewhere
            s->truth[a][f->n] = -1;
            add_feature(f, &rng, 600 * fs_rng_uniform(&rng), 400 * fs_rng_uniform(&rng),
                        descriptor[fs_rng_below(&rng, POINTS)]);
        }
    }
    return s;
}

static void free_scene(Scene *s)
{
    for (int a = 0; a < s->n; a++) {
        free(s->features[a].xy);
        free(s->features[a].scale);
        free(s->features[a].angle);
        free(s->features[a].descriptor);
    }
    free(s);
}

static void test_triangulate(void **state)
{
    (void)state;
    Scene *s = make_scene(CLOSE);
    PointSet set[2];
    Log log = {0};
    for (int run = 0; run < 2; run++) { // one thread, two threads: the same
        Threads *threads = fs_threads_new(run + 1);
        assert_int_equal(fs_triangulate(&(PosedFeatures){s->features, s->camera, PHOTOS}, &fs_triangulate_defaults,
                                        threads, &log, &set[run], NULL),
                         0);
        fs_threads_free(threads);
    }
    assert_int_equal(set[0].n, set[1].n);
    assert_memory_equal(set[0].point, set[1].point, (size_t)set[0].n * sizeof *set[0].point);
    assert_memory_equal(set[0].seen, set[1].seen, (size_t)set[0].n_seen * sizeof *set[0].seen);
    int right = 0, wrong_seen = 0;
    bool found[POINTS] = {false};
    for (int k = 0; k < set[0].n; k++) {
        const Point *p = &set[0].point[k];
        int votes[POINTS] = {0}, best = 0;
        for (int l = 0; l < p->n; l++) {
            Seen seen = set[0].seen[p->first + l];
            int i = s->truth[seen.photo][seen.feature];
            if (i >= 0 && ++votes[i] > votes[best]) best = i;
        }
        wrong_seen += p->n - votes[best];
        double d2 = 0;
        for (int c = 0; c < 3; c++) d2 += pow(p->xyz[c] - s->xyz[best][c], 2);
        if (votes[best] >= 3 && sqrt(d2) < 0.05) {
            assert_false(found[best]); // no point twice
            found[best] = true;
            right++;
        }
        assert_true(p->error < 1);
    }
    int visible = 0;
    for (int i = 0; i < POINTS; i++) {
        int seen = 0;
        for (int a = 0; a < PHOTOS; a++)
            for (int f = 0; f < s->features[a].n; f++) seen += s->truth[a][f] == i;
        visible += seen >= 6;
    }
    assert_true(visible > 150);
    assert_true(right >= 0.95 * visible);
    assert_true(set[0].n - right <= 3);
    assert_true(wrong_seen < 0.01 * set[0].n_seen);
    for (int run = 0; run < 2; run++) fs_triangulate_free(&set[run]);
    free_scene(s);
}

static int count_points(Path path)
{
    Scene *s = make_scene(path);
    PointSet set;
    Log log = {0};
    Threads *threads = fs_threads_new(1);
    assert_int_equal(fs_triangulate(&(PosedFeatures){s->features, s->camera, s->n}, &fs_triangulate_defaults, threads,
                                    &log, &set, NULL),
                     0);
    int n = set.n;
    fs_threads_free(threads);
    fs_triangulate_free(&set);
    free_scene(s);
    return n;
}

// What is near is found beside a photo from far back, and along a way that is longer than the scene is far.
static void test_far_cameras(void **state)
{
    (void)state;
    int close = count_points(CLOSE), overview = count_points(OVERVIEW), walk = count_points(WALK);
    if (overview < 0.7 * close || walk < 0.7 * POINTS) print_error("%d, %d, %d points\n", close, overview, walk);
    assert_true(overview >= 0.7 * close);
    assert_true(walk >= 0.7 * POINTS);
}

// All that the cameras are, but for a few far ones.
static void test_extent(void **state)
{
    (void)state;
    Camera camera[12];
    double centre[3], far_centre[3], mean[3] = {0, 0, 0}, most = 0;
    for (int i = 0; i < 12; i++) {
        camera[i] = (Camera){.w2c = {1, 0, 0, -0.1 * i, 0, 1, 0, 0.3 * (i % 3), 0, 0, 1, 0.07 * i}};
        fs_camera_centre(&camera[i], centre);
        for (int k = 0; k < 3; k++) mean[k] += centre[k] / 12;
    }
    for (int i = 0; i < 12; i++) {
        fs_camera_centre(&camera[i], centre);
        most = fmax(most, sqrt(v3_distance2(centre, mean)));
    }
    assert_true(fs_camera_extent(camera, sizeof *camera, 12, centre) == most); // to the bit
    assert_memory_equal(centre, mean, sizeof mean);
    camera[5].w2c[11] = 15;
    camera[8].w2c[11] = 1e9;
    double extent = fs_camera_extent(camera, sizeof *camera, 12, far_centre);
    assert_true(extent > 0.8 * most && extent < 1.2 * most && v3_distance2(centre, far_centre) < 0.1 * most * most);
    camera[1].w2c[11] = 16; // three of twelve are not a few
    assert_true(fs_camera_extent(camera, sizeof *camera, 12, far_centre) > 1e8);
    for (int i = 1; i < 12; i++) camera[i] = camera[0]; // all but one from one place
    camera[11].w2c[3] = 1;
    extent = fs_camera_extent(camera, sizeof *camera, 12, centre);
    assert_true(extent > 0.9 && extent < 1);
    assert_true(fs_camera_extent(camera, sizeof *camera, 1, centre) == 0);
    assert_true(fs_camera_extent(NULL, sizeof *camera, 0, centre) == 0);
}

static void test_nothing_to_triangulate(void **state)
{
    (void)state;
    Scene *s = make_scene(CLOSE);
    PointSet set;
    Log log = {0};
    Threads *threads = fs_threads_new(1);
    for (int a = 1; a < PHOTOS; a++) s->camera[a] = s->camera[0]; // all from one place: no depth
    assert_int_equal(fs_triangulate(&(PosedFeatures){s->features, s->camera, PHOTOS}, &fs_triangulate_defaults, threads,
                                    &log, &set, NULL),
                     0);
    assert_int_equal(set.n, 0);
    fs_triangulate_free(&set);
    Features none[2] = {{0}};
    assert_int_equal(
        fs_triangulate(&(PosedFeatures){none, s->camera, 2}, &fs_triangulate_defaults, threads, &log, &set, NULL), 0);
    assert_int_equal(set.n, 0);
    fs_triangulate_free(&set);
    fs_threads_free(threads);
    free_scene(s);
}

static void test_match(void **state)
{
    (void)state;
    Scene *s = make_scene(CLOSE);
    MatchList list[2][PHOTOS * (PHOTOS - 1) / 2];
    Log log = {0};
    for (int run = 0; run < 2; run++) {
        Threads *threads = fs_threads_new(run + 1);
        for (int a = 0; a < PHOTOS; a++) s->features[a].n -= CLUTTER * !run;
        assert_int_equal(
            fs_match_all(s->features, PHOTOS, (MatchOptions){100000, 0.8f, NULL}, threads, &log, list[run], NULL), 0);
        for (int a = 0; a < PHOTOS; a++) s->features[a].n += CLUTTER * !run;
        fs_threads_free(threads);
    }
    for (int j = 0; j < PHOTOS; j++)
        for (int i = 0; i < j; i++) {
            const MatchList *l = &list[0][fs_match_pair(i, j)]; // without clutter every common point matches, rightly
            int common = 0;
            for (int f = 0; f < s->features[i].n - CLUTTER; f++)
                for (int g = 0; g < s->features[j].n - CLUTTER; g++) common += s->truth[i][f] == s->truth[j][g];
            assert_true(l->n >= common - 2 && l->n <= common);
            for (int k = 0; k < l->n; k++) assert_int_equal(s->truth[i][l->match[k].a], s->truth[j][l->match[k].b]);
            assert_true(list[1][fs_match_pair(i, j)].n < common); // twins are ambiguous
        }
    for (int run = 0; run < 2; run++)
        for (int k = 0; k < PHOTOS * (PHOTOS - 1) / 2; k++) free(list[run][k].match);
    free_scene(s);
}

// Many pictures along a path, named in another order: each is matched with its neighbours on the path, and few others.
static void test_choose(void **state)
{
    (void)state;
    enum { N = 120, SEEN = 20, STEP = 4 }; // points in a picture, of which the next has all but STEP
    Features features[N];
    static int16_t point[N * STEP + SEEN][FS_DESCRIPTOR];
    static bool pair[2][N * (N - 1) / 2];
    Rng rng = fs_rng_new(5);
    Log log = {0};
    for (int p = 0; p < N * STEP + SEEN; p++)
        for (int k = 0; k < FS_DESCRIPTOR; k++) point[p][k] = (int16_t)(fs_rng_below(&rng, 5) ? 10 : 96);
    for (int i = 0; i < N; i++) {
        int place = i * 37 % N;
        features[i] = (Features){.n = SEEN, .descriptor = point[place * STEP], .scale = calloc(SEEN, sizeof(float))};
    }
    for (int run = 0; run < 2; run++) {
        Threads *threads = fs_threads_new(run + 1);
        assert_int_equal(fs_match_choose(features, N, threads, &log, pair[run], NULL), 0);
        fs_threads_free(threads);
    }
    assert_memory_equal(pair[0], pair[1], sizeof pair[0]);
    int chosen = 0;
    for (int j = 0; j < N; j++)
        for (int i = 0; i < j; i++) {
            bool near = abs(i * 37 % N - j * 37 % N) * STEP < SEEN;
            if (near || j - i <= 3) assert_true(pair[0][fs_match_pair(i, j)]);
            chosen += pair[0][fs_match_pair(i, j)];
        }
    assert_true(chosen < 30 * N);
    for (int i = 0; i < N; i++) free(features[i].scale);
}

static void test_refine(void **state)
{
    (void)state;
    Scene *s = make_scene(CLOSE);
    for (int i = 0; i < 20; i++) {
        Sight sight[PHOTOS];
        for (int a = 0; a < PHOTOS; a++) {
            sight[a].camera = &s->camera[a];
            fs_camera_project(&s->camera[a], s->xyz[i], sight[a].pixel);
        }
        double xyz[3] = {s->xyz[i][0] + 0.2, s->xyz[i][1] - 0.1, s->xyz[i][2] * 1.2};
        assert_true(fs_refine_point(sight, PHOTOS, xyz));
        for (int k = 0; k < 3; k++) assert_true(fabs(xyz[k] - s->xyz[i][k]) < 1e-9);
        assert_true(fs_refine_error(&sight[0], xyz) < 1e-7);
        assert_true(fs_refine_angle(sight, PHOTOS, xyz) > 3);
        xyz[2] = -1;
        assert_false(fs_refine_point(sight, PHOTOS, xyz));             // behind the cameras
        assert_false(fs_refine_point(sight, 1, (double[3]){0, 0, 4})); // one ray has no depth
    }
    free_scene(s);
}

// A smooth picture seen through a lens, undistorted: the picture as the pinhole camera sees it.
static float pattern(const double ray[2], int channel)
{
    return (float)(0.4 + 0.2 * sin(9 * ray[0] + channel) + 0.15 * cos(11 * ray[1]));
}

static void test_undistort(void **state)
{
    (void)state;
    for (int sign = -1; sign <= 1; sign += 2) {
        Lens lens = {.model = LENS_OPENCV,
                     .width = 150,
                     .height = 100,
                     .param = {160, 162, 76, 49, sign * 0.1, 0.02, 0.002, -0.001}};
        Camera camera;
        Image photo, mask;
        assert_int_equal(fs_lens_camera(&lens, "", &camera, NULL), 0);
        assert_int_equal(fs_image_new(&photo, 150, 100, 3, NULL), 0);
        assert_int_equal(fs_image_new(&mask, 150, 100, 1, NULL), 0);
        for (int y = 0; y < 100; y++)
            for (int x = 0; x < 150; x++) {
                double ray[2];
                assert_true(fs_lens_unproject(&lens, (double[2]){x + 0.5, y + 0.5}, ray));
                for (int c = 0; c < 3; c++) photo.px[3 * (150 * y + x) + c] = pattern(ray, c);
                mask.px[150 * y + x] = x == 90 && y == 50 ? FS_MASK_PART : x != 40 || y != 30;
            }
        assert_int_equal(fs_undistort(&lens, &camera, &photo, &mask, NULL), 0);
        int trusted = 0, holes = 0, parts = 0;
        for (int y = 0; y < 100; y++)
            for (int x = 0; x < 150; x++) {
                double ray[2] = {(x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy}, p[2];
                fs_lens_project(&lens, ray, p);
                bool inside = p[0] >= 0 && p[1] >= 0 && p[0] <= 150 && p[1] <= 100;
                if (!inside) assert_true(mask.px[150 * y + x] == 0);
                if (inside && mask.px[150 * y + x] == 0) holes++;
                if (mask.px[150 * y + x] == 0) continue;
                trusted++;
                parts += mask.px[150 * y + x] < 1;
                bool border = p[0] < 2 || p[1] < 2 || p[0] > 148 || p[1] > 98;
                for (int c = 0; c < 3; c++)
                    assert_true(fabsf(photo.px[3 * (150 * y + x) + c] - pattern(ray, c)) < (border ? 3e-2f : 1e-3f));
            }
        assert_true(holes >= 1 && holes <= 9); // the one untrusted pixel spreads to those that used it
        assert_true(parts >= 1 && parts <= 9);
        assert_true(trusted > (sign < 0 ? 14000 : 13000));
        fs_image_free(&photo);
        fs_image_free(&mask);
    }
}

// Of a model of turned and cropped pictures: what a point is seen at there is in the whole upright photo where its lens
// and pose say.
static void test_model_frame(void **state)
{
    (void)state;
    static const int orientation[] = {6, 3, 8, 1};
    static const struct {
        int model;
        double param[FS_LENS_MAX_PARAMS];
    } lenses[] = {
        {LENS_SIMPLE_RADIAL, {160, 76, 49, 0.1}},
        {LENS_OPENCV, {160, 170, 76, 49, 0.1, 0.02, 0.002, -0.001}},
        {LENS_FULL_OPENCV, {160, 170, 76, 49, 0.1, 0.02, 0.002, -0.001, 0.01, 0.02, 0.01, 0.03}},
        {LENS_THIN_PRISM_FISHEYE, {160, 170, 76, 49, 0.1, 0.02, 0.002, -0.001, 0.01, 0.02, 0.003, -0.004}},
    };
    for (int i = 0; i < 16; i++) {
        Lens lens = {.model = lenses[i / 4].model, .width = 150, .height = 100};
        memcpy(lens.param, lenses[i / 4].param, sizeof lens.param);
        bool aside = orientation[i % 4] > 4;
        Photo photo = {.file = "sub/img_1.jpg", .orientation = orientation[i % 4]};
        photo.orig_width = photo.picture_width = aside ? 102 : 154;
        photo.orig_height = photo.picture_height = aside ? 154 : 102;
        ModelFrame frame = fs_model_frame(&photo, &lens, "IMG_1.JPG");
        assert_int_equal(frame.quarters, (i + 1) % 4);
        assert_int_equal(frame.width, photo.orig_width);
        assert_int_equal(frame.height, photo.orig_height);
        Lens whole = fs_model_frame_lens(&frame, &lens);
        double w2c[12] = {0.8, 0.6, 0, 0.3, -0.6, 0.8, 0, -0.2, 0, 0, 1, 2}, was[12], xyz[3] = {0.25, -0.4, 1.1};
        memcpy(was, w2c, sizeof was);
        fs_model_frame_pose(&frame, w2c);
        double pixel[2][2];
        for (int k = 0; k < 2; k++) {
            const double *m = k ? w2c : was;
            double p[3];
            for (int r = 0; r < 3; r++) p[r] = v3_dot(m + 4 * r, xyz) + m[4 * r + 3];
            fs_lens_project(k ? &whole : &lens, (double[2]){p[0] / p[2], p[1] / p[2]}, pixel[k]);
        }
        fs_model_frame_pixel(&frame, &lens, pixel[0]);
        for (int k = 0; k < 2; k++) assert_true(fabs(pixel[0][k] - pixel[1][k]) < 1e-9);
    }
    Photo photo = {.file = "IMG_1.DNG", .orientation = 3, .picture_width = 150, .picture_height = 100};
    Lens lens = {.model = LENS_PINHOLE, .width = 150, .height = 100, .param = {160, 160, 75, 50}};
    assert_int_equal(fs_model_frame(&photo, &lens, "IMG_1.DNG").quarters, 0); // COLMAP turns RAW photos
    assert_int_equal(fs_model_frame(&photo, &lens, "IMG_1.JPG").quarters, 0); // somebody's, upright
    photo.file = "IMG_1.JPG";
    assert_int_equal(fs_model_frame(&photo, &lens, NULL).quarters, 0);
    photo.orientation = 6; // a square says nothing, and what is upright stays so
    photo.picture_width = 100;
    photo.picture_height = 150;
    lens.width = 100;
    lens.height = 150;
    assert_int_equal(fs_model_frame(&photo, &lens, "IMG_1.JPG").quarters, 0);
    photo.orientation = 1;
    photo.orig_width = 200; // smaller pictures of the whole photo
    photo.orig_height = 300;
    ModelFrame frame = fs_model_frame(&photo, &lens, "IMG_1.JPG");
    assert_true(frame.width == 100 && frame.margin[0] == 0 && frame.margin[1] == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_triangulate), cmocka_unit_test(test_far_cameras),
        cmocka_unit_test(test_extent),      cmocka_unit_test(test_nothing_to_triangulate),
        cmocka_unit_test(test_match),       cmocka_unit_test(test_choose),
        cmocka_unit_test(test_refine),      cmocka_unit_test(test_undistort),
        cmocka_unit_test(test_model_frame),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
