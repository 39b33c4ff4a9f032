#include "model/camera.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/linalg.h"
#include "base/order.h"
#include "image/image.h"

Camera fs_camera_resized(const Camera *camera, int width, int height)
{
    Camera c = *camera;
    double sx = (double)width / camera->width, sy = (double)height / camera->height;
    c.width = width;
    c.height = height;
    c.fx *= sx;
    c.cx *= sx;
    c.fy *= sy;
    c.cy *= sy;
    return c;
}

Camera fs_camera_long_edge(const Camera *camera, int long_edge)
{
    if (long_edge <= 0) return *camera;
    double s = (double)long_edge / (camera->width > camera->height ? camera->width : camera->height);
    int w = (int)lround(camera->width * s), h = (int)lround(camera->height * s);
    return fs_camera_resized(camera, w < 1 ? 1 : w, h < 1 ? 1 : h);
}

Camera fs_camera_limited(const Camera *camera, int long_edge)
{
    int width = camera->width, height = camera->height;
    fs_image_limit(long_edge, &width, &height);
    return width == camera->width && height == camera->height ? *camera : fs_camera_resized(camera, width, height);
}

void fs_camera_centre(const Camera *camera, double centre[3])
{
    const double *m = camera->w2c;
    for (int i = 0; i < 3; i++) centre[i] = -(m[i] * m[3] + m[4 + i] * m[7] + m[8 + i] * m[11]);
}

// Cameras so many times as far from the middle as half of them are stand apart, where one in so many does at most: an
// overview from some steps back, a photo posed wrong. Of paths and grids the farthest is twice as far, of the made
// captures 1.9 times at most; of places scattered along a line by a normal distribution one in 150 is beyond four
// times.
#define APART_TIMES 4.0
#define APART_ONE_IN 5

static void centre_of(const Camera *camera, size_t stride, int i, double centre[3])
{
    fs_camera_centre((const Camera *)((const char *)camera + (size_t)i * stride), centre);
}

// Each camera's distance from the middle of all in each direction. Returns beyond which distance cameras stand apart.
static double find_apart(const Camera *camera, size_t stride, int n, double *sorted, double *distance)
{
    double middle[3], c[3];
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < n; i++) centre_of(camera, stride, i, c), sorted[i] = c[k];
        middle[k] = fs_order_median(sorted, (size_t)n);
    }
    for (int i = 0; i < n; i++) {
        centre_of(camera, stride, i, c);
        sorted[i] = distance[i] = sqrt(v3_distance2(c, middle));
    }
    double beyond = APART_TIMES * fs_order_median(sorted, (size_t)n);
    int apart = 0;
    for (int i = 0; i < n; i++) apart += distance[i] > beyond;
    return beyond > 0 && apart * APART_ONE_IN <= n ? beyond : INFINITY;
}

double fs_camera_extent(const Camera *camera, size_t stride, int n, double centre[3])
{
    double c[3], extent = 0, beyond = INFINITY, *distance = calloc(2 * (size_t)n + 1, sizeof *distance);
    if (distance)
        beyond = find_apart(camera, stride, n, distance + n, distance);
    else
        fs_error_memory(NULL);
    int near = 0;
    for (int i = 0; i < n && distance; i++) near += distance[i] <= beyond;
    for (int k = 0; k < 3; k++) centre[k] = 0;
    for (int i = 0; i < n && distance; i++) {
        if (distance[i] > beyond) continue;
        centre_of(camera, stride, i, c);
        for (int k = 0; k < 3; k++) centre[k] += c[k] / near;
    }
    for (int i = 0; i < n && distance; i++) {
        if (distance[i] > beyond) continue;
        centre_of(camera, stride, i, c);
        extent = fmax(extent, sqrt(v3_distance2(c, centre)));
    }
    free(distance);
    return extent;
}

double fs_camera_project(const Camera *camera, const double world[3], double pixel[2])
{
    const double *m = camera->w2c;
    double p[3];
    for (int i = 0; i < 3; i++)
        p[i] = m[4 * i] * world[0] + m[4 * i + 1] * world[1] + m[4 * i + 2] * world[2] + m[4 * i + 3];
    if (p[2] > 0) {
        pixel[0] = camera->fx * p[0] / p[2] + camera->cx;
        pixel[1] = camera->fy * p[1] / p[2] + camera->cy;
    }
    return p[2];
}

