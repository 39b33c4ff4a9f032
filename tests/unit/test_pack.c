// What the viewer gets: numbers come back within their steps, Gaussians keep their shape, and a scene is small.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/rng.h"
#include "model/camera.h"
#include "report/pack.h"
#include "report/text7.h"

static const double centre[3] = {0.3, -0.2, 1};

// Like a trained one: on a wavy wall with some of it far behind. turned: how far from upright; 3: any way.
static void make_cloud(Cloud *cloud, int n, int colors, int gains, float turned)
{
    Rng rng = fs_rng_new(7);
    assert_int_equal(fs_cloud_new(cloud, n, colors, gains, NULL), 0);
    for (int i = 0; i < n; i++) {
        float grey = 0.5f + 0.15f * fs_rng_normal(&rng);
        float *mean = cloud->field[CLOUD_MEANS] + 3 * i;
        mean[0] = 3 * fs_rng_uniform(&rng) - 1.5f;
        mean[1] = 2 * fs_rng_uniform(&rng) - 1;
        mean[2] = 3 + 0.2f * sinf(5 * mean[0]) + (i % 9 ? 0.01f : 4) * fs_rng_normal(&rng);
        for (int k = 0; k < 3; k++) cloud->field[CLOUD_SCALES][3 * i + k] = -4.6f + 0.7f * fs_rng_normal(&rng);
        for (int k = 0; k < 4; k++) cloud->field[CLOUD_QUATS][4 * i + k] = (k ? 0 : 1) + turned * fs_rng_normal(&rng);
        cloud->field[CLOUD_OPACITIES][i] = i % 50 ? 1.3f * fs_rng_normal(&rng) : -8;
        for (int k = 0; k < colors; k++)
            cloud->field[CLOUD_COLORS][colors * i + k] = grey + 0.04f * fs_rng_normal(&rng);
        for (int k = 0; k < gains; k++) cloud->field[CLOUD_GAINS][i] = 0.4f * fs_rng_normal(&rng);
    }
}

static double value_of(const Pack *p, const PackRange *r, int plane, int i)
{
    return r->low + (r->high - r->low) * p->byte[(size_t)plane * (size_t)p->n + (size_t)i] / ((1 << r->bits) - 1);
}

typedef struct Got {
    double mean[3], cov[9], opacity, color[3], gain, cover;
} Got;

static void covariance(const double q[4], const double size[3], double cov[9])
{
    double r[9];
    fs_camera_quat_to_rotation(q, r);
    memset(cov, 0, 9 * sizeof *cov);
    for (int i = 0; i < 9; i++)
        for (int k = 0; k < 3; k++) cov[i] += r[3 * (i / 3) + k] * r[3 * (i % 3) + k] * exp(2 * size[k]);
}

static void unpack_one(const Pack *p, int i, int at[3], Got *got)
{
    double q[4] = {1}, size[3];
    for (int k = 0; k < 3; k++) {
        int zigzag = p->byte[2 * k * p->n + i] << 8 | p->byte[(2 * k + 1) * p->n + i];
        at[k] += zigzag & 1 ? -(zigzag + 1) / 2 : zigzag / 2;
        double u = p->low[k] + p->step * at[k];
        got->mean[k] = p->centre[k] + copysign(p->reach * expm1(fabs(u)), u);
        size[k] = value_of(p, &p->size, 6 + k, i);
        q[1 + k] = value_of(p, &p->turn, 9 + k, i);
        q[0] -= q[1 + k] * q[1 + k];
    }
    q[0] = sqrt(fmax(q[0], 0));
    covariance(q, size, got->cov);
    got->opacity = pow(value_of(p, &p->opacity, 12, i), 2);
    int green = p->byte[13 * p->n + i];
    for (int k = 0; k < p->colors; k++) {
        int n = k == (p->colors == 3) ? green : green + (signed char)p->byte[(k ? 15 : 14) * p->n + i];
        got->color[k] = p->color.low + (p->color.high - p->color.low) * n / ((1 << p->color.bits) - 1);
    }
    if (p->gains) got->gain = value_of(p, &p->gain, 13 + p->colors, i);
    if (p->covers) got->cover = value_of(p, &p->cover, 14 + p->colors, i);
}

