// Umeyama, "Least-squares estimation of transformation parameters between two point patterns" (1991): the rotation is
// the one nearest to the covariance of the two point sets. It is found here as the unit quaternion that is the leading
// eigenvector of a symmetric 4x4 matrix made of that covariance (Horn 1987), which never yields a reflection.
#include "model/similarity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "base/rng.h"

void fs_similarity_apply(const Similarity *s, const double x[3], double y[3])
{
    double out[3];
    for (int i = 0; i < 3; i++)
        out[i] = s->scale * (s->r[3 * i] * x[0] + s->r[3 * i + 1] * x[1] + s->r[3 * i + 2] * x[2]) + s->t[i];
    memcpy(y, out, sizeof out);
}

Camera fs_similarity_camera(const Similarity *s, const Camera *camera)
{
    Camera c = *camera;
    const double *m = camera->w2c;
    for (int i = 0; i < 3; i++) { // x_camera = scale (R x + t), so that depths scale with the world
        double shift = 0;
        for (int j = 0; j < 3; j++) {
            double v = 0;
            for (int k = 0; k < 3; k++) v += m[4 * i + k] * s->r[3 * j + k];
            c.w2c[4 * i + j] = v;
            shift += v * s->t[j];
        }
        c.w2c[4 * i + 3] = s->scale * m[4 * i + 3] - shift;
    }
    return c;
}

// Leading eigenvector of a symmetric 4x4 matrix by Jacobi rotations.
static void leading_eigenvector(double a[4][4], double out[4])
{
    double v[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    for (int sweep = 0; sweep < 60; sweep++)
        for (int p = 0; p < 3; p++)
            for (int q = p + 1; q < 4; q++) {
                if (fabs(a[p][q]) < 1e-300) continue;
                double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                double t = (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(theta * theta + 1));
                double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 4; k++) {
                    double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for (int k = 0; k < 4; k++) {
                    double x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                    x = v[k][p], y = v[k][q];
                    v[k][p] = c * x - s * y;
                    v[k][q] = s * x + c * y;
                }
            }
    int best = 0;
    for (int i = 1; i < 4; i++)
        if (a[i][i] > a[best][best]) best = i;
    for (int k = 0; k < 4; k++) out[k] = v[k][best];
}

// Rotation R that makes trace(R S) largest, S = sum of from to^T (row-major).
static void best_rotation(const double s[9], double r[9])
{
    double n[4][4] = {
        {s[0] + s[4] + s[8], s[5] - s[7], s[6] - s[2], s[1] - s[3]},
        {s[5] - s[7], s[0] - s[4] - s[8], s[1] + s[3], s[6] + s[2]},
        {s[6] - s[2], s[1] + s[3], -s[0] + s[4] - s[8], s[5] + s[7]},
        {s[1] - s[3], s[6] + s[2], s[5] + s[7], -s[0] - s[4] + s[8]},
    };
    double quat[4];
    leading_eigenvector(n, quat);
    fs_camera_quat_to_rotation(quat, r);
}

// Second-largest spread of the points against the largest, squared; 0 for points on a line.
static double flatness(const double (*p)[3], const double mean[3], int n)
{
    double c[4][4] = {{0}};
    for (int i = 0; i < n; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) c[j][k] += (p[i][j] - mean[j]) * (p[i][k] - mean[k]);
    double trace = c[0][0] + c[1][1] + c[2][2];
    double minors = c[0][0] * c[1][1] - c[0][1] * c[0][1] + c[0][0] * c[2][2] - c[0][2] * c[0][2] + c[1][1] * c[2][2] -
                    c[1][2] * c[1][2];
    return trace > 0 ? minors / (trace * trace) : 0;
}

static void mean_of(const double (*p)[3], int n, double mean[3])
{
    for (int j = 0; j < 3; j++) {
        mean[j] = 0;
        for (int i = 0; i < n; i++) mean[j] += p[i][j] / n;
    }
}

static int finish(const double (*from)[3], const double (*to)[3], int n, const double a[3], const double b[3],
                  Similarity *s, FsError *err)
{
    double top = 0, bottom = 0; // scale: sum of to . R from over sum of from . from
    for (int i = 0; i < n; i++)
        for (int j = 0; j < 3; j++) {
            double v = 0;
            for (int k = 0; k < 3; k++) v += s->r[3 * j + k] * (from[i][k] - a[k]);
            top += (to[i][j] - b[j]) * v;
            bottom += (from[i][j] - a[j]) * (from[i][j] - a[j]);
        }
    s->scale = bottom > 0 ? top / bottom : 0;
    if (!(s->scale > 0) || !isfinite(s->scale))
        return fs_error_input(err, "the two frames cannot be aligned: their common points do not agree");
    for (int j = 0; j < 3; j++)
        s->t[j] = b[j] - s->scale * (s->r[3 * j] * a[0] + s->r[3 * j + 1] * a[1] + s->r[3 * j + 2] * a[2]);
    return 0;
}

int fs_similarity_fit(const double (*from)[3], const double (*to)[3], int n, Similarity *s, FsError *err)
{
    double a[3], b[3], cov[9] = {0};
    if (n > 0) {
        mean_of(from, n, a);
        mean_of(to, n, b);
    }
    if (n < 3 || !(flatness(from, a, n) > 1e-10) || !(flatness(to, b, n) > 1e-10))
        return fs_error_input(err, "the two frames cannot be aligned: %d common points, or all on a line", n);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) cov[3 * j + k] += (from[i][j] - a[j]) * (to[i][k] - b[k]);
    best_rotation(cov, s->r);
    return finish(from, to, n, a, b, s, err);
}

