// Readers of camera models: files that COLMAP 3.8 wrote, transforms.json, views.json; and files that are wrong.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <cmocka.h>

#include "model/cameras_file.h"
#include "temp_dir.h"

#define DATA TEST_DATA "/colmap"

static void assert_near(double a, double b, double tolerance)
{
    if (!(fabs(a - b) <= tolerance)) print_error("%.17g is not %.17g\n", a, b);
    assert_true(fabs(a - b) <= tolerance);
}

static void put(const char *dir, const char *name, const void *data, size_t size)
{
    char *path = fs_file_path("%s/%s", dir, name);
    FILE *f = fopen(path, "wb"); // not fs_file_write: its syncs make thousands of files slow
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
    free(path);
}

static void put_text(const char *dir, const char *name, const char *text)
{
    put(dir, name, text, strlen(text));
}

static void copy(const char *from, const char *dir, const char *name)
{
    char *path = fs_file_path("%s/%s", from, name), *data;
    size_t size;
    assert_int_equal(fs_file_read(path, 1 << 20, &data, &size, NULL), 0);
    put(dir, name, data, size);
    free(data);
    free(path);
}

static void check_fixture(const ColmapModel *m)
{
    assert_int_equal(m->n_cameras, 2);
    assert_int_equal(m->n_images, 4);
    assert_int_equal(m->n_points, 24);
    const ColmapCamera *c = fs_colmap_model_camera(m, 2);
    assert_non_null(c);
    assert_int_equal(c->lens.model, LENS_OPENCV);
    assert_int_equal(c->lens.width, 640);
    assert_near(c->lens.param[7], -0.0005, 1e-12);
    const ColmapImage *image = &m->image[fs_colmap_model_image(m, 2)];
    assert_string_equal(image->name, "flash/IMG_0003.JPG");
    assert_int_equal(image->n, 24);
    assert_near(image->quat[2], -0.029979022024306478, 1e-15);
    int tracked = 0;
    for (int i = 0; i < m->n_points; i++) {
        const ColmapPoint *p = &m->point[i];
        assert_int_equal(p->n, 3);
        assert_int_equal(p->rgb[1], 2 * (p->id - 1));
        for (int k = 0; k < p->n; k++, tracked++) { // every track element is seen where the camera projects the point
            const ColmapTrack *t = &m->track[p->first + k];
            const ColmapImage *im = &m->image[fs_colmap_model_image(m, t->image_id)];
            const ColmapObservation *o = &m->observation[im->first + (int)t->index];
            assert_int_equal(o->point, p->id);
            double r[9], x[3], pixel[2];
            fs_camera_quat_to_rotation(im->quat, r);
            for (int j = 0; j < 3; j++)
                x[j] = r[3 * j] * p->xyz[0] + r[3 * j + 1] * p->xyz[1] + r[3 * j + 2] * p->xyz[2] + im->t[j];
            fs_lens_project(&fs_colmap_model_camera(m, im->camera_id)->lens, (double[2]){x[0] / x[2], x[1] / x[2]},
                            pixel);
            assert_near(pixel[0], o->x, 1e-5);
            assert_near(pixel[1], o->y, 1e-5);
        }
    }
    assert_int_equal(tracked, 72);
}

static void test_colmap(void **state)
{
    const char *dir = *state;
    ColmapModel m;
    FsError err = {0};
    assert_int_equal(fs_colmap_model_read(DATA "/bin", &m, &err), 0);
    check_fixture(&m);
    char *sub = fs_file_path("%s/sparse/0", dir); // written both ways and read again, found below a project folder
    for (int binary = 0; binary < 2; binary++) {
        ColmapModel again;
        assert_int_equal(fs_colmap_model_write(sub, &m, binary, &err), 0);
        // COLMAP 4 puts these beside; they do not matter
        put_text(sub, binary ? "rigs.bin" : "rigs.txt", binary ? "\x01" : "# Rig calib list\n1 1 CAMERA 1\n");
        put_text(sub, binary ? "frames.bin" : "frames.txt",
                 binary ? "\x01" : "# Frame list\n1 1 1 0 0 0 0 0 0 1 CAMERA 1 1\n");
        assert_int_equal(fs_colmap_model_read(dir, &again, &err), 0);
        check_fixture(&again);
        fs_colmap_model_free(&again);
        fs_file_remove_tree(sub);
    }
    fs_colmap_model_free(&m);
    assert_int_equal(fs_colmap_model_read(DATA "/text", &m, &err), 0);
    check_fixture(&m);
    fs_colmap_model_free(&m);
    free(sub);
}

