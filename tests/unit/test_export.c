// Exported files, read back by a parser of their own: property order, colours, and the .splat bytes.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/owned.h"

#include "base/rng.h"
#include "export/colors.h"
#include "export/export.h"
#include "export/codebook.h"
#include "export/formats.h"
#include "export/mesh.h"
#include "export/pane_place.h"
#include "temp_dir.h"

static const char inria_header[] =
    "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
    "property float nx\nproperty float ny\nproperty float nz\nproperty float f_dc_0\nproperty float f_dc_1\n"
    "property float f_dc_2\nproperty float opacity\nproperty float scale_0\nproperty float scale_1\n"
    "property float scale_2\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n"
    "end_header\n";

typedef struct Row {
    float mean[3], normal[3], dc[3], opacity, scale[3], rot[4];
} Row;

// The rows of an INRIA PLY with n Gaussians; fails when the header differs in any byte.
static Row *read_inria(const char *path, int n)
{
    char *data, *header = fs_file_path(inria_header, n);
    size_t size, h = strlen(header);
    assert_int_equal(fs_file_read(path, 1 << 20, &data, &size, NULL), 0);
    assert_int_equal(size, h + sizeof(Row) * (size_t)n);
    assert_memory_equal(data, header, h);
    Row *rows = malloc(sizeof(Row) * (size_t)n);
    memcpy(rows, data + h, sizeof(Row) * (size_t)n);
    free(data);
    free(header);
    return rows;
}

static void fill(Cloud *cloud, int n, int color_width, int gain_width, uint64_t seed)
{
    Rng rng = fs_rng_new(seed);
    assert_int_equal(fs_cloud_new(cloud, n, color_width, gain_width, NULL), 0);
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int i = 0; i < n * cloud->width[f]; i++)
            cloud->field[f][i] = f == CLOUD_COLORS ? fs_rng_uniform(&rng) : fs_rng_normal(&rng);
}

static void write_as(const char *format, const Cloud *cloud, const float *srgb, const char *path)
{
    Splats splats;
    assert_int_equal(fs_splats_make(cloud, srgb, &splats, NULL), 0);
    for (int f = 0; f < FORMATS; f++)
        if (strcmp(fs_formats[f].name, format) == 0 && fs_formats[f].write) {
            assert_int_equal(fs_splats_sort(&splats, fs_formats[f].order, NULL), 0);
            assert_int_equal(fs_formats[f].write(&splats, path, NULL), 0);
        }
    fs_splats_free(&splats);
}

// What a viewer shows for an INRIA row, against an own computation (the exposure is known to three digits).
static void assert_color(const Row *row, int channel, double linear, double exposure)
{
    double x = linear * exposure;
    if (x > 0.5) x = 0.5 + 0.5 * (1 - exp(-(x - 0.5) / 0.5));
    double srgb = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
    double shown = 0.5 + 0.28209479177387814 * (double)row->dc[channel];
    if (!(fabs(shown - srgb) < 1e-3)) fail_msg("viewer shows %g, expected %g", shown, srgb);
}

static void test_inria(void **state)
{
    char *path = fs_file_path("%s/inria.ply", (char *)*state);
    Cloud c;
    fill(&c, 5, 3, 0, 1);
    memset(c.field[CLOUD_QUATS] + 8, 0, 16); // no direction at all
    const float srgb[15] = {0, 0.5f, 1, 0.25f, 0.75f, 0.1f};
    write_as("ply", &c, srgb, path);
    Row *rows = read_inria(path, 5);
    for (int i = 0; i < 5; i++) {
        assert_memory_equal(rows[i].mean, c.field[CLOUD_MEANS] + 3 * i, 12);
        assert_memory_equal(rows[i].scale, c.field[CLOUD_SCALES] + 3 * i, 12);
        assert_true(rows[i].opacity == c.field[CLOUD_OPACITIES][i]);
        const float *q = c.field[CLOUD_QUATS] + 4 * i;
        double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        for (int k = 0; k < 4; k++)
            assert_true(fabs(rows[i].rot[k] - (i == 2 ? (double)(k == 0) : q[k] / norm)) < 1e-6);
        for (int k = 0; k < 3; k++) {
            assert_true(rows[i].normal[k] == 0);
            assert_true(fabs(0.5 + 0.28209479177387814 * rows[i].dc[k] - srgb[3 * i + k]) < 1e-6);
        }
    }
    free(rows);
    fs_cloud_free(&c);
    free(path);
}

