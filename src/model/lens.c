#include "model/lens.h"

#include <math.h>
#include <string.h>

static const struct {
    const char *name;
    int n_params, n_focal; // parameters are: n_focal focal lengths, cx, cy, distortion
} models[] = {
    {"SIMPLE_PINHOLE", 3, 1},
    {"PINHOLE", 4, 2},
    {"SIMPLE_RADIAL", 4, 1},
    {"RADIAL", 5, 1},
    {"OPENCV", 8, 2},
    {"OPENCV_FISHEYE", 8, 2},
    {"FULL_OPENCV", 12, 2},
    {"FOV", 5, 2},
    {"SIMPLE_RADIAL_FISHEYE", 4, 1},
    {"RADIAL_FISHEYE", 5, 1},
    {"THIN_PRISM_FISHEYE", 12, 2},
    // COLMAP 4: read past, not used
    {"RAD_TAN_THIN_PRISM_FISHEYE", 16, 2},
    {"SIMPLE_DIVISION", 4, 1},
    {"DIVISION", 5, 2},
    {"SIMPLE_FISHEYE", 3, 1},
    {"FISHEYE", 4, 2},
    {"EUCM", 6, 2},
    {"EQUIRECTANGULAR", 2, 0},
};
#define N_MODELS ((int)(sizeof models / sizeof *models))
#define BORDER_STEPS 32

const char *fs_lens_model_name(int model, int *n_params)
{
    if (model < 0 || model >= N_MODELS) return NULL;
    if (n_params) *n_params = models[model].n_params;
    return models[model].name;
}

int fs_lens_model_find(const char *name)
{
    for (int i = 0; i < N_MODELS; i++)
        if (strcmp(models[i].name, name) == 0) return i;
    return -1;
}

static Camera intrinsics(const Lens *lens)
{
    const double *p = lens->param + models[lens->model].n_focal;
    return (Camera){lens->width, lens->height, lens->param[0], p[-1], p[0], p[1], {0}};
}

int fs_lens_camera(const Lens *lens, const char *file, Camera *camera, FsError *err)
{
    *camera = (Camera){.width = lens->width, .height = lens->height};
    if (lens->model < 0 || lens->model >= LENS_MODELS)
        return fs_error_input(err, "%s: camera model %s cannot be used; undistort the photos to PINHOLE", file,
                              lens->model < N_MODELS && lens->model >= 0 ? models[lens->model].name : "unknown");
    for (int i = 0; i < models[lens->model].n_params; i++)
        if (!isfinite(lens->param[i]))
            return fs_error_input(err, "%s: a camera has a parameter that is not a number", file);
    *camera = intrinsics(lens);
    if (lens->width < 1 || lens->height < 1 || !(camera->fx > 0) || !(camera->fy > 0))
        return fs_error_input(err, "%s: a camera has no size or no positive focal length", file);
    return 0;
}

bool fs_lens_is_pinhole(const Lens *lens)
{
    if (lens->model == LENS_OPENCV_FISHEYE || lens->model == LENS_SIMPLE_RADIAL_FISHEYE ||
        lens->model == LENS_RADIAL_FISHEYE || lens->model == LENS_THIN_PRISM_FISHEYE)
        return false; // a fisheye projection even without coefficients
    for (int i = models[lens->model].n_focal + 2; i < models[lens->model].n_params; i++)
        if (lens->param[i] != 0) return false;
    return true;
}

bool fs_lens_equal(const Lens *a, const Lens *b)
{
    bool equal = a->model == b->model && a->width == b->width && a->height == b->height;
    for (int i = 0; i < FS_LENS_MAX_PARAMS; i++) equal &= a->param[i] == b->param[i];
    return equal;
}

Lens fs_lens_from_camera(const Camera *camera)
{
    return (Lens){.model = LENS_PINHOLE,
                  .width = camera->width,
                  .height = camera->height,
                  .param = {camera->fx, camera->fy, camera->cx, camera->cy}};
}

Lens fs_lens_resized(const Lens *lens, int width, int height)
{
    Lens l = *lens;
    double sx = (double)width / lens->width, sy = (double)height / lens->height;
    int n = models[lens->model].n_focal;
    l.width = width;
    l.height = height;
    l.param[0] *= n == 1 ? 0.5 * (sx + sy) : sx;
    if (n == 2) l.param[1] *= sy;
    l.param[n] *= sx;
    l.param[n + 1] *= sy;
    return l;
}

// A quarter of a turn clockwise moves what is at (x, y) to (-y, x).
static void turn_quarter(double *x, double *y)
{
    double was = *x;
    *x = -*y;
    *y = was;
}

Lens fs_lens_turned(const Lens *lens, int quarters)
{
    Lens l = *lens;
    int n = models[l.model].n_focal;
    double *centre = l.param + n, *k = centre + 2;
    for (int i = 0; i < quarters; i++) {
        if (n == 2) l.param[0] = lens->param[(i + 1) % 2], l.param[1] = lens->param[i % 2];
        turn_quarter(&centre[0], &centre[1]);
        centre[0] += l.height;
        if (l.model == LENS_OPENCV || l.model == LENS_FULL_OPENCV || l.model == LENS_THIN_PRISM_FISHEYE)
            turn_quarter(&k[3], &k[2]); // the tangential ones: p2 is along x
        if (l.model == LENS_THIN_PRISM_FISHEYE) turn_quarter(&k[6], &k[7]);
        int width = l.width;
        l.width = l.height;
        l.height = width;
    }
    return l;
}

