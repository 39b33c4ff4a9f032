// Parts of synth alone: the hierarchy against brute force, textures, the sensor, the letters.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "image/tone.h"
#include "synth/bvh.h"
#include "synth/letters.h"
#include "synth/paint.h"
#include "synth/sensor.h"

static Vec random_vec(Rng *rng, float size)
{
    float x = fs_rng_uniform(rng), y = fs_rng_uniform(rng), z = fs_rng_uniform(rng);
    return vec(size * (2 * x - 1), size * (2 * y - 1), size * (2 * z - 1));
}

static void test_bvh(void **state)
{
    (void)state;
    for (int n = 0; n <= 700; n = 3 * n + 1) {
        Rng rng = fs_rng_new((uint64_t)n);
        PrimShape *shape = calloc((size_t)n + 1, sizeof *shape);
        for (int i = 0; i < n; i++) {
            shape[i].corner = random_vec(&rng, 3);
            shape[i].edge_a = random_vec(&rng, 0.8f);
            shape[i].edge_b = random_vec(&rng, 0.8f);
            shape[i].number = i;
            shape[i].triangle = i & 1;
            shape[i].flags = i % 3 == 0 ? SHAPE_THIN : 0;
        }
        Bvh bvh;
        assert_int_equal(fs_bvh_build(&bvh, shape, n), 0);
        int met = 0;
        for (int k = 0; k < 500; k++) {
            Vec o = random_vec(&rng, 5), d = random_vec(&rng, 1);
            if (k % 7 == 0) d.x = 0; // along a wall of boxes
            Hit hit = {.t = 1e9f}, best = {.t = 1e9f, .prim = -1};
            bool blocked = false, found = fs_bvh_hit(&bvh, o, d, &hit);
            for (int i = 0; i < n; i++) {
                Hit one = {.t = 1e9f};
                if (!fs_bvh_hit_shape(&shape[i], o, d, &one)) continue;
                if (one.t < best.t) best = one;
                if (!(shape[i].flags & SHAPE_THIN) && one.t > 0.5f && one.t < 4.0f) blocked = true;
            }
            assert_int_equal(found, best.prim >= 0);
            assert_int_equal(hit.prim, best.prim);
            if (found) assert_true(hit.t == best.t && hit.a == best.a && hit.b == best.b);
            assert_int_equal(fs_bvh_blocked(&bvh, o, d, 0.5f, 4.0f, SHAPE_THIN), blocked);
            met += found;
        }
        assert_true(n < 300 || met > 50);
        fs_bvh_free(&bvh);
        free(shape);
    }
}

static void test_texture(void **state)
{
    (void)state;
    Canvas canvas;
    Texture texture;
    assert_int_equal(fs_canvas_new(&canvas, 8, 4, 8), 0);
    assert_int_equal(canvas.width, 64);
    assert_int_equal(canvas.height, 32);
    fs_canvas_fill(&canvas, vec(0, 0, 0));
    fs_canvas_rect(&canvas, 4, 0, 4, 2, vec(1, 0.5f, 0)); // the upper right quarter
    assert_int_equal(fs_texture_new(&texture, &canvas), 0);
    Vec in = fs_texture_sample(&texture, 0.75f, 0.75f, 1), out = fs_texture_sample(&texture, 0.25f, 0.75f, 1);
    assert_true(fabsf(in.x - 1) < 1e-3f && fabsf(in.y - fs_tone_srgb_decode(128 / 255.0f)) < 1e-3f && in.z < 1e-3f);
    assert_true(out.x < 1e-3f);
    Vec again = fs_texture_sample(&texture, -4.25f, 7.75f, 1); // repeats
    assert_true(fabsf(again.x - in.x) < 1e-3f);
    Vec all = fs_texture_sample(&texture, 0.3f, 0.6f, 1e6f); // the smallest level is the mean, in linear light
    assert_true(fabsf(all.x - 0.25f) < 0.01f && fabsf(texture.mean.x - 0.25f) < 1e-3f);
    fs_texture_free(&texture);
    fs_canvas_free(&canvas);
}