static void test_views(void **state)
{
    (void)state;
    CamerasFile f;
    assert_int_equal(fs_cameras_file_read(DATA "/bin", &f, NULL), 0);
    assert_int_equal(f.views.n, 4);
    assert_string_equal(f.views.view[0].name, "IMG_0001");
    assert_string_equal(f.views.view[3].name, "IMG_0004.v2");
    assert_int_equal(fs_dataset_find(&f.views, "IMG_0004.v2"), 3);
    assert_int_equal(fs_dataset_find(&f.views, "some/IMG_0003.DNG"), 2);
    assert_int_equal(fs_dataset_find(&f.views, "IMG_0009"), -1);
    assert_int_equal(f.views.view[3].camera.width, 640);
    assert_near(f.views.view[3].camera.fy, 602.25, 0);
    assert_int_equal(f.lens[3].model, LENS_OPENCV);
    assert_string_equal(f.model.image[f.image[2]].name, "flash/IMG_0003.JPG");
    fs_cameras_file_free(&f);
}

// Prefixes of every binary file (all of the short ones) are refused in one line, and so is a count that lies.
static void test_truncated(void **state)
{
    const char *dir = *state;
    static const char *const names[3] = {"cameras.bin", "images.bin", "points3D.bin"};
    for (int i = 0; i < 3; i++) copy(DATA "/bin", dir, names[i]);
    for (int i = 0; i < 3; i++) {
        char *path = fs_file_path(DATA "/bin/%s", names[i]), *data;
        size_t size;
        ColmapModel m;
        assert_int_equal(fs_file_read(path, 1 << 20, &data, &size, NULL), 0);
        for (size_t n = 0; n < size; n += n < 120 ? 1 : 13) {
            FsError err = {0};
            put(dir, names[i], data, n);
            assert_int_equal(fs_colmap_model_read(dir, &m, &err), FS_ERR_INPUT);
            assert_non_null(strstr(err.message, names[i]));
        }
        for (int byte = 0; byte < 8; byte++) {
            FsError err = {0};
            char saved = data[byte];
            data[byte] = (char)0xff;
            put(dir, names[i], data, size);
            assert_int_equal(fs_colmap_model_read(dir, &m, &err), FS_ERR_INPUT);
            data[byte] = saved;
        }
        put(dir, names[i], data, size);
        for (size_t at = 0; at < size; at += 11) { // any byte changed: an answer or an error, no crash
            char saved = data[at];
            data[at] = (char)(saved ^ 0x55);
            put(dir, names[i], data, size);
            CamerasFile f;
            if (fs_cameras_file_read(dir, &f, NULL) == 0) fs_cameras_file_free(&f);
            data[at] = saved;
        }
        put(dir, names[i], data, size);
        free(data);
        free(path);
    }
}

static void assert_refused(const char *path, const char *word)
{
    CamerasFile f;
    FsError err = {0};
    int rc = fs_cameras_file_read(path, &f, &err);
    if (rc == 0 || !strstr(err.message, word)) print_error("expected '%s', got '%s'\n", word, err.message);
    assert_int_equal(rc, FS_ERR_INPUT);
    assert_non_null(strstr(err.message, word));
    assert_null(strchr(err.message, '\n'));
}

