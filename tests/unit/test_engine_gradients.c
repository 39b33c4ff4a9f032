// What every device must do: gradients of the whole step against finite differences through the seam.
#include "engines.h"
#include "kernels/shade.h"

// ---- gradients of a whole step ----

static double loss_of(const char *device, const Scene *scene, bool flash, StepResult *result)
{
    const Camera camera = make_camera();
    Engine *engine = open_engine(device, scene);
    StepArgs args = make_args(scene);
    double sum = 0;
    load_photo(engine, &camera, flash);
    if (scene->shared_geometry) send_neighbours(engine, &scene->cloud[LAYER_T_N]);
    assert_int_equal(fs_engine_step(engine, &args, result, NULL), 0);
    for (int k = 0; k < LOSS_TERMS; k++) sum += args.weight[k] * result->loss[k];
    fs_engine_free(engine);
    return sum;
}

// One step from zero moments: the gradients are the first moments, times ten.
static void gradients_of(const char *device, const Scene *scene, bool flash, TrainState *state, StepResult *result)
{
    const Camera camera = make_camera();
    Engine *engine = open_engine(device, scene);
    StepArgs args = make_args(scene);
    load_photo(engine, &camera, flash);
    if (scene->shared_geometry) send_neighbours(engine, &scene->cloud[LAYER_T_N]);
    assert_int_equal(fs_engine_step(engine, &args, result, NULL), 0);
    assert_int_equal(fs_engine_state_down(engine, state, NULL), 0);
    fs_engine_free(engine);
}

// Moves a field along u by h. Where T_N's cloud is stepped as (T_F, gain), so is it here.
static void move_field(Scene *scene, int layer, int field, const float *u, double h)
{
    Cloud *cloud = &scene->cloud[layer];
    const Camera camera = make_camera();
    bool enter = layer == LAYER_T_N && fs_scene_lit(scene) && scene->separation == SEPARATION_FULL;
    unsigned char all[N];
    float d_colors[3 * N] = {0}, d_gains[N] = {0};
    ShadeLight light = {.flash_distance = (float)scene->flash_distance};
    ShadeCloud shade = {cloud->field[CLOUD_MEANS], cloud->field[CLOUD_COLORS], cloud->field[CLOUD_GAINS]};
    double centre[3];
    fs_camera_centre(&camera, centre);
    for (int k = 0; k < 3; k++) light.centre[k] = (float)centre[k], light.tint[k] = (float)scene->gain_color[k];
    memset(all, 1, sizeof all);
    enter = enter && (field == CLOUD_COLORS || field == CLOUD_GAINS);
    if (enter) fs_shade_scalar.enter(&light, &shade, all, 0, cloud->n, &(ShadeGradients){d_colors, d_gains});
    for (int i = 0; i < cloud->n * cloud->width[field]; i++) cloud->field[field][i] += (float)(h * (double)u[i]);
    if (enter) fs_shade_scalar.leave(&light, &shade, all, 0, cloud->n);
}

static double slope_along(const char *device, const Kind *kind, bool flash, int layer, int field, const float *u)
{
    const double h = field >= CLOUD_COLORS ? 2e-3 : 4e-4;
    double value[2];
    StepResult result;
    for (int side = 0; side < 2; side++) {
        Scene scene = make_scene(kind);
        move_field(&scene, layer, field, u, side ? h : -h);
        value[side] = loss_of(device, &scene, flash, &result);
        fs_scene_free(&scene);
    }
    return (value[1] - value[0]) / (2 * h);
}

static int bad_slopes;

// Along the gradient itself, so that single-precision noise does not matter, and along a random direction.
static void check_field(const char *device, const Kind *kind, bool flash, int layer, int field, const Cloud *m)
{
    int n = m->n * m->width[field];
    float u[4 * (N + 3)];
    double norm = 0, along = 0;
    for (int i = 0; i < n; i++) norm += pow(10.0 * (double)m->field[field][i], 2);
    norm = sqrt(norm);
    assert_true(norm > 1e-6);
    Rng rng = fs_rng_new((uint64_t)(layer * 10 + field));
    for (int i = 0; i < n; i++) {
        u[i] = (float)(10.0 * (double)m->field[field][i] / norm) + 0.2f * fs_rng_normal(&rng) / sqrtf((float)n);
        along += 10.0 * (double)m->field[field][i] * (double)u[i];
    }
    double slope = slope_along(device, kind, flash, layer, field, u), noise = 3e-5; // of single precision
    if (fabs(slope - along) > 0.03 * norm + noise)
        print_message("%s, %s, %s of %s%s%s: gradient %g, differences %g\n", device, flash ? "flash" : "no flash",
                      fs_cloud_fields[field].name, fs_layers[layer].name, kind->shared ? ", shared" : "",
                      kind->pane ? ", pane" : "", along, slope);
    bad_slopes += !(fabs(slope - along) <= 0.03 * norm + noise);
}