static void test_paintings(void **state) // each has some contrast, none is burnt out; the same seed paints the same
{
    (void)state;
    for (int p = 0; p < PAINTS; p++) {
        Texture t[2];
        for (int k = 0; k < 2; k++) {
            Rng rng = fs_rng_new((uint64_t)p);
            assert_int_equal(fs_paint_texture(&t[k], (Paint)p, -1, 40, 30, 4, &rng), 0);
        }
        double sum = 0, sum2 = 0;
        int n = t[0].width[0] * t[0].height[0];
        for (int i = 0; i < n; i++) {
            assert_int_equal(t[0].texel[0][4 * i + 1], t[1].texel[0][4 * i + 1]);
            double v = t[0].texel[0][4 * i + 1];
            sum += v / n;
            sum2 += v * v / n;
        }
        assert_true(sum > 25 && sum < 230);
        assert_true(sqrt(sum2 - sum * sum) > (p == PAINT_PLAIN ? 0.3 : 2.0));
        fs_texture_free(&t[0]);
        fs_texture_free(&t[1]);
    }
}

static void test_sensor(void **state)
{
    (void)state;
    Image flat = {0}, seen = {0};
    Mosaic mosaic = {0};
    const float color[3] = {0.2f, 0.1f, 0.3f};
    assert_int_equal(fs_image_new(&flat, 64, 48, 3, NULL), 0);
    for (int i = 0; i < 64 * 48 * 3; i++) flat.px[i] = color[i % 3];
    assert_int_equal(fs_sensor_expose(&flat, 200, fs_rng_new(3), &mosaic, NULL), 0);
    double sum = 0, sum2 = 0;
    for (int y = 0; y < 48; y++)
        for (int x = 0; x < 64; x++)
            if ((x + y) & 1) { // green
                double v = (mosaic.px[y * 64 + x] - SENSOR_BLACK) / (double)(SENSOR_WHITE - SENSOR_BLACK);
                sum += v / (32 * 48);
                sum2 += v * v / (32 * 48);
            }
    assert_true(fabs(sum - 0.1) < 0.001);
    double noise = sqrt(sum2 - sum * sum); // shot noise of 1400 electrons out of 14000: 37
    assert_true(noise > 0.0022 && noise < 0.0032);
    assert_int_equal(fs_sensor_develop(&mosaic, (float[]){1, 1, 1}, &(CameraStyle){0}, &seen, NULL), 0);
    for (int c = 0; c < 3; c++) {
        double level = 0;
        for (int i = 0; i < 64 * 48; i++) level += (double)fs_tone_srgb_decode(seen.px[3 * i + c]) / (64 * 48);
        assert_true(fabs(level / (double)color[c] - 1) < 0.02);
    }
    for (int i = 0; i < 64 * 48 * 3; i++) flat.px[i] = 5.0f; // far too much light
    fs_sensor_mosaic_free(&mosaic);
    assert_int_equal(fs_sensor_expose(&flat, 200, fs_rng_new(3), &mosaic, NULL), 0);
    for (int i = 0; i < 64 * 48; i++) assert_int_equal(mosaic.px[i], SENSOR_WHITE);
    fs_sensor_mosaic_free(&mosaic);
    fs_image_free(&flat);
    fs_image_free(&seen);
}

static void test_letters(void **state)
{
    (void)state;
    for (const char *c = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"; *c; c++) {
        const char *s = fs_letters_strokes(*c);
        assert_non_null(s);
        for (int points = 0; *s; s += 2, points++) { // points parted by single blanks, inside the grid
            if (*s == ' ') s++;
            assert_true(s[0] >= '0' && s[0] <= '4' && s[1] >= '0' && s[1] <= '6');
        }
    }
    assert_null(fs_letters_strokes('?'));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bvh),    cmocka_unit_test(test_texture), cmocka_unit_test(test_paintings),
        cmocka_unit_test(test_sensor), cmocka_unit_test(test_letters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
