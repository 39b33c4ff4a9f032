// Our PLY: round trip bit by bit, and files that are cut off, lie or hold NaN.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "model/cloud.h"
#include "temp_dir.h"

static void make_cloud(Cloud *cloud, int n, int color_width, int gain_width)
{
    Rng rng = fs_rng_new(7);
    assert_int_equal(fs_cloud_new(cloud, n, color_width, gain_width, NULL), 0);
    assert_int_equal(fs_cloud_covers(cloud, gain_width && n != 5, NULL), 0);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int i = 0; i < n * cloud->width[f]; i++)
            cloud->field[f][i] = fs_rng_normal(&rng) * expf(8.0f * fs_rng_normal(&rng));
    if (n > 1) cloud->field[0][0] = -0.0f, cloud->field[0][1] = 0x1p-149f;
}

static void assert_same(const Cloud *a, const Cloud *b)
{
    assert_int_equal(a->n, b->n);
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        assert_int_equal(a->width[f], b->width[f]);
        if (a->n && a->width[f])
            assert_memory_equal(a->field[f], b->field[f], sizeof(float) * (size_t)(a->n * a->width[f]));
    }
}

static void test_round_trip(void **state)
{
    static const struct {
        int n, color, gain;
    } kinds[] = {{0, 3, 0}, {1, 1, 0}, {5, 3, 1}, {4096, 3, 0}, {9001, 3, 1}};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        Cloud a, b;
        char *path = fs_file_path("%s/%zu.ply", (char *)*state, k);
        make_cloud(&a, kinds[k].n, kinds[k].color, kinds[k].gain);
        assert_int_equal(fs_cloud_ply_write(&a, path, NULL), 0);
        assert_int_equal(fs_cloud_ply_read(&b, path, NULL), 0);
        assert_same(&a, &b);
        fs_cloud_free(&a);
        fs_cloud_free(&b);
        free(path);
    }
}

// Reads `data` as a PLY file: the error code, after checking that the error names the file and the cloud is empty.
static int read_bytes(const char *dir, const char *data, size_t size, FsError *err)
{
    char *path = fs_file_path("%s/try.ply", dir);
    Cloud cloud;
    FILE *f = fopen(path, "wb"); // not fs_file_write: it waits for the disk, and there are hundreds of files here
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
    int rc = fs_cloud_ply_read(&cloud, path, err);
    if (rc < 0) {
        assert_non_null(strstr(err->message, path));
        assert_null(strchr(err->message, '\n'));
        assert_int_equal(cloud.n, 0);
        assert_null(cloud.field[0]);
    }
    fs_cloud_free(&cloud);
    free(path);
    return rc;
}

static void test_every_truncation(void **state)
{
    char *path = fs_file_path("%s/whole.ply", (char *)*state), *data;
    size_t size;
    Cloud a;
    FsError err;
    make_cloud(&a, 3, 3, 1);
    assert_int_equal(fs_cloud_ply_write(&a, path, NULL), 0);
    assert_int_equal(fs_file_read(path, 1 << 20, &data, &size, NULL), 0);
    assert_int_equal(read_bytes(*state, data, size, &err), 0);
    for (size_t n = 0; n < size; n++) assert_int_equal(read_bytes(*state, data, n, &err), FS_ERR_INPUT);
    char *longer = calloc(1, size + 4);
    memcpy(longer, data, size);
    assert_int_equal(read_bytes(*state, longer, size + 4, &err), FS_ERR_INPUT);
    free(longer);
    free(data);
    free(path);
    fs_cloud_free(&a);
}

static void test_not_finite(void **state)
{
    static const float bad[] = {NAN, INFINITY, -INFINITY};
    char *path = fs_file_path("%s/nan.ply", (char *)*state);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int k = 0; k < 3; k++) {
            Cloud a, b;
            FsError err;
            make_cloud(&a, 4, 3, 1);
            a.field[f][2 * a.width[f]] = bad[k];
            assert_int_equal(fs_cloud_ply_write(&a, path, NULL), 0);
            assert_int_equal(fs_cloud_ply_read(&b, path, &err), FS_ERR_INPUT);
            assert_non_null(strstr(err.message, "Gaussian 2"));
            assert_non_null(strstr(err.message, fs_cloud_fields[f].ply[0]));
            fs_cloud_free(&a);
        }
    free(path);
}

#define HEAD "ply\nformat binary_little_endian 1.0\n"
#define PROPERTIES                                                                                                     \
    "property float x\nproperty float y\nproperty float z\nproperty float scale_0\nproperty float scale_1\n"           \
    "property float scale_2\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n" \
    "property float opacity\nproperty float color_0\n"

