#include "export/surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/order.h"
#include "engine/engine.h"
#include "export/mesh.h"
#include "export/splats.h"

#define MOST_VIEWS 64    // of those of the photos, spread over them
#define EDGE 600         // pixels of a view: depth is smooth
#define PROBE_EDGE 64    // of those that say how large the scene is
#define OUTLIERS 0.01    // share of the depths, at either end of each axis, that are left out
#define WIDTH 3          // pixels that a voxel is wide: depth is less sure than they are
#define MOST_VOXELS 16e6 // 128 MB
#define AROUND 3         // pixels on each side whose middle depth a pixel has
#define SEEN_BY 3        // views that must agree
#define SMALLEST 0.005   // piece, as a share of all

typedef struct Fusion {
    const ExportArgs *args;
    Engine *engine;
    Threads *threads;
    Renders renders;
    Tsdf tsdf;
    Mesh mesh;
    float *light; // (N, 7) per vertex: sums of T_N and T_F, and how many
    int passes;   // over the views that are done
} Fusion;

typedef int VisitView(Fusion *f, const Camera *camera, void *context, FsError *err);

static int each_view(Fusion *f, int edge, VisitView *visit, void *context, FsError *err)
{
    const Log *log = &f->args->project->log;
    int n = f->args->photos->n, count = n < MOST_VIEWS ? n : MOST_VIEWS;
    for (int k = 0; k < count; k++) {
        if (fs_log_cancelled(log)) return fs_error_set(err, FS_ERR_CANCELLED, "export: stopped");
        fs_log_progress(log, "export", f->passes * count + k, 3 * count, "mesh");
        Camera camera = fs_camera_limited(&f->args->photos->view[(int64_t)k * n / count].camera, edge);
        MUST(fs_engine_render(f->engine, &camera, &f->renders, err));
        MUST(visit(f, &camera, context, err));
    }
    f->passes++;
    return 0;
}

// ---- how large ----

typedef struct Probe {
    double *value[4]; // x y z and the width of a pixel that is fused, of all pixels with a depth
    size_t n, capacity;
} Probe;

static int probe_view(Fusion *f, const Camera *camera, void *context, FsError *err)
{
    Probe *probe = context;
    const Image *depth = &f->renders.layer[RENDER_DEPTH_T];
    size_t most = probe->n + fs_image_pixels(depth);
    for (int k = 0; k < 4 && most > probe->capacity; k++) {
        double *grown = realloc(probe->value[k], sizeof(double) * 2 * most);
        if (!grown) return fs_error_memory(err);
        probe->value[k] = grown;
        if (k == 3) probe->capacity = 2 * most;
    }
    int photo = fs_camera_longer_side(&f->args->photos->view[0].camera);
    double finer = (double)fs_camera_longer_side(camera) / (photo < EDGE ? photo : EDGE);
    for (int y = 0; y < depth->height; y++)
        for (int x = 0; x < depth->width; x++) {
            double z = (double)*fs_image_at(depth, x, y), world[3];
            if (!(z > 0) || !isfinite(z)) continue;
            fs_camera_to_world(
                camera,
                (const double[3]){(x + 0.5 - camera->cx) / camera->fx * z, (y + 0.5 - camera->cy) / camera->fy * z, z},
                world);
            for (int a = 0; a < 3; a++) probe->value[a][probe->n] = world[a];
            probe->value[3][probe->n++] = z / camera->fx * finer;
        }
    return 0;
}

static int make_grid(Fusion *f, FsError *err)
{
    Probe probe = {0};
    double box[2][3];
    int rc;
    TRY(each_view(f, PROBE_EDGE, probe_view, &probe, err));
    if (probe.n < 100)
        TRY(fs_error_set(err, FS_ERR_NUMERIC, "export: no mesh: the transmitted scene has no depth at the photos"));
    double step = WIDTH * fs_order_median(probe.value[3], probe.n);
    for (int a = 0; a < 3; a++) {
        fs_order_doubles(probe.value[a], probe.n);
        size_t out = (size_t)(OUTLIERS * (double)probe.n);
        double least = probe.value[a][out], most = probe.value[a][probe.n - 1 - out];
        double margin = 0.05 * (most - least) + 4 * step;
        box[0][a] = least - margin, box[1][a] = most + margin;
    }
    rc = fs_tsdf_new(&f->tsdf, box, step, MOST_VOXELS, err);
fail:
    for (int k = 0; k < 4; k++) free(probe.value[k]);
    return rc;
}

// ---- fusing ----

// The middle one of the depths around a pixel: at an edge that of one of the surfaces, and not the mean of what is
// before and behind it, which is none; and where strong texture bent it, that of its neighbours.
static float middle_depth(const Image *depth, int x, int y)
{
    float z[(2 * AROUND + 1) * (2 * AROUND + 1)];
    size_t n = 0;
    for (int j = y - AROUND; j <= y + AROUND; j++)
        for (int i = x - AROUND; i <= x + AROUND; i++)
            if (i >= 0 && j >= 0 && i < depth->width && j<depth->height && * fs_image_at(depth, i, j)> 0)
                z[n++] = *fs_image_at(depth, i, j);
    if (*fs_image_at(depth, x, y) <= 0 || n == 0) return 0;
    fs_order_floats(z, n);
    return z[n / 2];
}