Lens fs_lens_padded(const Lens *lens, const double margin[2], int width, int height)
{
    Lens l = *lens;
    double *centre = l.param + models[l.model].n_focal;
    l.width = width;
    l.height = height;
    centre[0] += margin[0];
    centre[1] += margin[1];
    return l;
}

static void tangential(double u, double v, double r2, double p1, double p2, double out[2])
{
    out[0] = 2 * p1 * u * v + p2 * (r2 + 2 * u * u);
    out[1] = 2 * p2 * u * v + p1 * (r2 + 2 * v * v);
}

// Ray -> ray after the lens.
static void distort(const Lens *lens, const double ray[2], double out[2])
{
    const double *k = lens->param + models[lens->model].n_focal + 2;
    double off = sqrt(ray[0] * ray[0] + ray[1] * ray[1]), t[2] = {0, 0}, s = 1;
    bool fisheye = lens->model >= LENS_SIMPLE_RADIAL_FISHEYE || lens->model == LENS_OPENCV_FISHEYE;
    double bend = fisheye && off > 1e-12 ? atan(off) / off : 1; // equidistant: distance from the axis becomes angle
    double p[2] = {ray[0] * bend, ray[1] * bend};
    double r2 = p[0] * p[0] + p[1] * p[1], r4 = r2 * r2, r6 = r4 * r2, r8 = r4 * r4, r = sqrt(r2);
    switch (lens->model) {
    case LENS_SIMPLE_RADIAL:
    case LENS_SIMPLE_RADIAL_FISHEYE: s = 1 + k[0] * r2; break;
    case LENS_RADIAL:
    case LENS_RADIAL_FISHEYE: s = 1 + k[0] * r2 + k[1] * r4; break;
    case LENS_OPENCV:
        s = 1 + k[0] * r2 + k[1] * r4;
        tangential(p[0], p[1], r2, k[2], k[3], t);
        break;
    case LENS_OPENCV_FISHEYE: s = 1 + k[0] * r2 + k[1] * r4 + k[2] * r6 + k[3] * r8; break;
    case LENS_FULL_OPENCV:
        s = (1 + k[0] * r2 + k[1] * r4 + k[4] * r6) / (1 + k[5] * r2 + k[6] * r4 + k[7] * r6);
        tangential(p[0], p[1], r2, k[2], k[3], t);
        break;
    case LENS_FOV:
        if (fabs(k[0]) > 1e-9 && r > 1e-12) s = atan(r * 2 * tan(k[0] / 2)) / (r * k[0]);
        break;
    case LENS_THIN_PRISM_FISHEYE:
        s = 1 + k[0] * r2 + k[1] * r4 + k[4] * r6 + k[5] * r8;
        tangential(p[0], p[1], r2, k[2], k[3], t);
        t[0] += k[6] * r2;
        t[1] += k[7] * r2;
        break;
    default: break;
    }
    out[0] = p[0] * s + t[0];
    out[1] = p[1] * s + t[1];
}

void fs_lens_project(const Lens *lens, const double ray[2], double pixel[2])
{
    double d[2];
    Camera c = intrinsics(lens);
    distort(lens, ray, d);
    pixel[0] = c.fx * d[0] + c.cx;
    pixel[1] = c.fy * d[1] + c.cy;
}

bool fs_lens_unproject(const Lens *lens, const double pixel[2], double ray[2])
{
    Camera camera = intrinsics(lens);
    double target[2] = {(pixel[0] - camera.cx) / camera.fx, (pixel[1] - camera.cy) / camera.fy};
    ray[0] = target[0];
    ray[1] = target[1];
    for (int i = 0; i < 50; i++) { // Newton's method, numeric slopes
        const double h = 1e-6;
        double f[2], fu[2], fv[2];
        distort(lens, ray, f);
        double e[2] = {f[0] - target[0], f[1] - target[1]};
        if (fabs(e[0]) + fabs(e[1]) < 1e-12) return true;
        distort(lens, (double[2]){ray[0] + h, ray[1]}, fu);
        distort(lens, (double[2]){ray[0], ray[1] + h}, fv);
        double a = (fu[0] - f[0]) / h, b = (fv[0] - f[0]) / h, c = (fu[1] - f[1]) / h, d = (fv[1] - f[1]) / h;
        double det = a * d - b * c;
        if (!(fabs(det) > 1e-12)) return false;
        ray[0] -= (d * e[0] - b * e[1]) / det;
        ray[1] -= (a * e[1] - c * e[0]) / det;
    }
    double f[2];
    distort(lens, ray, f);
    return fabs(f[0] - target[0]) + fabs(f[1] - target[1]) < 1e-7;
}

double fs_lens_widening(const Lens *lens, double most)
{
    const Camera c = intrinsics(lens);
    const double side[2] = {lens->width, lens->height};
    double times = 1;
    for (int i = 0; i < 4 * BORDER_STEPS && !fs_lens_is_pinhole(lens); i++) { // from corner to corner on each side
        double t = (double)(i / 4) / (BORDER_STEPS - 1), pixel[2], ray[2];
        pixel[i % 2] = (i & 2 ? 1 : 0) * side[i % 2];
        pixel[1 - i % 2] = t * side[1 - i % 2];
        if (!fs_lens_unproject(lens, pixel, ray)) continue;
        double x = c.fx * ray[0], y = c.fy * ray[1];
        times = fmax(times, fmax(x / (x > 0 ? side[0] - c.cx : -c.cx), y / (y > 0 ? side[1] - c.cy : -c.cy)));
    }
    return fmin(times, most);
}
