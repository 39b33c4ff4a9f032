// What training learned of the camera: how photos darken towards their corners, the tone curve, each photo's light.
#include <jansson.h>
#include <math.h>

#include "base/file.h"
#include "base/json_file.h"
#include "base/optics.h"
#include "model/scene.h"
#include "report/page.h"

#define MAX_BYTES (64 << 20)

static bool read_numbers(const json_t *list, double *x, int n)
{
    bool any = false;
    for (int i = 0; i < n; i++) {
        x[i] = json_number_value(json_array_get(list, (size_t)i));
        any |= x[i] != 0;
    }
    return any;
}

// Share of the light that arrives at a corner (kernels/calibration.h, u = 1).
static void write_vignetting(FILE *f, const json_t *model)
{
    double v[FS_OPTICS_VIGNETTING], sum = 1;
    if (!read_numbers(json_object_get(model, "vignetting"), v, FS_OPTICS_VIGNETTING)) return;
    for (int i = 0; i < FS_OPTICS_VIGNETTING; i++) sum += v[i];
    double corner = pow(fmax(sum, 0), 1 / (double)FS_OPTICS_GAMMA);
    fprintf(f, "<p>The corners of the photos get <b>%.0f %%</b> of the light of their middle.</p>\n", 100 * corner);
}

// The response, tone-mapped: light from left to right, what the photo shows upwards; the straight line is what the file
// says of itself.
static void write_response(FILE *f, const json_t *model)
{
    double r[FS_OPTICS_KNOTS];
    const int last = (int)(1 / FS_OPTICS_SPACING);     // white
    const double width = CHART_HEIGHT - 2 * CHART_PAD; // square
    if (!read_numbers(json_object_get(model, "response"), r, FS_OPTICS_KNOTS)) return;
    fprintf(f,
            "<figure><svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"the camera's response\">"
            "<path d=\"M%d %dL%d %d\" stroke=\"#2d3035\"/><polyline fill=\"none\" stroke=\"#6fb1e8\" "
            "stroke-width=\"2\" points=\"",
            CHART_WIDTH, CHART_HEIGHT, CHART_PAD, CHART_HEIGHT - CHART_PAD, CHART_PAD + (int)width, CHART_PAD);
    for (int i = 0; i <= last; i++) {
        double at = i * (double)FS_OPTICS_SPACING;
        fprintf(f, "%.1f,%.1f ", CHART_PAD + at * width, CHART_HEIGHT - CHART_PAD - (at + r[i]) * width);
    }
    fputs("\"/></svg><figcaption><b>The camera's tone curve</b> beyond sRGB: light<sup>0.22</sup> against what the "
          "photos "
          "show, undone before the layers are written</figcaption></figure>\n",
          f);
}

static const char *const lights[] = {"transmitted", "mirrored", "flash"};

static void write_photo(FILE *f, const json_t *photo, bool white)
{
    const json_t *balance = json_object_get(photo, "white_balance");
    const char *name = json_string_value(json_object_get(photo, "name"));
    fs_html_put(f, "<tr><td>@</td>", name ? name : "");
    for (int i = 0; i < 3; i++) fprintf(f, "<td>%.3f</td>", json_number_value(json_object_get(photo, lights[i])));
    for (size_t c = 0; c < 3 && white; c++) fprintf(f, "<td>%.3f</td>", json_number_value(json_array_get(balance, c)));
    fputs("</tr>\n", f);
}

static void write_photos(FILE *f, const json_t *photos)
{
    bool white = false, light = false;
    for (size_t i = 0; i < json_array_size(photos); i++) {
        const json_t *photo = json_array_get(photos, i), *balance = json_object_get(photo, "white_balance");
        for (size_t c = 0; c < 3; c++) white |= json_number_value(json_array_get(balance, c)) != 1;
        for (size_t k = 0; k < 3; k++) light |= json_number_value(json_object_get(photo, lights[k])) != 1;
    }
    if (!white && !light) return;
    fprintf(f,
            "<details><summary>The light of each photo against that of the others</summary><table><tr><th>Photo</th>"
            "<th>Behind the glass</th><th>Mirrored</th><th>Flash</th>%s</tr>\n",
            white ? "<th>Red</th><th>Green</th><th>Blue</th>" : "");
    for (size_t i = 0; i < json_array_size(photos); i++) write_photo(f, json_array_get(photos, i), white);
    fputs("</table></details>\n", f);
}