static void test_wrong_text(void **state)
{
    const char *dir = *state;
    static const char camera[] = "1 PINHOLE 60 40 50 50 30 20\n", image[] = "1 1 0 0 0 0 0 0 1 a.jpg\n\n";
    static const char *const wrong[][3] = {
        // cameras.txt, images.txt, word in the message
        {"1 PINHOLE 60 40 50 50 30\n", image, "line 1"},
        {"1 PINHOLE 99999999999 40 50 50 30 20\n", image, "width"},
        {"1 BOX 60 40 50 50 30 20\n", image, "camera model"},
        {"1 PINHOLE 60 40 nan 50 30 20\n", image, "not a number"},
        {"1 PINHOLE 60 40 -5 50 30 20\n", image, "focal"},
        {"# nothing\n", image, "0 cameras"},
        {"1 PINHOLE 60 40 50 50 30 20\n1 PINHOLE 60 40 50 50 30 20\n", image, "number 1"},
        {"1 EQUIRECTANGULAR 60 40 1 1\n", image, "EQUIRECTANGULAR"},
        {camera, "1 1 0 0 0 0 0 0 1\n\n", "name"},
        {camera, "1 1 0 0 0 0 nan 0 1 a.jpg\n\n", "finite pose"},
        {camera, "1 0 0 0 0 0 0 0 1 a.jpg\n\n", "finite pose"},
        {camera, "1 1 0 0 0 0 0 0 7 a.jpg\n\n", "camera 7"},
        {camera, "1 1 0 0 0 0 0 0 1 a.jpg\n1 2\n", "X Y POINT3D_ID"},
        {camera, "1 1 0 0 0 0 0 0 1 a.jpg\n\n2 1 0 0 0 0 0 0 1 a.png\n\n", "'a'"},
        {camera, "-1 1 0 0 0 0 0 0 1 a.jpg\n\n", "number"},
        {camera, "", "0 images"},
        {camera,
         "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
         "#   POINTS2D[] as (X, Y, POINT3D_ID)\n# Number of images: 30, mean observations per image: 0\n"
         "1 1 0 0 0 0 0 0 1 a.jpg\n\n",
         "cut short: its header says 30 records, found 1"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        put_text(dir, "cameras.txt", wrong[i][0]);
        put_text(dir, "images.txt", wrong[i][1]);
        if (i == 13) { // the colliding name is told by its stem
            assert_refused(dir, "a: two views");
            continue;
        }
        assert_refused(dir, wrong[i][2]);
    }
    put_text(dir, "cameras.txt", camera);
    put(dir, "images.txt", "1 1 0 0\0 0 0 0 0 1 a.jpg\n", 25);
    assert_refused(dir, "not a text file");
    put_text(dir, "images.txt", "1 1 0 0 0 0 0 0 1 a b.jpg"); // no end of line, no points line, a space in the name
    CamerasFile f;
    assert_int_equal(fs_cameras_file_read(dir, &f, NULL), 0);
    assert_string_equal(f.views.view[0].name, "a b");
    fs_cameras_file_free(&f);
    put_text(dir, "points3D.txt", "1 nan 0 0 1 2 3 0.5\n");
    assert_refused(dir, "point 1");
    put_text(dir, "points3D.txt", "1 0 0 0 1 2 300 0.5\n");
    assert_refused(dir, "line 1");
    put_text(dir, "points3D.txt", "1 0 0 0 1 2 3 0.5 1\n");
    assert_refused(dir, "POINT2D_IDX");
}

// Names that repeat get their folders, as photos do; of the fourth coefficient more is not read than is known.
static void test_transforms_names(void **state)
{
    char *path = fs_file_path("%s/transforms.json", (char *)*state);
#define FRAME(name) "{\"file_path\": \"" name "\", \"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}"
#define HEAD "{\"w\": 60, \"h\": 40, \"fl_x\": 55, "
    put_text(*state, "transforms.json",
             HEAD "\"is_fisheye\": true, \"k1\": 0.1, \"k4\": 0.2, \"frames\": [" FRAME("./flash/P_1.JPG") "," FRAME(
                 "noflash/P_1.JPG") "," FRAME("noflash/P.2/P_2") "]}");
    CamerasFile f;
    FsError err = {0};
    assert_int_equal(fs_cameras_file_read(path, &f, &err), 0);
    static const char *const names[] = {"flash_P_1", "noflash_P.2_P_2", "noflash_P_1"};
    for (int i = 0; i < 3; i++) assert_string_equal(f.views.view[i].name, names[i]);
    assert_int_equal(f.lens[0].model, LENS_OPENCV_FISHEYE);
    assert_near(f.lens[0].param[7], 0.2, 0);
    fs_cameras_file_free(&f);
    put_text(*state, "transforms.json", HEAD "\"k1\": 0.1, \"k4\": 0.2, \"frames\": [" FRAME("a") "]}");
    assert_refused(path, "k4");
    put_text(*state, "transforms.json",
             HEAD "\"camera_model\": \"FULL_OPENCV\", \"k4\": 0.2, \"frames\": [" FRAME("a") "]}");
    assert_int_equal(fs_cameras_file_read(path, &f, &err), 0);
    assert_int_equal(f.lens[0].model, LENS_FULL_OPENCV);
    assert_near(f.lens[0].param[9], 0.2, 0);
    fs_cameras_file_free(&f);
#undef HEAD
#undef FRAME
    free(path);
}

static void test_transforms(void **state)
{
    char *path = fs_file_path("%s/transforms.json", (char *)*state);
    // a camera at (1, 2, 3) turned by a quarter about y: OpenGL's -z axis, where it looks, is world -x
    put_text(*state, "transforms.json",
             "{\"w\": 60, \"h\": 40, \"fl_x\": 55, \"k1\": 0.125, \"camera_model\": \"OPENCV\", \"frames\": ["
             "{\"file_path\": \"./images/b.png\", \"transform_matrix\": [[0,0,1,1],[0,1,0,2],[-1,0,0,3],[0,0,0,1]]},"
             "{\"file_path\": \"a.png\", \"fl_x\": 70, \"cx\": 31, \"transform_matrix\": "
             "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}");
    CamerasFile f;
    FsError err = {0};
    assert_int_equal(fs_cameras_file_read(path, &f, &err), 0);
    assert_int_equal(f.views.n, 2);
    assert_string_equal(f.views.view[1].name, "b");
    assert_near(f.views.view[0].camera.fx, 70, 0);
    assert_near(f.views.view[0].camera.cx, 31, 0);
    assert_near(f.views.view[1].camera.cy, 20, 0);
    assert_false(fs_lens_is_pinhole(&f.lens[1]));
    double centre[3], pixel[2];
    fs_camera_centre(&f.views.view[1].camera, centre);
    for (int k = 0; k < 3; k++) assert_near(centre[k], k + 1, 1e-12);
    assert_near(fs_camera_project(&f.views.view[1].camera, (double[3]){-1, 2, 3}, pixel), 2, 1e-12); // 2 ahead
    assert_near(pixel[0], 30, 1e-9);
    fs_camera_project(&f.views.view[1].camera, (double[3]){-1, 3, 3}, pixel); // above is up in the picture
    assert_true(pixel[1] < 20);
    fs_camera_project(&f.views.view[1].camera, (double[3]){-1, 2, 2}, pixel); // its x axis is world -z
    assert_true(pixel[0] > 30);
    fs_cameras_file_free(&f);
    assert_int_equal(fs_cameras_file_read(*state, &f, &err), 0); // the folder works as well
    fs_cameras_file_free(&f);

    static const char *const wrong[][2] = {
        {"{\"frames\": [", "not JSON"},
        {"[1, 2]", "\"views\""},
        {"{\"frames\": []}", "\"frames\""},
        {"{\"frames\": [{}]}", "file_path"},
        {"{\"frames\": [{\"file_path\": \"a\"}]}", "\"w\""},
        {"{\"w\": 1e9, \"h\": 5, \"frames\": [{\"file_path\": \"a\"}]}", "\"w\""},
        {"{\"w\": 9, \"h\": 5, \"frames\": [{\"file_path\": \"a\"}]}", "fl_x"},
        {"{\"w\": 9, \"h\": 5, \"camera_angle_x\": 1, \"frames\": [{\"file_path\": \"a\"}]}", "transform_matrix"},
        {"{\"w\": 9, \"h\": 5, \"fl_x\": -3, \"frames\": [{\"file_path\": \"a\", \"transform_matrix\": "
         "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}",
         "focal"},
        {"{\"w\": 9, \"h\": 5, \"fl_x\": 3, \"frames\": [{\"file_path\": \"a\", \"transform_matrix\": "
         "[[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}",
         "rotation"},
        {"{\"w\": 9, \"h\": 5, \"fl_x\": 3, \"frames\": [{\"file_path\": \"a\", \"transform_matrix\": "
         "[[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}",
         "right-handed"},
        {"{\"w\": 9, \"h\": 5, \"fl_x\": 3, \"camera_model\": \"EQUIRECTANGULAR\", \"frames\": [{\"file_path\": "
         "\"a\"}]}",
         "camera_model"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        put_text(*state, "transforms.json", wrong[i][0]);
        assert_refused(path, wrong[i][1]);
    }
    assert_refused("/nonexistent/model", "no such");
    free(path);
}

static void test_sees(void **state)
{
    (void)state;
    const Camera camera = {40, 20, 40, 40, 20, 10, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1}};
    static const double places[][4] = {
        {0, 0, 3, 2},       {0.5, 0.25, 2, 0},  {0.4999, 0.2499, 2, 1}, {-0.5, -0.25, 2, 1}, // the last edge is outside
        {-0.5001, 0, 2, 0}, {0, -0.2501, 2, 0}, {0.5001, 0, 2, 0},      {0, 0.2501, 2, 0},
        {0, 0, 1, 0},       {0, 0, -3, 0},      {NAN, 0, 3, 0},         {0, 0, NAN, 0},
    };
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        double pixel[2], projected[2];
        assert_near(fs_camera_sees(&camera, places[i], pixel), places[i][3], 0);
        if (!(places[i][3] > 0)) continue;
        fs_camera_project(&camera, places[i], projected);
        assert_near(pixel[0], projected[0], 0);
        assert_near(pixel[1], projected[1], 0);
    }
}