static void check_kind(const char *device, const Kind *kind, bool flash)
{
    Scene scene = make_scene(kind);
    TrainState state = {0};
    StepResult result;
    gradients_of(device, &scene, flash, &state, &result);
    Layer T = flash && !kind->shared ? LAYER_T_F : LAYER_T_N, other = T == LAYER_T_N ? LAYER_T_F : LAYER_T_N;
    for (int l = 0; l < LAYERS; l++) {
        const Cloud *m = &state.cloud[l].m;
        if (!scene.cloud[l].n) continue;
        assert_int_equal(result.visible[l], l == (int)other ? 0 : scene.cloud[l].n);
        for (int f = 0; f < CLOUD_FIELDS; f++) {
            if (!m->width[f]) continue;
            bool stepped = l != (int)other && (f != CLOUD_GAINS || scene.separation == SEPARATION_FULL);
            for (int i = 0; i < m->n * m->width[f] && !stepped; i++) assert_true(m->field[f][i] == 0);
            // The flash's falloff is left out of the gradient of means, on purpose (kernels/shade.h).
            bool falls_off = f == CLOUD_MEANS && flash && fs_scene_lit(&scene) && scene.separation == SEPARATION_FULL;
            if (stepped && !falls_off) check_field(device, kind, flash, l, f, m);
        }
    }
    fs_engine_state_free(&state);
    fs_scene_free(&scene);
}

static void test_gradients(void **state)
{
    (void)state;
    wide = 0.55f;
    FOR_DEVICES(d) FOR_KINDS(k) for (int flash = 0; flash < 2; flash++) check_kind(devices[d], &kinds[k], flash == 1);
    wide = 0.12f;
    assert_int_equal(bad_slopes, 0);
}

// The numbers of the whole scene: pane, colour of the gain, what comes back of the flash, vignetting, response, the
// veil's ambient light.
enum { KNOT_0 = 8 + FS_OPTICS_VIGNETTING, AMBIENT_0 = KNOT_0 + FS_OPTICS_KNOTS };
static double slope_of_number(const char *device, const Kind *kind, bool flash, int number, const double u[3])
{
    const double h = 2e-3;
    double value[2];
    StepResult result;
    for (int side = 0; side < 2; side++) {
        Scene s = make_scene(kind);
        double step = side ? h : -h;
        for (int k = 0; k < 3 && number == 0; k++) s.pane.normal[k] += step * u[k];
        if (number == 3) s.pane.dimming += step;
        if (number >= 4 && number < 7) s.gain_color[number - 4] *= exp(step);
        if (number == 7) s.flash_return *= exp(step);
        if (number >= 8 && number < KNOT_0) s.vignetting[number - 8] += step;
        if (number >= KNOT_0 && number < AMBIENT_0) s.response[number - KNOT_0] += step;
        if (number >= AMBIENT_0) s.veil.ambient[number - AMBIENT_0] += step;
        value[side] = loss_of(device, &s, flash, &result);
        fs_scene_free(&s);
    }
    return (value[1] - value[0]) / (2 * h);
}

static void check_number(const char *device, const Kind *kind, bool flash, int i, double g, const double u[3])
{
    bool learned = i < 4 || i >= 8 || flash;
    if (!learned) assert_true(g == 0);
    if (!learned) return;
    double slope = slope_of_number(device, kind, flash, i, u);
    if (fabs(slope - g) > 0.03 * fabs(g) + 2e-5)
        print_message("%s, number %d: gradient %g, differences %g\n", device, i, g, slope);
    assert_true(fabs(slope - g) <= 0.03 * fabs(g) + 2e-5 && (g != 0 || (i >= KNOT_0 && i < AMBIENT_0)));
}