// Whom the photos show in the pane, and in how many.
static void write_photographer(FILE *f, const json_t *photos)
{
    size_t n = json_array_size(photos), shown = 0;
    double share = 0;
    for (size_t i = 0; i < n; i++) {
        double covered = json_number_value(json_object_get(json_array_get(photos, i), "photographer"));
        shown += covered > 0;
        share += covered / (double)n;
    }
    if (!shown) return;
    fprintf(
        f,
        "<p>In <b>%zu</b> photos the photographer is mirrored too, on <b>%.0f %%</b> of the picture. What is behind, "
        "where other photos see it, is in the mirrored scene; the figure is not. Where hardly any does, the mirrored "
        "scene "
        "is a guess: white in <code>renders/unseen</code>.</p>\n",
        shown, 100 * share * (double)n / (double)shown);
}

// What of the photos was left out, for the others do not show it.
static void write_passers_by(FILE *f, const json_t *photos)
{
    size_t n = 0;
    double most = 0;
    for (size_t i = 0; i < json_array_size(photos); i++) {
        double share = json_number_value(json_object_get(json_array_get(photos, i), "passers_by"));
        n += share > 0;
        most = fmax(most, share);
    }
    if (!n) return;
    fprintf(f,
            "<p><b>%zu</b> photos show something that the others do not, someone who walked by for instance: up to "
            "<b>%.0f %%</b> of a picture is left out of it.</p>\n",
            n, ceil(100 * most));
}

static void write_bars(FILE *f, const json_t *root)
{
    double share = json_number_value(json_object_get(root, "bars"));
    if (!(share > 0)) return;
    fprintf(
        f,
        "<p>Before the glass stand bars, or its frame: <b>%.0f %%</b> of the Gaussians of what is transmitted. Nothing "
        "is mirrored there, so R is black.</p>\n",
        100 * share);
}

static void write_veil(FILE *f, const json_t *model, const char *out)
{
    if (!(json_number_value(json_object_get(model, "veil_cell")) > 0)) return;
    fputs("<p>There is dirt on the glass that shines in the flash's light. Its light is in neither scene.</p>\n", f);
    if (!fs_file_exists(fs_file_at("%s/report/veil.jpg", out).text)) return;
    fputs("<figure><a href=\"report/veil.jpg\"><img src=\"report/veil.jpg\" alt=\"dirt on the glass\" "
          "loading=\"lazy\"></a>"
          "<figcaption><b>The dirt</b> on the glass, as the cameras see it, made brighter</figcaption></figure>\n",
          f);
}

float fs_learned_white(const char *out)
{
    json_t *model;
    double response[FS_OPTICS_KNOTS];
    fs_json_file_read(fs_file_at("%s/clouds/model.json", out).text, MAX_BYTES, &model, NULL);
    read_numbers(json_object_get(model, "response"), response, FS_OPTICS_KNOTS);
    json_decref(model);
    return fs_scene_white(response);
}

void fs_learned_write(FILE *f, const char *out)
{
    json_t *model, *root;
    fs_scene_photos(out, &root, NULL);
    fs_json_file_read(fs_file_at("%s/clouds/model.json", out).text, MAX_BYTES, &model, NULL);
    write_vignetting(f, model);
    write_response(f, model);
    write_bars(f, root);
    write_veil(f, model, out);
    write_photographer(f, json_object_get(root, "photos"));
    write_passers_by(f, json_object_get(root, "photos"));
    write_photos(f, json_object_get(root, "photos"));
    json_decref(model);
    json_decref(root);
}