static void test_dataset(void **state)
{
    char *path = fs_file_path("%s/views.json", (char *)*state);
    Dataset d = {0}, again;
    View v = {.name = "b",
              .flash = true,
              .camera = {60, 40, 50.1, 50.2, 30.3, 20.4, {1, 0, 0, 1e-17, 0, 1, 0, 2, 0, 0, 1, 1.0 / 3}}};
    assert_int_equal(fs_dataset_append(&d, &v, NULL), 0);
    v.name = "a";
    v.flash = false;
    v.held_out = true;
    assert_int_equal(fs_dataset_append(&d, &v, NULL), 0);
    assert_int_equal(fs_dataset_append(&d, &v, NULL), FS_ERR_INPUT); // twice the same name
    assert_string_equal(d.view[0].name, "a");
    assert_int_equal(fs_dataset_write(&d, path, NULL), 0);
    assert_int_equal(fs_dataset_read(&again, path, NULL), 0);
    assert_int_equal(again.n, 2);
    for (int i = 0; i < 2; i++) {
        assert_string_equal(again.view[i].name, d.view[i].name);
        assert_int_equal(again.view[i].flash, d.view[i].flash);
        assert_int_equal(again.view[i].held_out, d.view[i].held_out);
        assert_memory_equal(&again.view[i].camera, &d.view[i].camera, sizeof d.view[i].camera);
    }
    fs_dataset_free(&again);
    d.view[0].camera.fx = NAN;
    assert_true(fs_dataset_write(&d, path, NULL) < 0);
    fs_dataset_free(&d);
    put_text(*state, "views.json",
             "{\"views\": [{\"name\": \"a\", \"width\": 5, \"height\": 5, \"fx\": 1, \"fy\": 1, \"cx\": 1, "
             "\"cy\": 1, \"w2c\": [[1,0,0,0],[0,1,0,0]]}]}");
    assert_refused(path, "w2c");
    put_text(*state, "views.json", "{\"views\": [{\"name\": \"../a\"}]}");
    assert_refused(path, "name");
    free(path);
}