static void test_splat(void **state)
{
    char *path = fs_file_path("%s/a.splat", (char *)*state);
    unsigned char *data;
    size_t size;
    Cloud c;
    fill(&c, 3, 3, 0, 2);
    for (int i = 0; i < 9; i++) c.field[CLOUD_SCALES][i] = (float)(i / 3); // the last is the largest
    c.field[CLOUD_OPACITIES][0] = 0, c.field[CLOUD_OPACITIES][1] = 100, c.field[CLOUD_OPACITIES][2] = -1;
    const float srgb[9] = {1, 0, 0.5f, 0.2f, 0.4f, 0.6f, 2, -1, 0.999f};
    write_as("splat", &c, srgb, path);
    assert_int_equal(fs_file_read(path, 1 << 20, (char **)&data, &size, NULL), 0);
    assert_int_equal(size, 96);
    for (int k = 0; k < 3; k++) {
        int i = 2 - k;
        const unsigned char *row = data + 32 * k;
        float scale[3];
        memcpy(scale, row + 12, 12);
        assert_memory_equal(row, c.field[CLOUD_MEANS] + 3 * i, 12);
        for (int a = 0; a < 3; a++) assert_true(fabs(scale[a] - exp(i)) < 1e-5);
        const float *q = c.field[CLOUD_QUATS] + 4 * i;
        double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        for (int a = 0; a < 4; a++) assert_true(fabs((row[28 + a] - 128) / 128.0 - q[a] / norm) <= 0.5 / 128 + 1e-6);
    }
    const unsigned char first[4] = {255, 0, 255, 69}, second[4] = {51, 102, 153, 255}, third[4] = {255, 0, 128, 128};
    assert_memory_equal(data + 24, first, 4);
    assert_memory_equal(data + 56, second, 4);
    assert_memory_equal(data + 88, third, 4);
    free(data);
    fs_cloud_free(&c);
    free(path);
}

// What is no number, or no size, is left out of every format; half a turn twice is none.
static void test_splats(void **state)
{
    (void)state;
    Cloud c;
    Splats splats;
    float srgb[81] = {0};
    fill(&c, 27, 3, 0, 7);
    c.field[CLOUD_MEANS][3] = NAN;
    c.field[CLOUD_MEANS][80] = 1e5f; // of a cloud of some units
    c.field[CLOUD_SCALES][6] = INFINITY;
    c.field[CLOUD_SCALES][9] = 90; // e^90 is no float
    c.field[CLOUD_OPACITIES][4] = -INFINITY;
    srgb[15] = NAN;
    assert_int_equal(fs_splats_make(&c, srgb, &splats, NULL), 0);
    assert_int_equal(splats.n, 21);
    assert_memory_equal(splats.mean + 3, c.field[CLOUD_MEANS] + 18, 12);
    float rotation[4];
    memcpy(rotation, splats.rotation, sizeof rotation);
    fs_splats_turn(&splats);
    assert_true(splats.mean[1] == -c.field[CLOUD_MEANS][1]);
    fs_splats_turn(&splats);
    assert_true(splats.mean[1] == c.field[CLOUD_MEANS][1]);
    for (int k = 0; k < 4; k++) assert_true(splats.rotation[k] == rotation[k]);
    const double normal[3] = {0, 0, 1};
    splats.mean[5] = 3e38f;
    fs_splats_mirror(&splats, normal, -1e38); // mirrored at it, the second is beyond all floats
    assert_int_equal(splats.n, 20);
    assert_memory_equal(splats.mean + 3, c.field[CLOUD_MEANS] + 21, 8);
    assert_true(splats.mean[5] == -2e38f);
    fs_splats_mirror(&splats, normal, 1e300);
    assert_int_equal(splats.n, 0);
    fs_splats_free(&splats);
    fs_cloud_free(&c);
}