static void check_numbers(const Kind *kind, int first, int end)
{
    Scene scene = make_scene(kind);
    const double *n = scene.pane.normal, u[3] = {n[1], -n[0], 0}; // at right angles to the normal
    FOR_DEVICES(d) for (int flash = 0; flash < 2; flash++)
    {
        TrainState train = {0};
        StepResult result;
        gradients_of(devices[d], &scene, flash == 1, &train, &result);
        for (int i = first; i < end; i++) {
            if (i == 1 || i == 2 || i == KNOT_0) continue; // the normal is looked at along u; the first knot stays
            double g = 10.0 * (double)train.m[i];
            if (i == 0) g = 10 * ((double)train.m[0] * u[0] + (double)train.m[1] * u[1]);
            check_number(devices[d], kind, flash == 1, i, g, u);
        }
        fs_engine_state_free(&train);
    }
    fs_scene_free(&scene);
}

static void test_gradients_of_numbers(void **state)
{
    (void)state;
    check_numbers(&kinds[0], 0, AMBIENT_0);
    check_numbers(veiled, AMBIENT_0, ENGINE_NUMBERS);
}

// The veil's light, along its gradient and a random direction.
static void test_gradient_of_veil(void **state)
{
    (void)state;
    const double h = 1e-3;
    FOR_DEVICES(d) for (int flash = 0; flash < 2; flash++)
    {
        Scene scene = make_scene(veiled);
        TrainState train = {0};
        StepResult result;
        Rng rng = fs_rng_new(3);
        size_t n = fs_image_values(&scene.veil.light);
        float u[11 * 15];
        double norm = 0, along = 0, value[2];
        assert_int_equal(n, sizeof u / sizeof *u);
        gradients_of(devices[d], &scene, flash == 1, &train, &result);
        for (size_t i = 0; i < n; i++) norm += pow(10 * (double)train.veil_m[i], 2);
        norm = sqrt(norm);
        assert_true(norm > 1e-4);
        for (size_t i = 0; i < n; i++) {
            u[i] = (float)(10 * (double)train.veil_m[i] / norm) + 0.2f * fs_rng_normal(&rng) / sqrtf((float)n);
            along += 10 * (double)train.veil_m[i] * (double)u[i];
        }
        for (int side = 0; side < 2; side++) {
            Scene moved = make_scene(veiled);
            for (size_t i = 0; i < n; i++) moved.veil.light.px[i] += (float)(side ? h : -h) * u[i];
            value[side] = loss_of(devices[d], &moved, flash == 1, &result);
            fs_scene_free(&moved);
        }
        double slope = (value[1] - value[0]) / (2 * h);
        if (fabs(slope - along) > 0.03 * norm + 3e-5)
            print_message("%s, veil, flash %d: gradient %g, differences %g\n", devices[d], flash, along, slope);
        assert_true(fabs(slope - along) <= 0.03 * norm + 3e-5);
        fs_engine_state_free(&train);
        fs_scene_free(&scene);
    }
}

// The numbers of the photo: its light and its white balance.
static double loss_of_photo(const char *device, const Scene *scene, bool flash, PhotoState *light)
{
    const Camera camera = make_camera();
    Engine *engine = open_engine(device, scene);
    StepArgs args = make_args(scene);
    StepResult result;
    double sum = 0;
    load_photo_with(engine, &camera, flash, light);
    assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
    for (int k = 0; k < LOSS_TERMS; k++) sum += args.weight[k] * result.loss[k];
    assert_int_equal(fs_engine_photos_down(engine, light, NULL), 0);
    fs_engine_free(engine);
    return sum;
}

static void test_gradients_of_photo(void **state)
{
    (void)state;
    const double h = 2e-3;
    FOR_DEVICES(d) for (int flash = 0; flash < 2; flash++)
    {
        Scene scene = make_scene(&kinds[0]);
        PhotoState after = unlike;
        loss_of_photo(devices[d], &scene, flash == 1, &after);
        for (int i = 0; i < PHOTO_NUMBERS; i++) {
            double g = 10.0 * (double)after.m[i], value[2];
            if (i == PHOTO_FLASH && !flash) assert_true(g == 0);
            if (i == PHOTO_FLASH && !flash) continue;
            for (int side = 0; side < 2; side++) {
                PhotoState moved = unlike;
                moved.x[i] += (float)(side ? h : -h);
                value[side] = loss_of_photo(devices[d], &scene, flash == 1, &moved);
            }
            double slope = (value[1] - value[0]) / (2 * h);
            if (fabs(slope - g) > 0.03 * fabs(g) + 2e-5)
                print_message("%s, number %d of the photo: gradient %g, differences %g\n", devices[d], i, g, slope);
            assert_true(fabs(slope - g) <= 0.03 * fabs(g) + 2e-5);
        }
        assert_true(after.x[PHOTO_T] == 0 && fabsf(after.x[PHOTO_WHITE]) < 1e-6f); // the only photo is the mean
        fs_scene_free(&scene);
    }
}