// Photos are raised so that those to train on reach a brightness, by 16 at most; bright enough ones are left.
static void test_lift(void **state)
{
    char *path = fs_file_path("%s/views.json", (char *)*state);
    Dataset d = {0}, again;
    for (int i = 0; i < 3; i++) {
        View v = {.name = (char *)(const char *[]){"a", "b", "c"}[i],
                  .held_out = i == 2,
                  .brightness = (const double[]){0.4, 0.6, 0.1}[i],
                  .exposure_gain = i == 1 ? 2 : 0,
                  .camera = {3, 2, 5, 5, 1, 1, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}};
        assert_int_equal(fs_dataset_append(&d, &v, NULL), 0);
    }
    assert_int_equal(fs_dataset_write(&d, path, NULL), 0);
    assert_int_equal(fs_dataset_read(&again, path, NULL), 0);
    assert_true(fs_dataset_lift(&d, 0) == 1 && d.view[1].exposure_gain == 2);
    double lift = fs_dataset_lift(&d, 0.6); // from a mean of 0.5
    assert_float_equal(pow(lift, 0.22), 0.6 / 0.5, 1e-6);
    assert_true(d.view[0].exposure_gain == lift && d.view[1].exposure_gain == 2 * lift && d.view[2].lift == lift);
    assert_true(fs_dataset_lift(&again, 0.45) == 1 && again.view[0].lift == 1);
    assert_true(fs_dataset_lift(&again, 1) == 16);

    Image photo, dark;
    assert_int_equal(fs_image_new(&dark, 3, 2, 3, NULL), 0);
    for (size_t i = 0; i < fs_image_values(&dark); i++) dark.px[i] = (float)i / 16;
    assert_int_equal(fs_file_mkdirs(fs_file_at("%s/images", (char *)*state).text, NULL), 0);
    assert_int_equal(fs_tiff_write_float(fs_file_at("%s/images/a.tif", (char *)*state).text, &dark, NULL), 0);
    assert_int_equal(fs_dataset_load_view(*state, &again.view[0], &photo, NULL, NULL), 0);
    for (size_t i = 0; i < fs_image_values(&dark); i++) assert_true(photo.px[i] == (float)i);
    fs_image_free(&photo);
    fs_image_free(&dark);
    fs_dataset_free(&again);
    fs_dataset_free(&d);
    free(path);
}