static void test_formats(void **state)
{
    (void)state;
    for (int f = 0; f < FORMATS; f++) // the stage removes what it left by these
        for (int g = 0; g < f; g++) assert_string_not_equal(fs_formats[f].ending, fs_formats[g].ending);
    for (int f = 0; f < FORMATS; f++) {
        if (strcmp(fs_formats[f].name, "glb") == 0) assert_true(61.0 * (double)fs_formats[f].most < UINT32_MAX);
        if (strcmp(fs_formats[f].name, "sog") == 0) // a picture of WebP, and five of them in a ZIP at their worst
            assert_true(sqrt((double)fs_formats[f].most) < 16383 && 20.0 * (double)fs_formats[f].most < UINT32_MAX);
    }
}

// The codebook of a few numbers is these numbers, of many no worse than even steps over them.
static void test_codebook(void **state)
{
    (void)state;
    float book[CODEBOOK], value[5000] = {3, -1, 3, 7};
    assert_int_equal(fs_codebook_make(value, 4, book, NULL), 0);
    for (int i = 0; i < 4; i++) assert_true(book[fs_codebook_nearest(book, value[i])] == value[i]);
    Rng rng = fs_rng_new(11);
    double even = 0, ours = 0;
    for (int i = 0; i < 5000; i++) value[i] = fs_rng_normal(&rng);
    value[17] = -300; // which does not take the others' numbers away
    assert_int_equal(fs_codebook_make(value, 5000, book, NULL), 0);
    for (int i = 0; i < 5000; i++) {
        double step = 8.0 / 255, off = value[i] - step * round(value[i] / step);
        double our_off = value[i] - book[fs_codebook_nearest(book, value[i])];
        if (i != 17) even += off * off, ours += our_off * our_off;
    }
    assert_true(fabs(book[fs_codebook_nearest(book, -300)] + 300) < 1);
    assert_true(ours < 6 * even); // half are spread over 300 units
    assert_int_equal(fs_codebook_make(value, 0, book, NULL), 0);
}

#define RADIUS 0.8

// Depth of a ball at the origin from 4 units along an axis.
static void see_ball(int axis, int sign, Camera *camera, Image *depth)
{
    *camera = (Camera){.width = 200, .height = 200, .fx = 400, .fy = 400, .cx = 100, .cy = 100};
    camera->w2c[(axis + 1) % 3] = 1; // right
    camera->w2c[4 + (axis + 2) % 3] = sign;
    camera->w2c[8 + axis] = sign;
    camera->w2c[11] = 4;
    assert_int_equal(fs_image_new(depth, 200, 200, 1, NULL), 0);
    for (int y = 0; y < 200; y++)
        for (int x = 0; x < 200; x++) {
            double u = (x + 0.5 - 100) / 400, v = (y + 0.5 - 100) / 400, a = u * u + v * v + 1;
            double inside = 16 - a * (16 - RADIUS * RADIUS); // of (z u)^2 + (z v)^2 + (z - 4)^2 = RADIUS^2
            *fs_image_at(depth, x, y) = inside > 0 ? (float)((4 - sqrt(inside)) / a) : 6;
        }
}