static double distance_of(const float *mean, const double to[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += pow((double)mean[k] - to[k], 2);
    return sqrt(sum);
}

static void check_one(const Cloud *cloud, int j, const Pack *p, const Got *got)
{
    double q[4], size[3], cov[9], given[3], error = 0, norm = 0;
    for (int k = 0; k < 4; k++) q[k] = (double)cloud->field[CLOUD_QUATS][4 * j + k];
    for (int k = 0; k < 3; k++) given[k] = size[k] = (double)cloud->field[CLOUD_SCALES][3 * j + k];
    for (int k = 0; k < 3; k++) size[k] = fmax(given[k], p->size.low);
    covariance(q, size, cov);
    for (int k = 0; k < 9; k++) error += pow(cov[k] - got->cov[k], 2), norm += cov[k] * cov[k];
    assert_true(sqrt(error / norm) < 0.35);
    double opacity = 1 / (1 + exp(-(double)cloud->field[CLOUD_OPACITIES][j]));
    assert_true(fabs(sqrt(opacity) - sqrt(got->opacity)) <= 0.51 / ((1 << p->opacity.bits) - 1));
    for (int k = 0; k < p->colors; k++) {
        double step = (p->color.high - p->color.low) / ((1 << p->color.bits) - 1);
        assert_true(fabs((double)cloud->field[CLOUD_COLORS][p->colors * j + k] - got->color[k]) <= 0.51 * step);
    }
    if (p->gains)
        assert_true(fabs((double)cloud->field[CLOUD_GAINS][j] - got->gain) < (p->gain.high - p->gain.low) / 120);
    assert_int_equal(p->covers, p->gains);
    if (p->covers) assert_true(fabs((double)cloud->field[CLOUD_COVERS][j] - got->cover) < 1 / 120.0);
}

// The one nearest to what was unpacked is the one that was packed: within half a step in each direction.
static void check(int n, int colors, int gains)
{
    Cloud cloud = {0};
    Pack pack = {0};
    int at[3] = {0}, drawn = 0;
    make_cloud(&cloud, n, colors, gains, 3);
    assert_int_equal(fs_cloud_covers(&cloud, gains, NULL), 0);
    for (int i = 0; i < n && gains; i++) cloud.field[CLOUD_COVERS][i] = (float)(i % 8) / 7;
    for (int i = 0; i < n; i++) drawn += cloud.field[CLOUD_OPACITIES][i] > -5.53f;
    assert_int_equal(fs_pack_cloud(&cloud, centre, &pack, NULL), 0);
    assert_int_equal(pack.n, drawn);
    for (int i = 0; i < pack.n; i++) {
        Got got = {0};
        int nearest = 0;
        unpack_one(&pack, i, at, &got);
        if (i % 37) continue;
        for (int j = 1; j < n; j++)
            if (distance_of(cloud.field[CLOUD_MEANS] + 3 * j, got.mean) <
                distance_of(cloud.field[CLOUD_MEANS] + 3 * nearest, got.mean))
                nearest = j;
        double off = distance_of(cloud.field[CLOUD_MEANS] + 3 * nearest, got.mean);
        double away = distance_of(cloud.field[CLOUD_MEANS] + 3 * nearest, centre);
        assert_true(off <= pack.step * (pack.reach + away));
        check_one(&cloud, nearest, &pack, &got);
    }
    fs_pack_free(&pack);
    fs_cloud_free(&cloud);
}

static void test_comes_back(void **state)
{
    (void)state;
    check(3000, 3, 1);
    check(3000, 3, 0);
    check(500, 1, 0);
    check(1, 3, 1);
}

static void test_nothing(void **state)
{
    (void)state;
    Cloud cloud = {0};
    Pack pack;
    assert_int_equal(fs_cloud_new(&cloud, 0, 3, 0, NULL), 0);
    assert_int_equal(fs_pack_cloud(&cloud, centre, &pack, NULL), 0);
    assert_int_equal(pack.n, 0);
    fs_pack_free(&pack);
    fs_cloud_free(&cloud);
}

// ---- the text ----

static int unescape(const char **p)
{
    int c = (unsigned char)*(*p)++;
    if (c != '\\') return c;
    c = *(*p)++;
    if (c == 'x') {
        unsigned code;
        assert_int_equal(sscanf(*p, "%2x", &code), 1);
        *p += 2;
        return (int)code;
    }
    return c == '0' ? 0 : c == 'n' ? '\n' : c == 'r' ? '\r' : c;
}

static long text_of(const TextChunk *chunk, int chunks, char **text)
{
    size_t size;
    FILE *f = open_memstream(text, &size);
    assert_non_null(f);
    assert_int_equal(fs_text7_write(f, chunk, chunks, NULL), 0);
    fclose(f);
    return (long)size;
}

static void test_text(void **state)
{
    (void)state;
    enum { N = 200000 };
    static unsigned char data[N], packed[2 * N], back[N];
    Rng rng = fs_rng_new(3);
    for (int i = 0; i < N; i++) data[i] = i < N / 2 ? (unsigned char)(256 * fs_rng_uniform(&rng)) : 0;
    TextChunk chunk[] = {{data, 70001}, {data + 70001, 0}, {data + 70001, N - 70001}};
    char *text;
    long size = text_of(chunk, 3, &text);
    assert_true(size < 1.21 * (N / 2 + 400)); // 8 / 7 and the escapes; nothing to speak of for the zeros
    uint32_t bits = 0;
    size_t have = 0, n = 0;
    const char *p = text + 1;
    while (p < text + size - 1) {
        assert_true((unsigned char)*p < 128 && *p != '"' && *p != '\n' && *p != '\r' && *p != 0);
        bits |= (uint32_t)unescape(&p) << have;
        for (have += 7; have >= 8; have -= 8, bits >>= 8) packed[n++] = (unsigned char)bits;
    }
    assert_int_equal(*p, '"');
    uLongf length = N;
    assert_int_equal(uncompress(back, &length, packed, n), Z_OK);
    assert_int_equal(length, N);
    assert_memory_equal(back, data, N);
    free(text);
}

static void test_small(void **state)
{
    (void)state;
    for (int n = 16000; n <= 64000; n *= 4) {
        Cloud cloud = {0};
        Pack pack = {0};
        make_cloud(&cloud, n, 3, 1, 0.07f);
        assert_int_equal(fs_pack_cloud(&cloud, centre, &pack, NULL), 0);
        char *text;
        double size = (double)text_of(&(TextChunk){pack.byte, (size_t)pack.planes * (size_t)pack.n}, 1, &text);
        print_message("%d Gaussians: %.2f bytes each\n", pack.n, size / pack.n);
        assert_true(size / pack.n < 12);
        free(text);
        fs_pack_free(&pack);
        fs_cloud_free(&cloud);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_comes_back), cmocka_unit_test(test_nothing),
                                       cmocka_unit_test(test_text), cmocka_unit_test(test_small)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