static void test_lying_headers(void **state)
{
    static const char *const bad[] = {
        "",
        "plyx\n",
        "ply\nformat ascii 1.0\nelement vertex 0\n" PROPERTIES "end_header\n",
        "ply\nformat binary_big_endian 1.0\nelement vertex 0\n" PROPERTIES "end_header\n",
        HEAD "end_header\n",
        HEAD "element vertex -1\n" PROPERTIES "end_header\n",
        HEAD "element vertex 1\n" PROPERTIES "end_header\n",
        HEAD "element vertex 2147483647\n" PROPERTIES "end_header\n",
        HEAD "element vertex 2147483648\n" PROPERTIES "end_header\n",
        HEAD "element vertex 99999999999999999999999999\n" PROPERTIES "end_header\n",
        HEAD "element vertex x\n" PROPERTIES "end_header\n",
        HEAD "element vertex 0\nelement face 0\n" PROPERTIES "end_header\n",
        HEAD "element face 0\n" PROPERTIES "end_header\n",
        HEAD PROPERTIES "element vertex 0\nend_header\n",
        HEAD "element vertex 0\n" PROPERTIES "property float x\nend_header\n",
        HEAD "element vertex 0\n" PROPERTIES "property float color_1\nend_header\n",
        HEAD "element vertex 0\n" PROPERTIES "property list uchar int vertex_indices\nend_header\n",
        HEAD "element vertex 0\n" PROPERTIES "property double more\nend_header\n",
        HEAD "element vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        HEAD "element vertex 0\n" PROPERTIES "nonsense\nend_header\n",
    };
    FsError err;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(read_bytes(*state, bad[i], strlen(bad[i]), &err), FS_ERR_INPUT);
    static const char good[] = HEAD "comment any\nelement vertex 0\n" PROPERTIES "property float unknown\nend_header\n";
    assert_int_equal(read_bytes(*state, good, sizeof good - 1, &err), 0);
    // A header without end, and a line without end.
    size_t size = 3 << 20;
    char *endless = malloc(size);
    memset(endless, 'c', size);
    assert_int_equal(read_bytes(*state, endless, size, &err), FS_ERR_INPUT);
    memcpy(endless, HEAD, sizeof HEAD - 1);
    for (size_t i = sizeof HEAD - 1; i + 8 <= size; i += 8) memcpy(endless + i, "comment\n", 8);
    assert_int_equal(read_bytes(*state, endless, size, &err), FS_ERR_INPUT);
    free(endless);
}

// Order in the file is free: properties are found by name.
static void test_any_order(void **state)
{
    static const char head[] = HEAD "element vertex 1\nproperty float opacity\nproperty float color_0\n"
                                    "property float rot_3\nproperty float rot_2\nproperty float rot_1\n"
                                    "property float rot_0\nproperty float nx\nproperty float32 z\nproperty float y\n"
                                    "property float x\nproperty float scale_2\nproperty float scale_1\n"
                                    "property float scale_0\nend_header\n";
    char data[sizeof head - 1 + 13 * 4];
    memcpy(data, head, sizeof head - 1);
    for (int i = 0; i < 13; i++) memcpy(data + sizeof head - 1 + 4 * i, &(float){(float)i}, 4);
    char *path = fs_file_path("%s/order.ply", (char *)*state);
    Cloud c;
    assert_int_equal(fs_file_write(path, data, sizeof data, NULL), 0);
    assert_int_equal(fs_cloud_ply_read(&c, path, NULL), 0);
    assert_int_equal(c.width[CLOUD_COLORS], 1);
    assert_true(c.field[CLOUD_OPACITIES][0] == 0 && c.field[CLOUD_COLORS][0] == 1);
    for (int k = 0; k < 4; k++) assert_true(c.field[CLOUD_QUATS][k] == (float)(5 - k));
    for (int k = 0; k < 3; k++) assert_true(c.field[CLOUD_MEANS][k] == (float)(9 - k));
    for (int k = 0; k < 3; k++) assert_true(c.field[CLOUD_SCALES][k] == (float)(12 - k));
    fs_cloud_free(&c);
    free(path);
}

static void test_points(void **state)
{
    char *path = fs_file_path("%s/points.ply", (char *)*state), *data;
    size_t size;
    const float xyz[6] = {1, 2, 3, 4, 5, 6}, value[2] = {0.25f, -1};
    const unsigned char rgb[6] = {10, 20, 30, 40, 50, 255};
    for (int with = 0; with < 2; with++) {
        assert_int_equal(fs_cloud_points_write(path, 2, xyz, rgb, with ? value : NULL, NULL), 0);
        assert_int_equal(fs_file_read(path, 1 << 20, &data, &size, NULL), 0);
        char *body = strstr(data, "end_header\n") + 11;
        size_t row = with ? 19 : 15;
        assert_int_equal(size - (size_t)(body - data), 2 * row);
        assert_non_null(strstr(data, "element vertex 2\n"));
        assert_true(!with == !strstr(data, "property float value\n"));
        assert_memory_equal(body + row, xyz + 3, 12);
        assert_memory_equal(body + row + 12, rgb + 3, 3);
        if (with) assert_memory_equal(body + row + 15, value + 1, 4);
        free(data);
    }
    assert_int_equal(fs_cloud_points_write("/nonexistent/points.ply", 2, xyz, rgb, NULL, NULL), FS_ERR_IO);
    free(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip), cmocka_unit_test(test_every_truncation),
        cmocka_unit_test(test_not_finite), cmocka_unit_test(test_lying_headers),
        cmocka_unit_test(test_any_order),  cmocka_unit_test(test_points),
    };
    return cmocka_run_group_tests(tests, temp_dir_make, temp_dir_remove);
}
