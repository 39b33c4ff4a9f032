#include "report/page.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/linalg.h"
#include "base/memory.h"

// ---- cameras ----

// Axes of the drawing in the world: right = the mean camera's right, ahead = its forward.
static void drawing_axes(const Dataset *dataset, double right[3], double ahead[3])
{
    for (int k = 0; k < 3; k++) right[k] = ahead[k] = 0;
    for (int i = 0; i < dataset->n; i++)
        for (int k = 0; k < 3; k++) {
            right[k] += dataset->view[i].camera.w2c[k] / dataset->n;
            ahead[k] += dataset->view[i].camera.w2c[8 + k] / dataset->n;
        }
}

static void grow(double range[2], double v)
{
    if (v < range[0]) range[0] = v;
    if (v > range[1]) range[1] = v;
}

void fs_charts_cameras(FILE *f, const Dataset *dataset)
{
    double right[3], ahead[3], c[3], x[2] = {INFINITY, -INFINITY}, y[2] = {INFINITY, -INFINITY};
    drawing_axes(dataset, right, ahead);
    for (int i = 0; i < dataset->n; i++) {
        fs_camera_centre(&dataset->view[i].camera, c);
        grow(x, v3_dot(c, right));
        grow(y, v3_dot(c, ahead));
    }
    double scale = fmin((CHART_WIDTH - 4 * CHART_PAD) / fmax(x[1] - x[0], 1e-12),
                        (CHART_HEIGHT - 4 * CHART_PAD) / fmax(y[1] - y[0], 1e-12));
    fprintf(f, "<svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"camera positions from above\">\n", CHART_WIDTH,
            CHART_HEIGHT);
    for (int i = 0; i < dataset->n; i++) {
        const View *view = &dataset->view[i];
        fs_camera_centre(&view->camera, c);
        double px = CHART_WIDTH / 2.0 + (v3_dot(c, right) - (x[0] + x[1]) / 2) * scale;
        double py = CHART_HEIGHT / 2.0 + CHART_PAD / 2.0 - (v3_dot(c, ahead) - (y[0] + y[1]) / 2) * scale;
        double dx = v3_dot(view->camera.w2c + 8, right), dy = -v3_dot(view->camera.w2c + 8, ahead);
        double length = fmax(hypot(dx, dy), 1e-12);
        const char *color = view->flash ? "#f2b44b" : "#6fb1e8";
        fprintf(f, "<path d=\"M%.1f %.1fl%.1f %.1f\" stroke=\"%s\" stroke-width=\"1.5\" opacity=\".6\"/>", px, py,
                22 * dx / length, 22 * dy / length, color);
        fprintf(f, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4.5\" fill=\"%s\"/>\n", px, py, color);
    }
    fprintf(f, "<text x=\"12\" y=\"20\">towards the glass</text><text x=\"12\" y=\"%d\">", CHART_HEIGHT - 12);
    fputs("<tspan fill=\"#f2b44b\">&#9679; with flash</tspan> &#160; <tspan fill=\"#6fb1e8\">&#9679; without</tspan>"
          "</text></svg>\n",
          f);
}

// ---- the training log ----

#define MAX_LOG (64 << 20)

static int add_point(Curve *curve, const json_t *line, FsError *err)
{
    const json_t *step = json_object_get(line, "step"), *value = json_object_get(line, "l1");
    const json_t *seconds = json_object_get(line, "seconds");
    double v = json_number_value(value);
    if (!json_is_integer(step) || !json_is_number(value) || !(v > 0)) return 0;
    if (fs_memory_grow(&curve->point, curve->n, sizeof *curve->point, err) < 0) return FS_ERR_MEMORY;
    curve->point[curve->n][0] = (double)json_integer_value(step);
    curve->point[curve->n++][1] = v;
    if (json_is_number(seconds)) curve->seconds = json_number_value(seconds);
    return 0;
}

int fs_charts_read_log(const char *path, Curve *curve, FsError *err)
{
    *curve = (Curve){0};
    char *text;
    size_t size;
    if (!fs_file_exists(path)) return 0;
    MUST(fs_file_read(path, MAX_LOG, &text, &size, err));
    int rc = 0;
    for (char *p = text; *p && rc == 0;) {
        size_t n = strcspn(p, "\n");
        json_t *line = json_loadb(p, n, 0, NULL);
        rc = add_point(curve, line, err);
        json_decref(line);
        p += n + (p[n] == '\n');
    }
    free(text);
    if (rc < 0) fs_charts_free_curve(curve);
    return rc;
}

void fs_charts_free_curve(Curve *curve)
{
    free(curve->point);
    *curve = (Curve){0};
}

void fs_charts_curve(FILE *f, const Curve *curve)
{
    double x[2] = {0, 1}, y[2] = {INFINITY, -INFINITY};
    for (int i = 0; i < curve->n; i++) {
        grow(x, curve->point[i][0]);
        grow(y, log10(curve->point[i][1]));
    }
    double low = floor(y[0] * 5) / 5, high = fmax(ceil(y[1] * 5) / 5, low + 0.2);
    double left = 2.0 * CHART_PAD, bottom = CHART_HEIGHT - 1.3 * CHART_PAD, top = CHART_PAD,
           right = CHART_WIDTH - 0.7 * CHART_PAD;
    fprintf(f, "<svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"training loss\">\n", CHART_WIDTH, CHART_HEIGHT);
    for (int i = 0; i <= 4; i++) {
        double at = low + (high - low) * i / 4, py = bottom - (bottom - top) * i / 4;
        fprintf(f, "<path d=\"M%.1f %.1fH%.1f\" stroke=\"#2d3035\"/><text x=\"8\" y=\"%.1f\">%.3g</text>\n", left, py,
                right, py + 4, pow(10, at));
    }
    fputs("<polyline fill=\"none\" stroke=\"#6fb1e8\" stroke-width=\"2\" points=\"", f);
    int every = curve->n > 1000 ? curve->n / 1000 : 1;
    for (int i = 0; i < curve->n; i += every)
        fprintf(f, "%.1f,%.1f ", left + (right - left) * curve->point[i][0] / x[1],
                bottom - (bottom - top) * (log10(curve->point[i][1]) - low) / (high - low));
    fprintf(
        f,
        "\"/><text x=\"%.1f\" y=\"%d\">0</text><text x=\"%.1f\" y=\"%d\" text-anchor=\"end\">step %.0f</text></svg>\n",
        left, CHART_HEIGHT - 10, right, CHART_HEIGHT - 10, x[1]);
}
