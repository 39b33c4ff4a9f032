// Arrays of NumPy: every type, byte order, index order and version, as photos and as poses; what is damaged or hostile.
#include "photos.h"

#include <math.h>
#include <unistd.h>

#include "image/photo.h"
#include "model/cameras_file.h"

enum { H = 4, W = 5 };

static FilePath write_npy(const char *name, int version, const char *header, const void *data, size_t size)
{
    FilePath path = fs_file_at("%s/%s", scratch, name);
    FILE *f = fopen(path.text, "wb");
    size_t n = strlen(header);
    const unsigned char head[12] = {0x93, 'N', 'U', 'M', 'P', 'Y', (unsigned char)version, 0, n & 255, (n >> 8) & 255};
    assert_non_null(f);
    fwrite(head, 1, version == 1 ? 10 : 12, f);
    fwrite(header, 1, n, f);
    if (size) fwrite(data, 1, size, f);
    assert_int_equal(fclose(f), 0);
    return path;
}

static int value_at(int y, int x, int c)
{
    return 7 * y + 2 * x + c - 3; // -3 .. 30
}

// One number as a file has it.
static void put(unsigned char *to, char kind, int size, bool big, int v)
{
    union {
        int64_t i;
        float f;
        double d;
        unsigned char byte[8];
    } u = {.i = v};
    if (kind == 'f' && size == 4) u.f = (float)v;
    if (kind == 'f' && size == 8) u.d = v;
    if (kind == 'f' && size == 2) { // all are whole and small
        int e = 0, m = abs(v);
        while (m >> (e + 1)) e++;
        u.i = v == 0 ? 0 : (v < 0 ? 0x8000 : 0) | (e + 15) << 10 | ((m << (10 - e)) & 0x3ff);
    }
    for (int k = 0; k < size; k++) to[k] = u.byte[big ? size - 1 - k : k];
}

static FilePath write_photo(const char *type, bool fortran, int version)
{
    unsigned char data[H * W * 3 * 8];
    char header[200];
    int size = type[2] - '0';
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            for (int c = 0; c < 3; c++) {
                int at = fortran ? y + H * (x + W * c) : c + 3 * (x + W * y), v = value_at(y, x, c);
                put(data + at * size, type[1], size, type[0] == '>', type[1] == 'u' ? v + 3 : v);
            }
    snprintf(header, sizeof header, "{'descr': '%s', 'fortran_order': %s, 'shape': (%d, %d, 3), }   \n", type,
             fortran ? "True" : "False", H, W);
    return write_npy("a.npy", version, header, data, (size_t)(H * W * 3 * size));
}

static void test_types(void **state)
{
    (void)state;
    static const char *const types[] = {"|i1", "|u1", "<i2", ">i2", "<u2", ">u2", "<i4", ">i4",
                                        "<u4", ">u4", "<f2", ">f2", "<f4", ">f4", "<f8", ">f8"};
    FsError err = {0};
    for (int k = 0; k < 3 * 16 * 2; k++) {
        const char *type = types[k % 16];
        NpyArray a;
        FilePath path = write_photo(type, k / 16 % 2, 1 + k / 32);
        if (fs_npy_read(path.text, &a, &err) != 0) fail_msg("%s: %s", type, err.message);
        assert_int_equal(a.n_dims, 3);
        for (size_t y = 0; y < H; y++)
            for (size_t x = 0; x < W; x++)
                for (size_t c = 0; c < 3; c++) {
                    const char *at = a.data + y * a.stride[0] + x * a.stride[1] + c * a.stride[2];
                    double want = value_at((int)y, (int)x, (int)c) + (type[1] == 'u' ? 3 : 0);
                    if (fs_npy_value(&a, at) != want) fail_msg("%s: %g, expected %g", type, fs_npy_value(&a, at), want);
                }
        fs_npy_free(&a);
    }
}