// Blurred photos are no more trained on, but where they are many of a lighting: one in four.
static void test_blurred(void **state)
{
    char *path = fs_file_path("%s/views.json", (char *)*state), name[2] = "a";
    Dataset made = {0}, d;
    for (int i = 0; i < 16; i++, name[0]++) {
        View v = {.name = name,
                  .flash = i % 2,
                  .held_out = i == 14,
                  .sharpness = i == 0                            ? 0
                               : i == 3 || i == 14 || i % 8 == 2 ? 0.5
                                                                 : 0.6,
                  .camera = {3, 2, 5, 5, 1, 1, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}};
        assert_int_equal(fs_dataset_append(&made, &v, NULL), 0);
    }
    assert_int_equal(fs_dataset_write(&made, path, NULL), 0);
    assert_int_equal(fs_dataset_read(&d, path, NULL), 0);
    assert_int_equal(fs_dataset_leave_blurred(&d, 0.55), 1); // of eight; the others are two of seven
    for (int i = 0; i < 16; i++) assert_int_equal(fs_dataset_trains(&d.view[i]), i != 3 && i != 14);
    assert_int_equal(fs_dataset_leave_blurred(&d, 0), 0);
    assert_true(fs_dataset_trains(&d.view[3]));
    fs_dataset_free(&made);
    fs_dataset_free(&d);
    free(path);
}