// Fused from all sides, a ball is a closed surface at its radius, whose triangles face outwards.
static void test_mesh(void **state)
{
    const double box[2][3] = {{-1, -1, -1}, {1, 1, 1}};
    Tsdf tsdf;
    Mesh mesh;
    const double endless[2][3] = {{-1, -1, -1}, {1, INFINITY, 1}};
    assert_int_equal(fs_tsdf_new(&tsdf, endless, 0.001, 27000, NULL), FS_ERR_NUMERIC);
    assert_int_equal(fs_tsdf_new(&tsdf, box, 0, 27000, NULL), FS_ERR_NUMERIC);
    assert_int_equal(fs_tsdf_new(&tsdf, box, 0.001, 27000, NULL), 0); // as fine as the voxels allow
    assert_true((double)tsdf.size[0] * tsdf.size[1] * tsdf.size[2] <= 27000 && tsdf.size[0] > 28);
    for (int view = 0; view < 6; view++) {
        Camera camera;
        Image depth;
        see_ball(view / 2, view % 2 ? 1 : -1, &camera, &depth);
        fs_tsdf_fuse(&tsdf, &camera, &depth, NULL);
        fs_image_free(&depth);
    }
    assert_int_equal(fs_mesh_extract(&tsdf, 1, &mesh, NULL), 0);
    assert_int_equal(fs_mesh_drop_pieces(&mesh, 0.1, NULL), 0);
    assert_true(mesh.n > 1000 && mesh.triangles == 2 * (mesh.n - 2)); // Euler: closed, without holes
    for (size_t v = 0; v < (size_t)mesh.n; v++) {
        const float *p = mesh.xyz + 3 * v;
        assert_true(fabs(sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - RADIUS) < 0.5 * tsdf.step);
    }
    double volume = 0;
    for (size_t t = 0; t < (size_t)mesh.triangles; t++) {
        const float *a = mesh.xyz + 3 * mesh.corner[3 * t], *b = mesh.xyz + 3 * mesh.corner[3 * t + 1],
                    *c = mesh.xyz + 3 * mesh.corner[3 * t + 2];
        volume += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                  a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    assert_true(fabs(volume / 6 / (4.0 / 3 * 3.14159265 * RADIUS * RADIUS * RADIUS) - 1) < 0.04);
    int before = mesh.triangles; // a lone triangle goes
    mesh.corner = realloc(mesh.corner, sizeof *mesh.corner * 3 * (size_t)(before + 1));
    mesh.xyz = realloc(mesh.xyz, sizeof(float) * 3 * (size_t)(mesh.n + 3));
    mesh.rgb = realloc(mesh.rgb, 3 * (size_t)(mesh.n + 3));
    for (int k = 0; k < 3; k++) mesh.corner[3 * before + k] = (uint32_t)(mesh.n + k);
    memset(mesh.xyz + 3 * mesh.n, 0, 36);
    memset(mesh.rgb + 3 * mesh.n, 0, 9);
    mesh.n += 3, mesh.triangles++;
    assert_int_equal(fs_mesh_drop_pieces(&mesh, 0.01, NULL), 0);
    assert_int_equal(mesh.triangles, before);
    fs_mesh_free(&mesh);
    fs_tsdf_free(&tsdf);
    (void)state;
}

// The pane is as far as the nearest of what is seen; bars are before it.
static void test_pane_behind_bars(void **state)
{
    (void)state;
    Scene scene = {.shared_geometry = true, .pane_beta = true, .pane = {.normal = {0, 0, 1}}};
    Cloud *cloud = &scene.cloud[LAYER_T_N];
    const Dataset none = {0};
    PanePlace place;
    fill(cloud, 20, 3, 1, 5);
    assert_int_equal(fs_cloud_covers(cloud, true, NULL), 0);
    for (int i = 0; i < 20; i++) {
        cloud->field[CLOUD_MEANS][3 * i + 2] = i < 5 ? 1 : 3;
        cloud->field[CLOUD_OPACITIES][i] = 2;
    }
    assert_int_equal(fs_pane_place_find(&scene, &none, 0, &place, NULL), 0);
    assert_true(place.distance == 1);
    for (int i = 0; i < 5; i++) cloud->field[CLOUD_COVERS][i] = 0.999f;
    assert_int_equal(fs_pane_place_find(&scene, &none, 0, &place, NULL), 0);
    assert_true(place.distance == 3);
    fs_scene_free(&scene);
}

static float exposure_said;

static void on_log(void *user, FsLogLevel level, const char *message)
{
    (void)user, (void)level;
    sscanf(message, "export: colours are camera RGB times %f", &exposure_said);
}

static int export_scene(const char *out, const Scene *scene, FsError *err)
{
    FsSettings *set = fs_settings_new();
    char *clouds = fs_file_path("%s/clouds", out);
    struct FsProject project = {.out = (char *)out, .set = *set, .log = {.log = on_log}};
    assert_int_equal(fs_owned_open(out, "project", NULL), 0);
    if (scene) assert_int_equal(fs_scene_write(scene, clouds, NULL), 0);
    int rc = fs_export_run(&project, err);
    free(clouds);
    free(project.fingerprint);
    fs_settings_free(set);
    return rc;
}

static double decode(float encoded)
{
    return pow(fmax(encoded, 0), 1 / 0.22);
}

// Where the photos' poses are known, the flash is in their middle and its light falls off from there.
static void test_flash_falls_off(void **state)
{
    (void)state;
    Scene scene = {.shared_geometry = true, .gain_color = {1, 0.8, 0.5}, .flash_distance = 2};
    const Development development = {.light.exposure = 1, .has_eye = true, .eye = {0.5, 0, 0}};
    Cloud *cloud = &scene.cloud[LAYER_T_N];
    float dark[6], lit[6];
    fill(cloud, 2, 3, 1, 3);
    for (int i = 0; i < 2; i++) {
        const float mean[3] = {0.5f, 0, i ? 4.0f : 1.0f}; // at half and at twice the flash distance
        memcpy(cloud->field[CLOUD_MEANS] + 3 * i, mean, sizeof mean);
    }
    for (int s = SEPARATION_FULL; s <= SEPARATION_LINEAR; s += SEPARATION_LINEAR - SEPARATION_FULL) {
        scene.separation = (Separation)s;
        fs_colors_linear(&scene, LAYER_T_N, &development, dark);
        fs_colors_linear(&scene, LAYER_T_F, &development, lit);
        for (int i = 0; i < 6; i++) {
            double falloff = s == SEPARATION_LINEAR ? 1 : i < 3 ? 4 : 0.25;
            double gain = scene.gain_color[i % 3] * exp((double)cloud->field[CLOUD_GAINS][i / 3]) * falloff;
            assert_float_equal(lit[i], dark[i] * (1 + gain), 1e-5 * (1 + (double)lit[i]));
        }
    }
    fs_scene_free(&scene);
}

// One geometry: T_F is T_N's Gaussians with 1 + alpha the light; R is dimmed by the pane.
static void test_run_shared(void **state)
{
    char *out = fs_file_path("%s/shared", (char *)*state), *paths[LAYERS];
    Scene scene = {.shared_geometry = true,
                   .pane_beta = true,
                   .pane = {{0, 0, 1}, 0.3},
                   .gain_color = {1, 0.8, 0.5},
                   .flash_distance = 2,
                   .extent = 1};
    fill(&scene.cloud[LAYER_T_N], 6, 3, 1, 3);
    fill(&scene.cloud[LAYER_R], 4, 3, 0, 4);
    assert_int_equal(export_scene(out, &scene, NULL), 0);
    for (int l = 0; l < LAYERS; l++) paths[l] = fs_file_path("%s/export/%s.ply", out, fs_layers[l].name);
    assert_false(fs_file_exists(paths[LAYER_BETA]));
    assert_true(exposure_said > 0);
    Row *t_n = read_inria(paths[LAYER_T_N], 6), *t_f = read_inria(paths[LAYER_T_F], 6),
        *r = read_inria(paths[LAYER_R], 4);
    for (int i = 0; i < 6; i++) {
        assert_memory_equal(t_n[i].mean, t_f[i].mean, sizeof t_n[i].mean);
        for (int c = 0; c < 3; c++) {
            double linear = decode(scene.cloud[LAYER_T_N].field[CLOUD_COLORS][3 * i + c]);
            double alpha = scene.gain_color[c] * exp(scene.cloud[LAYER_T_N].field[CLOUD_GAINS][i]);
            assert_color(&t_n[i], c, linear, exposure_said);
            assert_color(&t_f[i], c, linear * (1 + alpha), exposure_said);
        }
    }
    for (int i = 0; i < 4; i++)
        for (int c = 0; c < 3; c++)
            assert_color(&r[i], c, 0.3 * decode(scene.cloud[LAYER_R].field[CLOUD_COLORS][3 * i + c]), exposure_said);
    free(t_n), free(t_f), free(r);
    // Again without R: its old files go.
    fs_cloud_free(&scene.cloud[LAYER_R]);
    assert_true(fs_file_exists(paths[LAYER_R]));
    char *done = fs_file_path("%s/done", out);
    fs_file_remove_tree(done);
    assert_int_equal(export_scene(out, &scene, NULL), 0);
    assert_false(fs_file_exists(paths[LAYER_R]));
    for (int l = 0; l < LAYERS; l++) free(paths[l]);
    free(done);
    fs_scene_free(&scene);
    free(out);
}

static void test_run_separate(void **state)
{
    char *out = fs_file_path("%s/separate", (char *)*state);
    Scene scene = {.extent = 1};
    for (int l = 0; l < LAYERS; l++) fill(&scene.cloud[l], 3 + l, fs_layers[l].channels, 0, 5 + (uint64_t)l);
    assert_int_equal(export_scene(out, &scene, NULL), 0);
    for (int l = 0; l < LAYERS; l++) {
        char *path = fs_file_path("%s/export/%s.ply", out, fs_layers[l].name);
        Row *rows = read_inria(path, 3 + l);
        for (int i = 0; i < 3 + l; i++)
            for (int c = 0; c < 3; c++) {
                float color = scene.cloud[l].field[CLOUD_COLORS][l == LAYER_BETA ? i : 3 * i + c];
                if (l != LAYER_BETA)
                    assert_color(&rows[i], c, decode(color), exposure_said);
                else
                    assert_true(fabs(0.5 + 0.28209479177387814 * rows[i].dc[c] - 1 / (1 + exp(-color))) < 1e-6);
            }
        free(rows);
        free(path);
    }
    fs_scene_free(&scene);
    free(out);
}

// The camera's colour matrix, from ingest.json.
static void test_matrix(void **state)
{
    static const char json[] = "{\"srgb_from_camera\": [1.5, -0.4, -0.1, -0.2, 1.4, -0.2, 0, -0.5, 1.5]}";
    static const double m[9] = {1.5, -0.4, -0.1, -0.2, 1.4, -0.2, 0, -0.5, 1.5};
    char *out = fs_file_path("%s/matrix", (char *)*state), *ingest = fs_file_path("%s/ingest.json", out);
    char *path = fs_file_path("%s/export/T_N.ply", out);
    Scene scene = {.extent = 1};
    fill(&scene.cloud[LAYER_T_N], 5, 3, 0, 9);
    assert_int_equal(fs_file_mkdirs(out, NULL), 0);
    assert_int_equal(fs_file_write(ingest, json, sizeof json - 1, NULL), 0);
    assert_int_equal(export_scene(out, &scene, NULL), 0);
    Row *rows = read_inria(path, 5);
    for (int i = 0; i < 5; i++)
        for (int c = 0; c < 3; c++) {
            double v = 0;
            for (int k = 0; k < 3; k++)
                v += m[3 * c + k] * decode(scene.cloud[LAYER_T_N].field[CLOUD_COLORS][3 * i + k]);
            assert_color(&rows[i], c, fmax(v, 0), exposure_said);
        }
    free(rows);
    fs_scene_free(&scene);
    free(out), free(ingest), free(path);
}

static void test_run_errors(void **state)
{
    FsError err;
    char *out = fs_file_path("%s/none", (char *)*state), *clouds = fs_file_path("%s/clouds", out);
    char *model = fs_file_path("%s/model.json", clouds);
    assert_int_equal(export_scene(out, NULL, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, model));
    assert_int_equal(fs_file_mkdirs(clouds, NULL), 0);
    assert_int_equal(fs_file_write(model, "{", 1, NULL), 0);
    assert_int_equal(export_scene(out, NULL, &err), FS_ERR_INPUT);
    assert_non_null(strstr(err.message, model));
    free(out), free(clouds), free(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_inria),
        cmocka_unit_test(test_splat),
        cmocka_unit_test(test_splats),
        cmocka_unit_test(test_formats),
        cmocka_unit_test(test_flash_falls_off),
        cmocka_unit_test(test_run_shared),
        cmocka_unit_test(test_run_separate),
        cmocka_unit_test(test_matrix),
        cmocka_unit_test(test_run_errors),
        cmocka_unit_test(test_codebook),
        cmocka_unit_test(test_mesh),
        cmocka_unit_test(test_pane_behind_bars),
    };
    return cmocka_run_group_tests(tests, temp_dir_make, temp_dir_remove);
}