static void test_photo(void **state)
{
    (void)state;
    const SensorLevels levels = {{2, 1, 0.5}, -3, 27};
    PhotoSizes sizes = {.n = 1};
    PhotoLight light;
    ExifInfo exif;
    FsError err = {0};
    double wb[3], memory = 0;
    FilePath path = write_photo("<i2", false, 1);
    if (fs_photo_read_info(path.text, &exif, wb, &memory, &err) != 0) fail_msg("%s", err.message);
    assert_true(exif.width == W && exif.height == H && exif.flash == -1 && exif.orientation == 1 && memory > 0);
    if (fs_photo_read(path.text, &levels, &sizes, &light, &err) != 0) fail_msg("%s", err.message);
    assert_int_equal(light, PHOTO_LIGHT);
    for (int i = 0; i < H * W; i++) {
        bool full = false; // or near one that is
        for (int k = 0; k < H * W; k++)
            for (int c = 0; c < 3; c++)
                full |= abs(i / W - k / W) + abs(i % W - k % W) <= 2 && value_at(k / W, k % W, c) + 3 >= 0.98 * 30;
        for (int c = 0; c < 3; c++) {
            double value =
                (value_at(i / W, i % W, c) + 3) / 30.0 * levels.gain[c]; // of full ones what all colours have
            assert_float_equal(sizes.size[0].rgb.px[3 * i + c], full ? fmin(value, 0.5) : value, 1e-6);
        }
        assert_int_equal(sizes.size[0].clipped.px[i], full);
    }
    fs_sizes_free(&sizes);
    // another name does not hide it, and levels of another camera are found out
    FilePath other = fs_file_at("%s/a.png", scratch);
    assert_int_equal(rename(path.text, other.text), 0);
    assert_int_equal(fs_photo_kind_inside(other.text), PHOTO_NPY);
    const SensorLevels wrong = {{1, 1, 1}, 2045, 15092};
    assert_int_equal(fs_photo_read(other.text, &wrong, &sizes, &light, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, "--npy-black"));
}

static void test_hostile(void **state)
{
    (void)state;
    static const struct {
        int version;
        const char *header, *words;
    } cases[] = {
        {4, "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2, 3), }\n", "version"},
        {1, "{'descr': '|O', 'fortran_order': False, 'shape': (2, 2, 3), }\n", "expected integers"},
        {1, "{'descr': '<i8', 'fortran_order': False, 'shape': (2, 2, 3), }\n", "expected integers"},
        {1, "{'descr': '<c8', 'fortran_order': False, 'shape': (2, 2, 3), }\n", "expected integers"},
        {1, "{'descr': [('a', '|u1')], 'fortran_order': False, 'shape': (2, 2, 3), }\n", "none of numbers"},
        {1, "{'descr': '|u1', 'shape': (2, 2, 3), }\n", "fortran_order"},
        {1, "{'descr': '|u1', 'fortran_order': False, }\n", "shape"},
        {1, "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2, 3\n", "list"},
        {1, "{'descr': '|u1', 'fortran_order': False, 'shape': (0, 2, 3), }\n", "above 0"},
        {1, "{'descr': '|u1', 'fortran_order': False, 'shape': (-2, 2, 3), }\n", "above 0"},
        {1, "{'descr': '|u1', 'fortran_order': False, 'shape': (), }\n", "no array"},
        {1, "{'descr': '|u1', 'fortran_order': False, 'shape': (1, 1, 1, 2, 6), }\n", "too many"},
        {1, "{'descr': '|u1', 'fortran_order': False, 'shape': (4294967296, 4294967296, 3), }\n", "beyond"},
        {2, "{'descr': '|u1', 'fortran_order': False, 'shape': (99999999999999999999, 2, 3), }\n", "above 0"},
        {1, "{'descr': '|u1', 'fortran_order': False, 'shape': (20000, 20000, 3), }\n", "cut short"},
        {1, "{'descr': '|u1', 'fortran_order': False, 'shape': (1, 2, 3), }\n", "cut short or damaged"},
        {1, "{'descr': '|u1', 'fortran_order': False, 'shape': (3, 4), }\n", "expected a photo"},
        {1, "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3, 2), }\n", "expected a photo"},
        {1, "", "type"},
    };
    const SensorLevels levels = {{1, 1, 1}, 0, 10};
    PhotoSizes sizes = {.n = 1};
    PhotoLight light;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        FsError err = {0};
        FilePath path = write_npy("h.npy", cases[i].version, cases[i].header, "\1\2\3\4\5\6\7\1\1\1\1\1", 12);
        int rc = fs_photo_read(path.text, &levels, &sizes, &light, &err);
        if (rc != FS_ERR_INPUT || !strstr(err.message, cases[i].words) || !strstr(err.message, path.text))
            fail_msg("%s: %d %s", cases[i].header, rc, err.message);
    }
    static const double one[3] = {NAN, INFINITY, -INFINITY};
    FsError err = {0};
    FilePath path = write_npy("n.npy", 1, "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1, 3), }\n", one, 24);
    const SensorLevels low = {{1, 1, 1}, -1e9, 10};
    if (fs_photo_read(path.text, &low, &sizes, &light, &err) == 0) {
        for (int c = 0; c < 3; c++) assert_true(isfinite(sizes.size[0].rgb.px[c]));
        assert_int_equal(sizes.size[0].clipped.px[0], 1);
        fs_sizes_free(&sizes);
    }
    for (int size = 0; size < 12; size++) { // any beginning
        assert_int_equal(truncate(path.text, 11 - size), 0);
        assert_int_equal(fs_photo_read(path.text, &low, &sizes, &light, &err), FS_ERR_INPUT);
    }
}