static void test_gradients_of_some_pixels(void **state)
{
    wide = 0.55f;
    sparse[1] = 2;
    FOR_DEVICES(d) for (int flash = 0; flash < 2; flash++)
    {
        check_kind(devices[d], &kinds[0], flash == 1);
        check_kind(devices[d], &kinds[3], flash == 1);
    }
    wide = 0.12f;
    test_gradients_of_numbers(state);
    test_gradients_of_photo(state);
    sparse[0] = sparse[1] = 1;
    assert_int_equal(bad_slopes, 0);
}

// What is looked at is the photo: the even and the odd columns together have its L1, and its gradients.
static void l1_step(const char *device, const Scene *scene, int columns, int step, double *l1, Cloud *gradients)
{
    const Camera camera = make_camera();
    Engine *engine = open_engine(device, scene);
    StepArgs args = make_args(scene);
    StepResult result;
    TrainState state = {0};
    for (int k = 0; k < LOSS_TERMS; k++) args.weight[k] = k == LOSS_L1;
    args.stride[0] = columns;
    args.step = step;
    load_photo(engine, &camera, true);
    send_neighbours(engine, &scene->cloud[LAYER_T_N]);
    assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
    assert_int_equal(fs_engine_state_down(engine, &state, NULL), 0);
    *l1 = result.loss[LOSS_L1];
    *gradients = state.cloud[LAYER_T_N].m;
    state.cloud[LAYER_T_N].m = (Cloud){0};
    fs_engine_state_free(&state);
    fs_engine_free(engine);
}

static void test_pixels_together(void **state)
{
    (void)state;
    FOR_DEVICES(d)
    {
        Scene scene = make_scene(&kinds[0]);
        double all, part[2] = {0};
        Cloud whole, half[2] = {{0}};
        l1_step(devices[d], &scene, 1, 0, &all, &whole);
        l1_step(devices[d], &scene, 2, 0, &part[0], &half[0]);
        for (int step = 1; !part[1] || part[1] == part[0]; step++) {
            fs_cloud_free(&half[1]);
            assert_true(step < 30); // beginning anywhere
            l1_step(devices[d], &scene, 2, step, &part[1], &half[1]);
        }
        assert_true(fabs((part[0] + part[1]) / 2 - all) < 1e-6 && fabs(part[0] - part[1]) > 1e-4);
        for (int f = 0; f < CLOUD_FIELDS; f++)
            for (int i = 0; i < whole.n * whole.width[f]; i++) {
                float mean = (half[0].field[f][i] + half[1].field[f][i]) / 2;
                assert_true(fabsf(mean - whole.field[f][i]) < 1e-6f + 1e-4f * fabsf(mean));
            }
        fs_cloud_free(&whole);
        for (int k = 0; k < 2; k++) fs_cloud_free(&half[k]);
        fs_scene_free(&scene);
    }
}

// Who stands in the mirrored light's way: one step of a grid, at a loss without its cost.
static double loss_of_occlusion(const char *device, const Scene *scene, OcclusionState *occlusion, double settle)
{
    const Camera camera = make_camera();
    Engine *engine = open_engine(device, scene);
    StepArgs args = make_args(scene);
    StepResult result;
    double sum = 0;
    args.settle = settle;
    load_photo(engine, &camera, false);
    assert_int_equal(fs_engine_occlusion_up(engine, 0, occlusion, NULL), 0);
    assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
    for (int k = 0; k < LOSS_TERMS; k++) sum += args.weight[k] * result.loss[k];
    assert_int_equal(fs_engine_occlusion_down(engine, 0, occlusion, NULL), 0);
    fs_engine_free(engine);
    return sum;
}