// What lies on the border of the photo lies in the wider picture, some of it near its border.
static void check_widening(const Lens *lens)
{
    Camera c;
    assert_int_equal(fs_lens_camera(lens, "", &c, NULL), 0);
    double times = fs_lens_widening(lens, 3), nearest = INFINITY;
    for (int y = 0; y <= 400; y += 10)
        for (int x = 0; x <= 600; x += y == 0 || y == 400 ? 10 : 600) {
            double ray[2];
            assert_true(fs_lens_unproject(lens, (double[2]){x, y}, ray));
            double u = c.fx / times * ray[0] + c.cx, v = c.fy / times * ray[1] + c.cy;
            double in = fmin(fmin(u, 600 - u), fmin(v, 400 - v));
            assert_true(in > -0.2);
            nearest = fmin(nearest, in);
        }
    if (times > 1) assert_true(nearest < 0.2);
    if (fs_lens_is_pinhole(lens)) assert_true(times == 1);
    if (lens->model == LENS_OPENCV || lens->model == LENS_OPENCV_FISHEYE) assert_true(times > 1.02);
    assert_true(fs_lens_widening(lens, 1.01) == fmin(times, 1.01));
}

static void test_lenses(void **state)
{
    (void)state;
    static const double extra[LENS_MODELS][12] = {
        [LENS_SIMPLE_RADIAL] = {-0.1},
        [LENS_RADIAL] = {0.1, -0.02},
        [LENS_OPENCV] = {-0.1, 0.02, 0.001, -0.002},
        [LENS_OPENCV_FISHEYE] = {0.05, -0.01, 0.002, 0.001},
        [LENS_FULL_OPENCV] = {0.1, 0.02, 0.001, 0.002, 0.01, 0.05, 0.01, 0.003},
        [LENS_FOV] = {0.6},
        [LENS_SIMPLE_RADIAL_FISHEYE] = {0.03},
        [LENS_RADIAL_FISHEYE] = {0.03, -0.01},
        [LENS_THIN_PRISM_FISHEYE] = {0.05, -0.01, 0.001, 0.002, 0.001, 0.0005, 0.002, 0.001}};
    for (int m = 0; m < LENS_MODELS; m++) {
        int n;
        assert_int_equal(fs_lens_model_find(fs_lens_model_name(m, &n)), m);
        int focal = m == LENS_SIMPLE_PINHOLE || m == LENS_SIMPLE_RADIAL || m == LENS_RADIAL ||
                            m == LENS_SIMPLE_RADIAL_FISHEYE || m == LENS_RADIAL_FISHEYE
                        ? 1
                        : 2;
        Lens lens = {.model = m, .width = 600, .height = 400, .param = {500, 510, 310, 190}};
        if (focal == 1) lens.param[1] = 310, lens.param[2] = 190;
        for (int k = 0; k < n - focal - 2; k++) lens.param[focal + 2 + k] = extra[m][k];
        assert_int_equal(fs_lens_is_pinhole(&lens), m <= LENS_PINHOLE);
        Lens half = fs_lens_resized(&lens, 300, 200);
        for (int y = 0; y <= 400; y += 50)
            for (int x = 0; x <= 600; x += 50) { // there and back, and at half the size
                double ray[2], pixel[2];
                assert_true(fs_lens_unproject(&lens, (double[2]){x, y}, ray));
                fs_lens_project(&lens, ray, pixel);
                assert_near(pixel[0], x, 1e-6);
                assert_near(pixel[1], y, 1e-6);
                fs_lens_project(&half, ray, pixel);
                assert_near(pixel[0], 0.5 * x, 1e-6);
            }
        check_widening(&lens);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_colmap, temp_dir_make, temp_dir_remove),
        cmocka_unit_test(test_views),
        cmocka_unit_test_setup_teardown(test_truncated, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_wrong_text, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_transforms, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_transforms_names, temp_dir_make, temp_dir_remove),
        cmocka_unit_test(test_sees),
        cmocka_unit_test_setup_teardown(test_dataset, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_lift, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(test_blurred, temp_dir_make, temp_dir_remove),
        cmocka_unit_test(test_lenses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