// ---- poses_bounds.npy ----

#define BOUNDS "{'descr': '<f8', 'fortran_order': False, 'shape': (%d, %d), }\n"

static FilePath write_bounds(int rows, int columns, const double *value)
{
    char header[120];
    snprintf(header, sizeof header, BOUNDS, rows, columns);
    return write_npy("scene/poses_bounds.npy", 1, header, value, sizeof *value * (size_t)(rows * columns));
}

static void put_files(const char *folder, const char *const *name)
{
    fs_file_remove_tree(temp("scene"));
    assert_int_equal(fs_file_mkdirs(temp(folder), NULL), 0);
    for (; *name; name++) {
        FILE *f = fopen(fs_file_at("%s/%s/%s", scratch, folder, *name).text, "wb");
        assert_true(f && fclose(f) == 0);
    }
}

static void test_bounds(void **state)
{
    (void)state;
    // down = y, right = x, backward = -z of the world: a camera that looks along z; the second looks along x
    const double rows[2][17] = {{0, 1, 0, 1, 400, 1, 0, 0, 2, 600, 0, 0, -1, 3, 500, 0.5, 9},
                                {0, 0, -1, 1, 400, 1, 0, 0, 2, 600, 0, -1, 0, 3, 500, 0.5, 9}};
    static const char *const names[] = {"b_flash.JPG", "a_noflash.png", "notes.txt", NULL};
    CamerasFile file;
    FsError err = {0};
    for (int beside = 0; beside < 2; beside++) {
        put_files(beside ? "scene/images_npy" : "scene/images", names);
        FilePath path = write_bounds(2, 17, rows[0]);
        if (fs_cameras_file_read(beside ? path.text : temp("scene"), &file, &err) != 0) fail_msg("%s", err.message);
        assert_int_equal(file.views.n, 2);
        for (int i = 0; i < 2; i++) {
            const View *view = &file.views.view[i];
            double pixel[2], world[3] = {i ? 6 : 1, 2, i ? 3 : 8}, z; // 5 before the camera
            assert_string_equal(view->name, i ? "b_flash" : "a_noflash");
            assert_true(view->camera.width == 600 && view->camera.height == 400 && view->camera.fx == 500);
            z = fs_camera_project(&view->camera, world, pixel);
            assert_float_equal(z, 5, 1e-9);
            assert_float_equal(pixel[0], 300, 1e-9);
            world[1] += 1; // down
            fs_camera_project(&view->camera, world, pixel);
            assert_float_equal(pixel[1], 300, 1e-9);
        }
        fs_cameras_file_free(&file);
    }
    const struct {
        int rows, columns, at;
        double value;
        const char *words;
    } bad[] = {{2, 17, 0, NAN, "finite"}, {2, 17, 4, 0, "pixels"},     {2, 17, 9, 1e6, "pixels"},
               {2, 17, 14, -1, "focal"},  {2, 17, 1, 0.5, "rotation"}, {2, 16, 0, 0, "rotation"},
               {1, 17, 0, 0, "2"},        {2, 12, 0, 0, "a row of 17"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        double damaged[34];
        memcpy(damaged, rows, sizeof damaged);
        damaged[bad[i].at] = bad[i].value;
        FilePath path = write_bounds(bad[i].rows, bad[i].columns, damaged);
        int rc = fs_cameras_file_read(path.text, &file, &err);
        if (rc != FS_ERR_INPUT || !strstr(err.message, bad[i].words)) fail_msg("%zu: %d %s", i, rc, err.message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_types), cmocka_unit_test(test_photo),
                                       cmocka_unit_test(test_hostile), cmocka_unit_test(test_bounds)};
    return cmocka_run_group_tests(tests, make_scratch, drop_scratch);
}