int fs_similarity_fit_cameras(const Camera *from, const Camera *to, int n, Similarity *s, FsError *err)
{
    int rc = 0;
    double(*p)[3] = malloc(((size_t)n + 1) * sizeof *p), (*q)[3] = malloc(((size_t)n + 1) * sizeof *q);
    if (!p || !q || n < 2)
        TRY(n < 2 ? fs_error_input(err, "the two frames cannot be aligned: fewer than 2 common views")
                  : fs_error_memory(err));
    double cov[9] = {0}, a[3], b[3];
    for (int i = 0; i < n; i++) {
        fs_camera_centre(&from[i], p[i]);
        fs_camera_centre(&to[i], q[i]);
        for (int axis = 0; axis < 3; axis++) // the views' axes are directions known in both frames
            for (int j = 0; j < 3; j++)
                for (int k = 0; k < 3; k++) cov[3 * j + k] += from[i].w2c[4 * axis + j] * to[i].w2c[4 * axis + k];
    }
    mean_of(p, n, a);
    mean_of(q, n, b);
    best_rotation(cov, s->r);
    TRY(finish(p, q, n, a, b, s, err));
fail:
    free(p);
    free(q);
    return rc;
}

static int count_inliers(const Similarity *s, const double (*from)[3], const double (*to)[3], int n, double tolerance,
                         double (*in_from)[3], double (*in_to)[3])
{
    int count = 0;
    for (int i = 0; i < n; i++) {
        double y[3];
        fs_similarity_apply(s, from[i], y);
        if (!(v3_distance2(y, to[i]) <= tolerance * tolerance)) continue;
        memcpy(in_from[count], from[i], sizeof *in_from);
        memcpy(in_to[count++], to[i], sizeof *in_to);
    }
    return count;
}

int fs_similarity_fit_robust(const double (*from)[3], const double (*to)[3], int n, double tolerance, Similarity *s,
                             int *inliers, FsError *err)
{
    enum { ROUNDS = 2000 };
    int rc = 0, best = 0;
    Rng rng = fs_rng_new(7);
    Similarity trial;
    double(*p)[3] = malloc(((size_t)n + 1) * sizeof *p), (*q)[3] = malloc(((size_t)n + 1) * sizeof *q);
    *inliers = 0;
    if (!p || !q) TRY(fs_error_memory(err));
    for (int round = 0; round < ROUNDS && n >= 3; round++) {
        double f[3][3], t[3][3];
        for (int k = 0; k < 3; k++) {
            int i = fs_rng_below(&rng, n);
            memcpy(f[k], from[i], sizeof f[k]);
            memcpy(t[k], to[i], sizeof t[k]);
        }
        if (fs_similarity_fit((const double(*)[3])f, (const double(*)[3])t, 3, &trial, NULL) < 0) continue;
        int count = count_inliers(&trial, from, to, n, tolerance, p, q);
        if (count <= best) continue;
        best = count;
        *s = trial;
    }
    if (best < 3) TRY(fs_error_input(err, "the two frames cannot be aligned: no three of %d common points agree", n));
    for (int round = 0; round < 5; round++) {
        *inliers = count_inliers(s, from, to, n, tolerance, p, q);
        TRY(fs_similarity_fit((const double(*)[3])p, (const double(*)[3])q, *inliers, s, err));
    }
fail:
    free(p);
    free(q);
    return rc;
}
