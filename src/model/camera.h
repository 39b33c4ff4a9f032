// A pinhole camera in COLMAP's conventions: world-to-camera, x right, y down, z forward, pixel centres at +0.5.
#pragma once

#include <stdbool.h>
#include <stddef.h>

typedef struct Camera {
    int width, height;
    double fx, fy, cx, cy; // pixels of width x height
    double w2c[12];        // (3, 4) row-major: [R | t], x_camera = R x_world + t
} Camera;

// The same view at another image size (fractions of the frame stay where they are).
Camera fs_camera_resized(const Camera *camera, int width, int height);
// The same view with exactly long_edge on the longer side, larger or smaller; 0: as it is.
Camera fs_camera_long_edge(const Camera *camera, int long_edge);
// The same view with the longer side at most long_edge pixels (0: unchanged); never enlarges.
Camera fs_camera_limited(const Camera *camera, int long_edge);
int fs_camera_longer_side(const Camera *camera);               // pixels
void fs_camera_centre(const Camera *camera, double centre[3]); // -R^T t
// The mean of n cameras' centres, and the largest distance from it; a few that stand far apart from the others do not
// count. stride: bytes from one camera to the next.
double fs_camera_extent(const Camera *camera, size_t stride, int n, double centre[3]);
// Projects a world point; returns depth z (pixel written when z > 0).
double fs_camera_project(const Camera *camera, const double world[3], double pixel[2]);
// The same of a point that the picture shows; 0 where it is behind the camera or beside the picture.
double fs_camera_sees(const Camera *camera, const double world[3], double pixel[2]);
void fs_camera_to_world(const Camera *camera, const double in_camera[3], double world[3]);
// A rotation within `slack`: rows (the first three of each four) of unit length, at right angles, right-handed.
bool fs_camera_is_rotation(const double m[12], double slack);
void fs_camera_quat_to_rotation(const double quat_wxyz[4], double rotation[9]); // normalises
// A world-to-camera transform from and to a quaternion and a translation.
void fs_camera_pose_from_quat(const double quat_wxyz[4], const double t[3], double w2c[12]);
void fs_camera_pose_to_quat(const double w2c[12], double quat_wxyz[4], double t[3]);
// World-to-camera out of the axes (right, down, forward: the rows, three of each four numbers) and the place of a
// camera, in the world; takes out their rounding.
void fs_camera_pose_from_axes(const double axes[12], const double centre[3], double w2c[12]);
// From one camera's coordinates to another's: x_to = rotation x_from + t.
void fs_camera_relative(const Camera *from, const Camera *to, double rotation[9], double t[3]);