double fs_camera_sees(const Camera *camera, const double world[3], double pixel[2])
{
    double z = fs_camera_project(camera, world, pixel);
    return z > 0 && pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < camera->width && pixel[1] < camera->height ? z : 0;
}

bool fs_camera_is_rotation(const double m[12], double slack)
{
    double z[3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j <= i; j++)
            if (!(fabs(v3_dot(m + 4 * i, m + 4 * j) - (i == j)) < slack)) return false;
    v3_cross(m, m + 4, z);
    return v3_dot(z, m + 8) > 0;
}

void fs_camera_quat_to_rotation(const double q[4], double r[9])
{
    double n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (n == 0) n = 1;
    double w = q[0] / n, x = q[1] / n, y = q[2] / n, z = q[3] / n;
    r[0] = 1 - 2 * (y * y + z * z);
    r[1] = 2 * (x * y - w * z);
    r[2] = 2 * (x * z + w * y);
    r[3] = 2 * (x * y + w * z);
    r[4] = 1 - 2 * (x * x + z * z);
    r[5] = 2 * (y * z - w * x);
    r[6] = 2 * (x * z - w * y);
    r[7] = 2 * (y * z + w * x);
    r[8] = 1 - 2 * (x * x + y * y);
}

static void rotation_to_quat(const double r[9], double q[4])
{
    double trace = r[0] + r[4] + r[8];
    if (trace > 0) {
        double s = 2 * sqrt(trace + 1);
        q[0] = s / 4;
        q[1] = (r[7] - r[5]) / s;
        q[2] = (r[2] - r[6]) / s;
        q[3] = (r[3] - r[1]) / s;
        return;
    }
    int i = r[4] > r[0] ? 1 : 0;
    if (r[8] > r[4 * i]) i = 2;
    int j = (i + 1) % 3, k = (i + 2) % 3;
    double s = 2 * sqrt(1 + r[4 * i] - r[4 * j] - r[4 * k]);
    q[0] = (r[3 * k + j] - r[3 * j + k]) / s;
    q[1 + i] = s / 4;
    q[1 + j] = (r[3 * j + i] + r[3 * i + j]) / s;
    q[1 + k] = (r[3 * k + i] + r[3 * i + k]) / s;
}

void fs_camera_pose_from_quat(const double quat[4], const double t[3], double w2c[12])
{
    double r[9];
    fs_camera_quat_to_rotation(quat, r);
    for (int i = 0; i < 3; i++) {
        memcpy(w2c + 4 * i, r + 3 * i, 3 * sizeof *r);
        w2c[4 * i + 3] = t[i];
    }
}

void fs_camera_pose_from_axes(const double axes[12], const double centre[3], double w2c[12])
{
    double r[9], quat[4];
    for (int i = 0; i < 3; i++) memcpy(r + 3 * i, axes + 4 * i, 3 * sizeof *r);
    rotation_to_quat(r, quat); // back and forth: takes out the rounding
    fs_camera_quat_to_rotation(quat, r);
    for (int i = 0; i < 3; i++) {
        memcpy(w2c + 4 * i, r + 3 * i, 3 * sizeof *r);
        w2c[4 * i + 3] = -v3_dot(r + 3 * i, centre);
    }
}

void fs_camera_pose_to_quat(const double w2c[12], double quat[4], double t[3])
{
    double r[9];
    for (int i = 0; i < 3; i++) {
        memcpy(r + 3 * i, w2c + 4 * i, 3 * sizeof *r);
        t[i] = w2c[4 * i + 3];
    }
    rotation_to_quat(r, quat);
}

void fs_camera_relative(const Camera *from, const Camera *to, double rotation[9], double t[3])
{
    for (int i = 0; i < 3; i++) {
        t[i] = to->w2c[4 * i + 3];
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++) sum += to->w2c[4 * i + k] * from->w2c[4 * j + k];
            rotation[3 * i + j] = sum;
            t[i] -= sum * from->w2c[4 * j + 3];
        }
    }
}

int fs_camera_longer_side(const Camera *camera)
{
    return camera->width > camera->height ? camera->width : camera->height;
}

void fs_camera_to_world(const Camera *camera, const double in_camera[3], double world[3])
{
    const double *m = camera->w2c;
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = in_camera[k] - m[4 * k + 3];
    for (int k = 0; k < 3; k++) world[k] = m[k] * p[0] + m[4 + k] * p[1] + m[8 + k] * p[2];
}
