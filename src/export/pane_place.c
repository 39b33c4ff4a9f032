#include "export/pane_place.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "base/order.h"

#define NEAREST 0.01  // share of a cloud's opacity that may lie before the pane: what floats there
#define STEEPEST 0.15 // cosine with the normal: rays that graze the pane say nothing of its size

// Bars stand before the pane.
static double behind(const Cloud *cloud, int i)
{
    double opacity = 1 / (1 + exp(-(double)cloud->field[CLOUD_OPACITIES][i]));
    return cloud->width[CLOUD_COVERS] ? opacity * (1 - (double)cloud->field[CLOUD_COVERS][i]) : opacity;
}

// Where a cloud begins along the normal.
static int nearest_of(const Cloud *cloud, const double normal[3], double *nearest, FsError *err)
{
    Ranked *rank = malloc(sizeof *rank * ((size_t)cloud->n + 1));
    if (!rank) return fs_error_memory(err);
    double total = 0, sum = 0;
    int n = 0;
    for (int i = 0; i < cloud->n; i++) {
        const float *mean = cloud->field[CLOUD_MEANS] + 3 * (size_t)i;
        double at = v3_dot(normal, (const double[3]){mean[0], mean[1], mean[2]});
        double opacity = behind(cloud, i);
        if (isfinite(at) && isfinite(opacity)) rank[n++] = (Ranked){at, i}, total += opacity;
    }
    fs_order_ranked(rank, (size_t)n);
    for (int k = 0; k < n && sum <= NEAREST * total; k++) {
        sum += behind(cloud, rank[k].index);
        if (sum > NEAREST * total && rank[k].by < *nearest) *nearest = rank[k].by;
    }
    free(rank);
    return 0;
}

// From corner k of a photo to the pane; false where it does not meet it.
static bool meet(const Camera *camera, int k, const PanePlace *place, double at[3])
{
    double centre[3], ray[3], x = k % 2 ? camera->width : 0, y = k / 2 ? camera->height : 0;
    const double in_camera[3] = {(x - camera->cx) / camera->fx, (y - camera->cy) / camera->fy, 1}, *m = camera->w2c;
    fs_camera_centre(camera, centre);
    for (int a = 0; a < 3; a++) ray[a] = m[a] * in_camera[0] + m[4 + a] * in_camera[1] + m[8 + a] * in_camera[2];
    double towards = v3_dot(ray, place->normal), far = (place->distance - v3_dot(centre, place->normal)) / towards;
    if (!(towards > STEEPEST * sqrt(v3_dot(ray, ray))) || !(far > 0)) return false;
    for (int a = 0; a < 3; a++) at[a] = centre[a] + far * ray[a];
    return true;
}

// The rectangle in the pane, its sides along the photos' rows and columns.
static void find_corners(const Dataset *photos, PanePlace *place)
{
    double side[2][3], range[2][2] = {{INFINITY, -INFINITY}, {INFINITY, -INFINITY}}, at[3];
    const double *n = place->normal, *m = photos->view[0].camera.w2c; // rows: right, down
    double across = v3_dot(m, n);
    for (int a = 0; a < 3; a++) side[0][a] = m[a] - across * n[a];
    if (!(v3_normalise(side[0]) > 1e-6)) return;
    v3_cross(n, side[0], side[1]);
    for (int v = 0; v < photos->n; v++)
        for (int k = 0; k < 4; k++) {
            if (!meet(&photos->view[v].camera, k, place, at)) continue;
            for (int s = 0; s < 2; s++) {
                double along = v3_dot(at, side[s]);
                range[s][0] = fmin(range[s][0], along);
                range[s][1] = fmax(range[s][1], along);
            }
        }
    place->has_corners = isfinite(range[0][0]) && range[0][1] > range[0][0] && range[1][1] > range[1][0];
    for (int k = 0; k < 4 && place->has_corners; k++)
        for (int a = 0; a < 3; a++)
            place->corner[k][a] = (float)(place->distance * n[a] + range[0][k == 1 || k == 2] * side[0][a] +
                                          range[1][k / 2] * side[1][a]);
    for (int i = 0; i < 12 && place->has_corners; i++) place->has_corners = isfinite(place->corner[i / 3][i % 3]);
}

int fs_pane_place_find(const Scene *scene, const Dataset *photos, double given, PanePlace *place, FsError *err)
{
    *place = (PanePlace){0};
    double *n = place->normal, centre[3] = {0};
    memcpy(n, scene->pane.normal, sizeof place->normal);
    if (!scene->pane_beta || !(v3_normalise(n) > 0))
        return fs_error_input(err, "this scene has no pane that was learned (--beta pane): it cannot be mirrored back");
    double farthest = -INFINITY, nearest = INFINITY, ahead = 0;
    if (photos->n) fs_dataset_extent(photos, centre);
    for (int v = 0; v < photos->n; v++) ahead += v3_dot(photos->view[v].camera.w2c + 8, n);
    for (int a = 0; a < 3 && ahead < 0; a++) n[a] *= -1; // which side is behind, the photos say
    for (int v = 0; v < photos->n; v++) {
        double at[3];
        fs_camera_centre(&photos->view[v].camera, at);
        farthest = fmax(farthest, v3_dot(at, n));
    }
    for (int l = 0; l < LAYERS; l++)
        if (l != LAYER_BETA) MUST(nearest_of(&scene->cloud[l], n, &nearest, err));
    if (!isfinite(nearest)) nearest = v3_dot(centre, n);
    place->distance = given > 0 ? v3_dot(centre, n) + given : fmax(nearest, farthest);
    if (photos->n) find_corners(photos, place);
    return 0;
}