static void test_gradients_of_occlusion(void **state)
{
    (void)state;
    Scene scene = make_scene(&kinds[0]);
    OcclusionState first[2];
    FOR_DEVICES(d)
    {
        static OcclusionState before, after, moved;
        double value[2], slope = 0, away = 0;
        const double h = 2e-2, settle = 1e-3;
        for (int i = 0; i < OCCLUSION_CELLS; i++)
            before.q[i] = 0.4f + 0.1f * sinf(0.01f * (float)i), before.cost[i] = 0;
        after = before;
        loss_of_occlusion(devices[d], &scene, &after, settle);
        for (int side = 0; side < 2; side++) {
            moved = before;
            for (int i = 0; i < OCCLUSION_CELLS; i++) moved.q[i] += (float)(side ? h : -h) * cosf(0.1f * (float)i);
            value[side] = loss_of_occlusion(devices[d], &scene, &moved, 0);
        }
        for (int i = 0; i < OCCLUSION_CELLS; i++) {
            double g = (double)(before.q[i] - after.q[i]) / settle; // in proportion to the gradient, with one factor
            slope += g * (double)cosf(0.1f * (float)i);
            away += fabs(g);
        }
        slope /= 2.0 * OCCLUSION_CELLS; // of the rate, and cells
        double differences = (value[1] - value[0]) / (2 * h);
        if (fabs(differences - slope) > 0.03 * fabs(slope) + 2e-5)
            print_message("%s: gradient %g, differences %g\n", devices[d], slope, differences);
        assert_true(fabs(differences - slope) <= 0.03 * fabs(slope) + 2e-5 && away > 0);
        for (int i = 0; i < OCCLUSION_CELLS; i++)
            after.cost[i] = i % 2 ? 1e3f : 0; // what costs much goes, and stays away
        loss_of_occlusion(devices[d], &scene, &after, settle);
        for (int i = 1; i < OCCLUSION_CELLS; i += 2) assert_true(after.q[i] == 0 && after.q[i - 1] > 0);
        first[d > 0] = after;
    }
    for (int i = 0; i < OCCLUSION_CELLS; i++) assert_true(fabsf(first[0].q[i] - first[1].q[i]) < 1e-3f);
    fs_scene_free(&scene);
}

static void test_occlusion_hides_R(void **state)
{
    (void)state;
    FOR_DEVICES(d)
    {
        Scene scene = make_scene(&kinds[0]), without = make_scene(&kinds[0]);
        static OcclusionState all;
        StepResult result;
        FsError err;
        for (int i = 0; i < OCCLUSION_CELLS; i++) all.q[i] = 1;
        for (int i = 0; i < 3 * without.cloud[LAYER_R].n; i++) without.cloud[LAYER_R].field[CLOUD_COLORS][i] = 0;
        const Camera camera = make_camera();
        double value[2] = {loss_of(devices[d], &without, false, &result), 0};
        value[0] = result.loss[LOSS_L1];
        Engine *engine = open_engine(devices[d], &scene);
        StepArgs args = make_args(&scene);
        load_photo(engine, &camera, false);
        assert_int_equal(fs_engine_occlusion_up(engine, 0, &all, NULL), 0);
        assert_int_equal(fs_engine_step(engine, &args, &result, NULL), 0);
        value[1] = result.loss[LOSS_L1];
        if (fabs(value[0] - value[1]) > 1e-5) print_message("%s: %g, black %g\n", devices[d], value[1], value[0]);
        assert_true(fabs(value[0] - value[1]) <= 1e-5);
        assert_int_equal(fs_engine_occlusion_up(engine, 0, NULL, NULL), 0);
        assert_int_equal(fs_engine_occlusion_down(engine, 0, &all, &err), FS_ERR_INPUT); // nobody
        assert_int_equal(fs_engine_occlusion_up(engine, 1, &all, &err), FS_ERR_INPUT);   // no such photo
        fs_engine_free(engine);
        fs_scene_free(&scene);
        fs_scene_free(&without);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gradients),
        cmocka_unit_test(test_gradients_of_numbers),
        cmocka_unit_test(test_gradient_of_veil),
        cmocka_unit_test(test_gradients_of_photo),
        cmocka_unit_test(test_gradients_of_occlusion),
        cmocka_unit_test(test_occlusion_hides_R),
        cmocka_unit_test(test_gradients_of_some_pixels),
        cmocka_unit_test(test_pixels_together),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
