// LPIPS on made-up weights against figures of a numpy program (tests/cli/lpips_numpy.py), and damaged weight files.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "evaluate/conv.h"
#include "evaluate/lpips.h"
#include "temp_dir.h"

// The same numbers as hashed() of lpips_numpy.py.
static void hashed(float *to, size_t n, uint64_t seed, double scale)
{
    for (size_t i = 0; i < n; i++) {
        uint64_t x = ((uint64_t)i + seed * 1000003u) * 2654435761u & 0xffffffffu;
        x ^= x >> 15;
        x = x * 2246822519u & 0xffffffffu;
        to[i] = (float)(((double)(x >> 8) / 16777216.0 - 0.5) * 2 * scale);
    }
}

static const int alex[5][3] = {{64, 3, 11}, {192, 64, 5}, {384, 192, 3}, {256, 384, 3}, {256, 256, 3}};
static const int vgg[13][3] = {{64, 3, 3},    {64, 64, 3},   {128, 64, 3},  {128, 128, 3}, {256, 128, 3},
                               {256, 256, 3}, {256, 256, 3}, {512, 256, 3}, {512, 512, 3}, {512, 512, 3},
                               {512, 512, 3}, {512, 512, 3}, {512, 512, 3}};
static const int lins[2][5] = {{64, 192, 384, 256, 256}, {64, 128, 256, 512, 512}};

static void put_u32(FILE *f, uint32_t v)
{
    assert_int_equal(fwrite(&v, 4, 1, f), 1);
}

static void put_net(FILE *f, const char name[8], const int (*conv)[3], int n, const int *lin)
{
    float *values = malloc(sizeof(float) * 512 * 512 * 9);
    fwrite(name, 1, 8, f);
    for (int i = 0; i < n; i++) {
        size_t in = (size_t)(conv[i][1] * conv[i][2] * conv[i][2]), out = (size_t)conv[i][0];
        put_u32(f, (uint32_t)conv[i][0]), put_u32(f, (uint32_t)conv[i][1]);
        put_u32(f, (uint32_t)conv[i][2]), put_u32(f, (uint32_t)conv[i][2]);
        hashed(values, out * in, 2 * (uint64_t)i + 1, (float)(2.0 / sqrt((double)in)));
        fwrite(values, 4, out * in, f);
        hashed(values, out, 2 * (uint64_t)i + 2, 0.1);
        fwrite(values, 4, out, f);
    }
    for (int i = 0; i < 5; i++) {
        put_u32(f, (uint32_t)lin[i]);
        hashed(values, (size_t)lin[i], 100 + (uint64_t)i, 1);
        for (int k = 0; k < lin[i]; k++) values[k] = fabsf(values[k]);
        fwrite(values, 4, (size_t)lin[i], f);
    }
    free(values);
}

static void make_weights(const char *path, bool both)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fwrite("FSLPIPS1", 1, 8, f);
    put_u32(f, both ? 2 : 1);
    if (both) put_net(f, "vgg\0\0\0\0", vgg, 13, lins[1]);
    put_net(f, "alex\0\0\0", alex, 5, lins[0]);
    assert_int_equal(fclose(f), 0);
}

static void make_pictures(Image *a, Image *b)
{
    assert_int_equal(fs_image_new(a, 52, 37, 3, NULL) | fs_image_new(b, 52, 37, 3, NULL), 0);
    hashed(a->px, 52 * 37 * 3, 201, 0.5);
    hashed(b->px, 52 * 37 * 3, 202, 0.5);
    for (int i = 0; i < 52 * 37 * 3; i++) a->px[i] += 0.5f, b->px[i] = b->px[i] * 0.5f + 0.5f;
}

static void test_distance(void **state)
{
    static const double expected[LPIPS_NETS] = {0.9434557790117879, 0.8014900536254576};
    char *path = fs_file_path("%s/both", (char *)*state);
    Lpips *lpips;
    Image a, b;
    make_weights(path, true);
    make_pictures(&a, &b);
    assert_int_equal(fs_lpips_read(&lpips, path, NULL), 0);
    for (int net = 0; net < LPIPS_NETS; net++) {
        double value[3], same;
        assert_true(fs_lpips_has(lpips, (LpipsNet)net));
        for (int t = 0; t < 3; t++) {
            Threads *threads = t ? fs_threads_new(2 * t) : NULL;
            assert_int_equal(fs_lpips_distance(lpips, (LpipsNet)net, &a, &b, threads, &value[t], NULL), 0);
            fs_threads_free(threads);
        }
        assert_true(value[0] == value[1] && value[0] == value[2]);
        if (!(fabs(value[0] / expected[net] - 1) < 2e-5)) fail_msg("%.9g, expected %.9g", value[0], expected[net]);
        assert_int_equal(fs_lpips_distance(lpips, (LpipsNet)net, &a, &a, NULL, &same, NULL), 0);
        assert_true(same == 0);
    }
    fs_image_free(&a), fs_image_free(&b);
    fs_lpips_free(lpips);
    free(path);
}

// Sizes at the limit: a value from the least size on, none below it, and nothing read out of bounds.
static void test_sizes(void **state)
{
    static const int least[LPIPS_NETS] = {31, 16};
    char *path = fs_file_path("%s/both", (char *)*state);
    Lpips *lpips;
    assert_int_equal(fs_lpips_read(&lpips, path, NULL), 0);
    for (int net = 0; net < LPIPS_NETS; net++)
        for (int less = 0; less < 2; less++) {
            Image a, b;
            double value = -1;
            int side = least[net] - less;
            assert_int_equal(fs_image_new(&a, side, 40, 3, NULL) | fs_image_new(&b, side, 40, 3, NULL), 0);
            a.px[7] = 1;
            assert_int_equal(fs_lpips_distance(lpips, (LpipsNet)net, &a, &b, NULL, &value, NULL), 0);
            assert_true(less ? isnan(value) : value > 0);
            fs_image_free(&a), fs_image_free(&b);
        }
    fs_lpips_free(lpips);
    free(path);
}

