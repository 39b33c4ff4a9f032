#include "initialise/small_views.h"

#include <math.h>
#include <stdlib.h>

static int load_frame(Frame *frame, const char *out, const View *view, int long_edge, FsError *err)
{
    int rc = 0;
    Image photo = {0}, mask = {0}, small_mask = {0};
    frame->camera = fs_camera_limited(&view->camera, long_edge);
    frame->flash = view->flash;
    TRY(fs_dataset_load_view(out, view, &photo, &mask, err));
    TRY(fs_image_resize_area(&photo, frame->camera.width, frame->camera.height, &frame->photo, err));
    TRY(fs_image_resize_area(&mask, frame->camera.width, frame->camera.height, &small_mask, err));
    size_t n = (size_t)frame->camera.width * (size_t)frame->camera.height;
    for (size_t i = 0; i < n; i++)
        if (small_mask.px[i] < 0.99f)
            for (int c = 0; c < 3; c++) frame->photo.px[3 * i + (size_t)c] = NAN;
fail:
    fs_image_free(&photo);
    fs_image_free(&mask);
    fs_image_free(&small_mask);
    return rc;
}

int fs_small_views_load(Frames *frames, const char *out, const Dataset *dataset, int long_edge, FsError *err)
{
    int rc = 0;
    *frames = (Frames){0};
    frames->frame = calloc((size_t)dataset->n + 1, sizeof *frames->frame);
    if (!frames->frame) return fs_error_memory(err);
    for (int i = 0; i < dataset->n; i++) {
        if (dataset->view[i].held_out) continue;
        frames->n++; // before loading, so that a half loaded frame is freed
        TRY(load_frame(&frames->frame[frames->n - 1], out, &dataset->view[i], long_edge, err));
    }
    fs_small_views_finish(frames);
    return 0;
fail:
    fs_small_views_free(frames);
    return rc;
}

static void normalise(double v[3])
{
    double n = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++) v[i] = n > 0 ? v[i] / n : 0;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

void fs_small_views_finish(Frames *frames)
{
    double down[3] = {0};
    frames->n_flash = 0;
    frames->focal_px = 0;
    for (int k = 0; k < 3; k++) frames->centre[k] = frames->forward[k] = 0;
    for (int i = 0; i < frames->n; i++) {
        Frame *f = &frames->frame[i];
        fs_camera_centre(&f->camera, f->centre);
        frames->n_flash += f->flash;
        frames->focal_px += f->camera.fx / frames->n;
        for (int k = 0; k < 3; k++) {
            frames->centre[k] += f->centre[k] / frames->n;
            frames->forward[k] += f->camera.w2c[8 + k];
            down[k] += f->camera.w2c[4 + k];
        }
    }
    normalise(frames->forward);
    cross(down, frames->forward, frames->right);
    normalise(frames->right);
    cross(frames->forward, frames->right, frames->down);
    frames->extent = 0;
    for (int i = 0; i < frames->n; i++) {
        double d2 = 0;
        for (int k = 0; k < 3; k++) d2 += pow(frames->frame[i].centre[k] - frames->centre[k], 2);
        frames->extent = fmax(frames->extent, sqrt(d2));
    }
}

void fs_small_views_free(Frames *frames)
{
    for (int i = 0; i < frames->n; i++) fs_image_free(&frames->frame[i].photo);
    free(frames->frame);
    *frames = (Frames){0};
}

bool fs_small_views_direction(const Frames *frames, const float xyz[3], float uvl[3])
{
    double x = 0, y = 0, z = 0;
    for (int k = 0; k < 3; k++) {
        double d = xyz[k] - frames->centre[k];
        x += d * frames->right[k];
        y += d * frames->down[k];
        z += d * frames->forward[k];
    }
    if (!(z > 1e-3 * (fabs(x) + fabs(y))) || !(z > 0)) return false;
    uvl[0] = (float)(x / z);
    uvl[1] = (float)(y / z);
    uvl[2] = (float)log(z);
    return isfinite(uvl[0]) && isfinite(uvl[1]) && isfinite(uvl[2]);
}

bool fs_small_views_sample(const Frame *frame, double x, double y, float rgb[3])
{
    const Image *im = &frame->photo;
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
    const double *m = camera->w2c;
    double p[3] = {(x - camera->cx) / camera->fx * z - m[3], (y - camera->cy) / camera->fy * z - m[7], z - m[11]};
    for (int k = 0; k < 3; k++) xyz[k] = (float)(m[k] * p[0] + m[4 + k] * p[1] + m[8 + k] * p[2]);
}
