#include "initialise/small_views.h"

#include <math.h>
#include <stdlib.h>

#include "base/linalg.h"
#include "initialise/constants.h"

static int load_view(SmallView *view, const char *out, const View *from, int long_edge, FsError *err)
{
    int rc = 0;
    Image photo = {0}, mask = {0}, small_mask = {0};
    view->camera = fs_camera_limited(&from->camera, long_edge);
    view->flash = from->flash;
    TRY(fs_dataset_load_view(out, from, &photo, &mask, err));
    TRY(fs_image_resize_area(&photo, view->camera.width, view->camera.height, &view->photo, err));
    TRY(fs_image_resize_area(&mask, view->camera.width, view->camera.height, &small_mask, err));
    size_t n = (size_t)view->camera.width * (size_t)view->camera.height;
    double mean = 0;
    view->clipped = calloc(n + 1, 1);
    if (!view->clipped) TRY(fs_error_memory(err));
    for (size_t i = 0; i < 3 * n; i++) mean += (double)view->photo.px[i] / (3 * (double)n);
    for (size_t i = 0; i < n; i++) {
        float *p = view->photo.px + 3 * i;
        if (small_mask.px[i] >= 0.99f) continue;
        bool bright = fmaxf(p[0], fmaxf(p[1], p[2])) > LAMP_BRIGHT * (float)mean; // what is masked is black
        view->clipped[i] = bright && small_mask.px[i] < 0.5f * FS_MASK_PART;
        p[0] = p[1] = p[2] = NAN;
    }
fail:
    fs_image_free(&photo);
    fs_image_free(&mask);
    fs_image_free(&small_mask);
    return rc;
}

int fs_small_views_load(SmallViews *views, const char *out, const Dataset *dataset, int long_edge, FsError *err)
{
    int rc = 0;
    *views = (SmallViews){.lift = dataset->n && dataset->view[0].lift > 0 ? dataset->view[0].lift : 1};
    views->view = calloc((size_t)dataset->n + 1, sizeof *views->view);
    if (!views->view) return fs_error_memory(err);
    for (int i = 0; i < dataset->n; i++) {
        if (!fs_dataset_trains(&dataset->view[i])) continue;
        views->n++; // before loading, so that a half loaded view is freed
        TRY(load_view(&views->view[views->n - 1], out, &dataset->view[i], long_edge, err));
    }
    fs_small_views_finish(views);
    return 0;
fail:
    fs_small_views_free(views);
    return rc;
}

void fs_small_views_finish(SmallViews *views)
{
    double down[3] = {0};
    views->n_flash = 0;
    views->focal_px = 0;
    for (int k = 0; k < 3; k++) views->forward[k] = 0;
    for (int i = 0; i < views->n; i++) {
        SmallView *f = &views->view[i];
        fs_camera_centre(&f->camera, f->centre);
        views->n_flash += f->flash;
        views->focal_px += f->camera.fx / views->n;
        for (int k = 0; k < 3; k++) {
            views->forward[k] += f->camera.w2c[8 + k];
            down[k] += f->camera.w2c[4 + k];
        }
    }
    v3_normalise(views->forward);
    v3_cross(down, views->forward, views->right);
    v3_normalise(views->right);
    v3_cross(views->forward, views->right, views->down);
    views->extent = fs_camera_extent(&views->view->camera, sizeof *views->view, views->n, views->centre);
}

void fs_small_views_free(SmallViews *views)
{
    for (int i = 0; i < views->n; i++) {
        fs_image_free(&views->view[i].photo);
        free(views->view[i].clipped);
    }
    free(views->view);
    *views = (SmallViews){0};
}

bool fs_small_views_direction(const SmallViews *views, const float xyz[3], float uvl[3])
{
    double d[3] = {xyz[0] - views->centre[0], xyz[1] - views->centre[1], xyz[2] - views->centre[2]};
    double x = v3_dot(d, views->right), y = v3_dot(d, views->down), z = v3_dot(d, views->forward);
    if (!(z > 1e-3 * (fabs(x) + fabs(y))) || !(z > 0)) return false;
    uvl[0] = (float)(x / z);
    uvl[1] = (float)(y / z);
    uvl[2] = (float)log(z);
    return isfinite(uvl[0]) && isfinite(uvl[1]) && isfinite(uvl[2]);
}

bool fs_small_views_sample(const SmallView *view, double x, double y, float rgb[3])
{
    const Image *im = &view->photo;
    x -= 0.5;
    y -= 0.5;
    if (!(x >= 0 && y >= 0 && x <= im->width - 1 && y <= im->height - 1)) return false;
    int ix = (int)x, iy = (int)y;
    if (ix > im->width - 2) ix = im->width - 2;
    if (iy > im->height - 2) iy = im->height - 2;
    if (ix < 0 || iy < 0) return false; // one pixel wide or high
    float fx = (float)(x - ix), fy = (float)(y - iy);
    const float *p = im->px + 3 * ((size_t)iy * (size_t)im->width + (size_t)ix), *q = p + 3 * (size_t)im->width;
    for (int c = 0; c < 3; c++) {
        float top = p[c] + (p[c + 3] - p[c]) * fx, bottom = q[c] + (q[c + 3] - q[c]) * fx;
        rgb[c] = top + (bottom - top) * fy;
    }
    return isfinite(rgb[0] + rgb[1] + rgb[2]);
}

void fs_small_views_unproject(const Camera *camera, double x, double y, double z, float xyz[3])
{
    double world[3];
    fs_camera_to_world(
        camera, (const double[3]){(x - camera->cx) / camera->fx * z, (y - camera->cy) / camera->fy * z, z}, world);
    for (int k = 0; k < 3; k++) xyz[k] = (float)world[k];
}