// Reads the file as it stands now; the error names it and holds the word.
static void refuse(const char *path, const char *word)
{
    Lpips *lpips = (Lpips *)path;
    FsError err = {0};
    assert_int_equal(fs_lpips_read(&lpips, path, &err), FS_ERR_INPUT);
    assert_null(lpips);
    assert_non_null(strstr(err.message, path));
    if (!strstr(err.message, word)) fail_msg("'%s' lacks '%s'", err.message, word);
}

static void write_bytes(const char *path, const char *data, size_t size)
{
    FILE *f = fopen(path, "wb");
    assert_int_equal(fwrite(data, 1, size, f), size);
    fclose(f);
}

static void test_damaged(void **state)
{
    char *path = fs_file_path("%s/alex", (char *)*state), *bad = fs_file_path("%s/bad", (char *)*state), *data;
    size_t size;
    Lpips *lpips;
    FsError err;
    make_weights(path, false);
    assert_int_equal(fs_lpips_read(&lpips, path, NULL), 0);
    assert_true(fs_lpips_has(lpips, LPIPS_ALEX) && !fs_lpips_has(lpips, LPIPS_VGG));
    fs_lpips_free(lpips);
    assert_int_equal(fs_file_read(path, 1 << 30, &data, &size, NULL), 0);
    for (size_t n = 0; n < 60; n++) write_bytes(bad, data, n), refuse(bad, n < 12 ? "not a file" : "cut off");
    for (size_t at = 0; at < 36; at++) { // any byte before the first weight, but the count
        if (at >= 8 && at < 12) continue;
        data[at] ^= 1;
        write_bytes(bad, data, 1000);
        refuse(bad, at < 8 ? "not a file" : at < 20 ? "expected the networks" : "other shape");
        data[at] ^= 1;
    }
    float values[100];
    memcpy(values, data + 100, 4 * 100);
    values[77] = NAN;
    memcpy(data + 100, values, 4 * 100);
    write_bytes(bad, data, 100000);
    refuse(bad, "not a finite number");
    free(data);
    // The whole file: too long, of the wrong count, the same network twice, and cut off from the end on.
    FILE *f = fopen(path, "ab");
    put_net(f, "alex\0\0\0", alex, 5, lins[0]);
    fclose(f);
    refuse(path, "too many");
    f = fopen(path, "rb+");
    fseek(f, 8, SEEK_SET);
    put_u32(f, 2);
    fclose(f);
    refuse(path, "each once");
    for (size_t n = size - 1; n > size - 6000; n -= 307) {
        assert_int_equal(truncate(path, (off_t)n), 0);
        refuse(path, "cut off");
    }
    assert_int_equal(fs_lpips_read(&lpips, "/nonexistent", &err), FS_ERR_INPUT);
    free(path), free(bad);
}

// Convolution and pooling against the sums written out, at awkward sizes.
static void test_convolution(void **state)
{
    (void)state;
    static const ConvShape shapes[] = {
        {3, 7, 11, 4, 2}, {5, 13, 3, 1, 1}, {2, 1, 5, 1, 2}, {30, 6, 3, 1, 1}, {4, 3, 1, 1, 0}};
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++) {
        const ConvShape *c = &shapes[s];
        Maps in, out;
        int k = c->kernel, height = 19, width = 43;
        float *weight = malloc(sizeof(float) * (size_t)(c->out * c->in * k * k)), bias[16];
        assert_int_equal(fs_conv_maps_new(&in, c->in, height, width, NULL), 0);
        hashed(in.px, (size_t)(c->in * height * width), 1, 1);
        hashed(weight, (size_t)(c->out * c->in * k * k), 2, 1);
        hashed(bias, 16, 3, 1);
        assert_int_equal(fs_conv_relu(c, weight, bias, &in, &out, NULL, NULL), 0);
        assert_int_equal(out.height, (height + 2 * c->pad - k) / c->stride + 1);
        for (int o = 0; o < c->out; o++)
            for (int y = 0; y < out.height; y++)
                for (int x = 0; x < out.width; x++) {
                    double sum = bias[o];
                    for (int i = 0; i < c->in * k * k; i++) {
                        int v = y * c->stride - c->pad + i / k % k, u = x * c->stride - c->pad + i % k;
                        if (v >= 0 && v < height && u >= 0 && u < width)
                            sum +=
                                (double)weight[o * c->in * k * k + i] * in.px[(i / (k * k) * height + v) * width + u];
                    }
                    float found = out.px[(o * out.height + y) * out.width + x];
                    if (!(fabs(found - fmax(sum, 0)) < 2e-5)) fail_msg("shape %zu: %g, expected %g", s, found, sum);
                }
        fs_conv_maps_free(&out);
        assert_int_equal(fs_conv_max_pool(&in, 3, &out, NULL), 0);
        assert_true(out.height == 9 && out.width == 21);
        float most = -9;
        for (int i = 0; i < 9; i++) most = fmaxf(most, in.px[(16 + i / 3) * width + 40 + i % 3]);
        assert_true(out.px[8 * 21 + 20] == most);
        fs_conv_maps_free(&out);
        fs_conv_maps_free(&in);
        free(weight);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_distance), // makes the file that test_sizes reads
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_damaged),
        cmocka_unit_test(test_convolution),
    };
    return cmocka_run_group_tests(tests, temp_dir_make, temp_dir_remove);
}