typedef struct SmoothJobs {
    const Image *depth;
    Image *middle;
} SmoothJobs;

static void smooth_row(void *context, int y, int worker)
{
    (void)worker;
    const SmoothJobs *jobs = context;
    for (int x = 0; x < jobs->depth->width; x++) *fs_image_at(jobs->middle, x, y) = middle_depth(jobs->depth, x, y);
}

static int fuse_view(Fusion *f, const Camera *camera, void *context, FsError *err)
{
    (void)context;
    const Image *depth = &f->renders.layer[RENDER_DEPTH_T];
    Image middle;
    MUST(fs_image_new(&middle, depth->width, depth->height, 1, err));
    SmoothJobs jobs = {depth, &middle};
    fs_threads_for(f->threads, depth->height, smooth_row, &jobs);
    fs_tsdf_fuse(&f->tsdf, camera, &middle, f->threads);
    fs_image_free(&middle);
    return 0;
}

// ---- colours ----

static int gather_light(Fusion *f, const Camera *camera, void *context, FsError *err)
{
    (void)context, (void)err;
    const Image *depth = &f->renders.layer[RENDER_DEPTH_T];
    for (size_t v = 0; v < (size_t)f->mesh.n; v++) {
        const float *at = f->mesh.xyz + 3 * v;
        double px[2], z = fs_camera_sees(camera, (const double[3]){at[0], at[1], at[2]}, px);
        if (!(z > 0)) continue;
        int x = (int)px[0], y = (int)px[1];
        if (fabs((double)*fs_image_at(depth, x, y) - z) > f->tsdf.reach) continue; // something else is before it
        float *sum = f->light + 7 * v;
        for (int c = 0; c < 3; c++) {
            sum[c] += fs_image_at(&f->renders.layer[RENDER_T_N], x, y)[c];
            sum[3 + c] += fs_image_at(&f->renders.layer[RENDER_T_F], x, y)[c];
        }
        sum[6] += 1;
    }
    return 0;
}

static int write_colored(Fusion *f, Layer layer, const char *ending, FsError *err)
{
    const Log *log = &f->args->project->log;
    FilePath path = fs_file_at("%s/export/%s.%s", f->args->project->out, fs_layers[layer].name, ending);
    for (size_t v = 0; v < (size_t)f->mesh.n; v++) {
        const float *sum = f->light + 7 * v + (layer == LAYER_T_F ? 3 : 0);
        float color[3];
        for (int c = 0; c < 3; c++) color[c] = sum[c] / fmaxf(f->light[7 * v + 6], 1);
        fs_preview_develop(&f->args->development->light, color);
        for (size_t c = 0; c < 3; c++)
            f->mesh.rgb[3 * v + c] = (unsigned char)fs_splats_level(255 * (double)color[c], 255);
    }
    MUST(fs_mesh_write(&f->mesh, path.text, err));
    fs_log_info(log, "export: %s: mesh of %d triangles, from a grid of %.3g units: %s", fs_layers[layer].name,
                f->mesh.triangles, f->tsdf.step, path.text);
    return 0;
}

static int make_mesh(Fusion *f, FsError *err)
{
    MUST(make_grid(f, err));
    MUST(each_view(f, EDGE, fuse_view, NULL, err));
    MUST(fs_mesh_extract(&f->tsdf, SEEN_BY < f->args->photos->n ? SEEN_BY : f->args->photos->n, &f->mesh, err));
    MUST(fs_mesh_drop_pieces(&f->mesh, SMALLEST, err));
    f->light = calloc((size_t)f->mesh.n + 1, 7 * sizeof(float));
    if (!f->light) return fs_error_memory(err);
    return each_view(f, EDGE, gather_light, NULL, err);
}

int fs_surface_run(const ExportArgs *args, const char *ending, FsError *err)
{
    const Settings *set = &args->project->set;
    Fusion f = {.args = args};
    FsError why = {0};
    int rc;
    if (!args->photos->n)
        return fs_error_input(err, "%s/views.json: missing or without photos, and a mesh is made of what they see",
                              args->project->out);
    TRY(fs_engine_new(&f.engine, set->device, set->cpu, set->threads, err));
    TRY(fs_engine_scene_up(f.engine, args->scene, err));
    f.threads = fs_threads_new(set->threads);
    if (!f.threads) TRY(fs_error_memory(err));
    rc = make_mesh(&f, &why);
    if (rc == FS_ERR_NUMERIC) { // the other formats are to be had
        fs_log_warn(&args->project->log, "%s", why.message);
        rc = 0;
        goto fail;
    }
    if (rc < 0) TRY(fs_error_set(err, rc, "%s", why.message));
    bool field = fs_radiance_is(&args->scene->field), two = args->scene->separation == SEPARATION_FULL;
    if (field || fs_colors_cloud(args->scene, LAYER_T_N)) TRY(write_colored(&f, LAYER_T_N, ending, err));
    if (field ? two : fs_colors_cloud(args->scene, LAYER_T_F) != NULL) TRY(write_colored(&f, LAYER_T_F, ending, err));
fail:
    free(f.light);
    fs_mesh_free(&f.mesh);
    fs_tsdf_free(&f.tsdf);
    fs_engine_renders_free(&f.renders);
    fs_engine_free(f.engine);
    fs_threads_free(f.threads);
    return rc;
}
