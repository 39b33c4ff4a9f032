#include "report/page.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/json_file.h"

#define MAX_FIGURES (64 << 20) // bytes
#define MAX_MODEL (1 << 20)

// ---- head ----

char *fs_page_name(const char *out)
{
    char *whole = realpath(out, NULL);
    if (!whole && errno == ENOMEM) fs_error_memory(NULL);
    char *name = strdup(fs_file_name(whole ? whole : out));
    if (!name) fs_error_memory(NULL);
    free(whole);
    return name;
}

void fs_page_write_head(FILE *f, const char *name, int reload)
{
    fputs("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
          "content=\"width=device-width\">\n",
          f);
    if (reload) fprintf(f, "<meta http-equiv=\"refresh\" content=\"%d\">\n", reload);
    fs_html_put(f, "<title>@ - flashsplat</title>\n<style>\n", name);
    fputs(fs_html_style, f);
    fs_html_put(f, "</style></head>\n<body><main>\n<h1>@</h1>\n", name);
}

static void write_head(FILE *f, const Page *page)
{
    char *name = fs_page_name(page->project->out);
    fs_page_write_head(f, name ? name : "", 0);
    fputs("<p>What is behind the glass, apart from what is mirrored in it.</p>\n", f);
    free(name);
}

static int count_splats(const Page *page)
{
    json_t *root, *value;
    const char *key;
    json_int_t n = 0;
    fs_json_file_read(fs_file_at("%s/clouds/model.json", page->project->out).text, MAX_MODEL, &root, NULL);
    json_object_foreach(json_object_get(root, "clouds"), key, value) n += json_integer_value(value);
    json_decref(root);
    return (int)n;
}

static void write_chips(FILE *f, const Page *page)
{
    const Dataset *data = page->dataset;
    int flash = 0, held_out = 0, splats = count_splats(page);
    for (int i = 0; i < data->n; i++) {
        flash += data->view[i].flash;
        held_out += data->view[i].held_out;
    }
    fprintf(f, "<ul class=\"chips\"><li><b>%d</b> photos posed</li><li><b>%d</b> with flash, <b>%d</b> without</li>",
            data->n, flash, data->n - flash);
    if (held_out) fprintf(f, "<li><b>%d</b> held out</li>", held_out);
    fprintf(f, "<li><b>%d &#215; %d</b> pixels</li>", data->view[0].camera.width, data->view[0].camera.height);
    if (splats) fprintf(f, "<li><b>%d</b> Gaussians</li>", splats);
    if (page->curve.n) {
        double s = page->curve.seconds;
        fprintf(f, "<li><b>%.0f</b> training steps in <b>%.0f</b> %s</li>", page->curve.point[page->curve.n - 1][0],
                s < 120 ? s : s / 60, s < 120 ? "seconds" : "minutes");
    }
    fputs("</ul>\n", f);
}

void fs_page_write_warnings(FILE *f, const char *out)
{
    char *text = fs_warnings_read(out);
    if (!text) return;
    fputs("<section class=\"warn\"><h2>Worth knowing</h2><ul>", f);
    for (char *line = text, *next; line && *line; line = next) {
        next = strchr(line, '\n');
        if (next) *next++ = 0;
        fs_html_put(f, "<li>@</li>", line);
    }
    fputs("</ul></section>\n", f);
    free(text);
}

// ---- pictures ----

static bool any(const PreviewSet *set, Preview preview)
{
    for (int i = 0; i < set->n; i++)
        if (set->has[i][preview]) return true;
    return false;
}

static void write_layer_button(FILE *f, const char *layer, const char *title)
{
    fprintf(f, "<button class=\"layer\" data-layer=\"%s\">%s</button>", layer, title);
}

static void write_view_buttons(FILE *f, const Page *page)
{
    fputs("<div class=\"buttons\">", f);
    for (int i = 0; i < page->previews.n; i++) {
        const View *view = &page->dataset->view[page->previews.view[i]];
        if (!page->previews.has[i][PREVIEW_PHOTO]) continue;
        fprintf(f, "<button class=\"view\" data-flash=\"%d\" data-base=\"report/%d_\" data-has=\"", view->flash, i + 1);
        for (int p = 0; p < PREVIEWS; p++)
            if (page->previews.has[i][p]) fprintf(f, "%s ", fs_previews[p].key);
        fprintf(f, "\"><img src=\"report/%d_photo.jpg\" alt=\"\"><span>", i + 1);
        fs_html_put(f, view->flash ? "@ &#9889;</span></button>" : "@</span></button>", view->name);
    }
    fputs("</div>\n", f);
}

static void write_comparison(FILE *f, const Page *page)
{
    const PreviewSet *set = &page->previews;
    if (!any(set, PREVIEW_PHOTO) || !any(set, PREVIEW_T_N)) return;
    fprintf(
        f,
        "<div class=\"compare\"><img class=\"under\" alt=\"separated layer\" width=\"%d\" height=\"%d\"><img "
        "class=\"over\" alt=\"photo\"><div class=\"bar\"></div><span class=\"l\">Photo</span><span class=\"r\"></span>"
        "<input type=\"range\" min=\"0\" max=\"100\" step=\"0.1\" value=\"50\" aria-label=\"photo or layer\"></div>\n",
        set->width, set->height);
    fputs("<div class=\"buttons\">", f);
    write_layer_button(f, "T", "Behind the glass");
    if (any(set, PREVIEW_R)) write_layer_button(f, "R", "Mirrored");
    if (any(set, PREVIEW_COMPOSITE)) write_layer_button(f, "I", "Both, as modelled");
    if (any(set, PREVIEW_DEPTH)) write_layer_button(f, "depth", "Depth");
    fputs("</div>\n", f);
    write_view_buttons(f, page);
}

static void write_layers(FILE *f, const Page *page)
{
    const PreviewSet *set = &page->previews;
    fputs("<h2>The layers</h2>\n<p>All pictures here share one exposure and one pleasant tone curve, and the camera's "
          "colour matrix where the photos are RAW. The files in "
          "<code>renders</code> hold the figures: linear<sup>0.22</sup> &#215; 255; in linear light "
          "<code>I_N = T_N + R</code>, <code>R = beta R_scene</code>.</p>\n",
          f);
    for (int i = 0; i < set->n; i++) {
        fprintf(f, "<div class=\"grid of-view\" data-base=\"report/%d_\">\n", i + 1);
        for (int p = 0; p < PREVIEWS; p++) {
            if (!set->has[i][p]) continue;
            fprintf(
                f,
                "<figure><a href=\"report/%d_%s.jpg\"><img src=\"report/%d_%s.jpg\" alt=\"%s\" loading=\"lazy\"></a>"
                "<figcaption><b>%s</b><br>%s</figcaption></figure>\n",
                i + 1, fs_previews[p].key, i + 1, fs_previews[p].key, fs_previews[p].title, fs_previews[p].title,
                fs_previews[p].help);
        }
        fputs("</div>\n", f);
    }
}

static bool is_there(const Page *page, const char *name)
{
    return fs_file_exists(fs_file_at("%s/%s", page->project->out, name).text);
}

static void write_films(FILE *f, const Page *page)
{
    static const struct {
        const char *file, *title;
    } films[] = {{"video/side_by_side.mp4", "As photographed, transmitted, mirrored"},
                 {"video/composite.mp4", "As photographed, without flash"},
                 {"video/T.mp4", "Behind the glass"},
                 {"video/R.mp4", "Mirrored in the glass"}};
    bool started = false;
    for (size_t i = 0; i < sizeof films / sizeof *films; i++) {
        if (!is_there(page, films[i].file)) continue;
        if (!started) fputs("<h2>Films</h2>\n<div class=\"grid wide\">\n", f);
        started = true;
        fprintf(f,
                "<figure%s><video src=\"%s\" controls loop muted playsinline preload=\"metadata\"></video><figcaption>"
                "<b>%s</b></figcaption></figure>\n",
                i == 0 ? " class=\"span\"" : "", films[i].file, films[i].title);
    }
    if (started) fputs("</div>\n", f);
}

// Of OUT/export/photos: each photo once, with the formats that are there.
static void write_clean(FILE *f, const Page *page)
{
    FileList list;
    const char *folder = "export/photos";
    int n = 0;
    if (fs_file_list(fs_file_at("%s/%s", page->project->out, folder).text, &list, NULL) < 0) return;
    for (int i = 0; i < list.n; i++) {
        if (!fs_file_has_ext(list.name[i], "jpg tif dng")) continue;
        if (!n++) fputs("<h2>Your photos without the reflection</h2>\n<p>At their full size: ", f);
        fputs(n > 1 ? ", <a href=\"" : "<a href=\"", f);
        fs_html_url(f, fs_file_at("%s/%s", folder, list.name[i]).text);
        fs_html_put(f, "\">@</a>", list.name[i]);
    }
    if (n) fputs(".</p>\n", f);
    fs_file_list_free(&list);
}

// ---- numbers ----

static void write_figure_cells(FILE *f, const json_t *layer)
{
    static const char *const columns[] = {"psnr_gain", "ssim_gain", "psnr", "ssim"};
    for (size_t i = 0; i < sizeof columns / sizeof *columns; i++) {
        const json_t *v = json_object_get(layer, columns[i]);
        if (json_is_number(v))
            fprintf(f, "<td>%.*f</td>", columns[i][0] == 'p' ? 2 : 4, json_number_value(v));
        else
            fputs("<td>-</td>", f);
    }
}

// OUT/evaluate.json where a truth was measured against since the renders were made.
static void write_figures(FILE *f, const Page *page)
{
    json_t *root = NULL;
    const char *out = page->project->out;
    if (is_there(page, "done/evaluate.json")) // else they are of other renders
        fs_json_file_read(fs_file_at("%s/evaluate.json", out).text, MAX_FIGURES, &root, NULL);
    json_t *methods = json_object_get(root, "methods"), *method, *layer;
    const char *name, *key;
    if (json_object_size(methods)) {
        fputs("<h2>Against the truth</h2>\n<table><tr><th></th><th>Layer</th><th>PSNR, gain-fitted</th><th>SSIM, "
              "gain-fitted</th><th>PSNR</th><th>SSIM</th></tr>\n",
              f);
        json_object_foreach(methods, name, method) json_object_foreach(json_object_get(method, "layers"), key, layer)
        {
            fs_html_put(f, "<tr><td>@</td><td>@</td>", name, key);
            write_figure_cells(f, layer);
            fputs("</tr>\n", f);
        }
        fputs("</table>\n", f);
    }
    json_decref(root);
}

static void write_capture(FILE *f, const Page *page)
{
    fputs("<h2>Capture and training</h2>\n<div class=\"grid wide\"><figure>", f);
    fs_charts_cameras(f, page->dataset);
    fputs("<figcaption><b>Where the photos were taken</b>, from above. Flash and no-flash photos should "
          "mingle.</figcaption>"
          "</figure>\n",
          f);
    if (page->curve.n > 1) {
        fputs("<figure>", f);
        fs_charts_curve(f, &page->curve);
        fputs("<figcaption><b>Difference to the photos</b> (L1, tone-mapped) over the training</figcaption></figure>\n",
              f);
    }
    fputs("</div>\n", f);
    fs_learned_write(f, page->project->out);
}

// ---- files and settings ----

static void write_link(FILE *f, const char *path, const char *what)
{
    fputs("<tr><td><a href=\"", f);
    fs_html_url(f, path);
    fs_html_put(f, "\"><code>@</code></a></td><td>@</td></tr>\n", path, what);
}

static void write_folder_links(FILE *f, const Page *page, const char *folder, const char *ext, const char *what)
{
    FileList list;
    if (fs_file_list(fs_file_at("%s/%s", page->project->out, folder).text, &list, NULL) < 0) return;
    for (int i = 0; i < list.n; i++)
        if (fs_file_has_ext(list.name[i], ext)) write_link(f, fs_file_at("%s/%s", folder, list.name[i]).text, what);
    fs_file_list_free(&list);
}

static void write_files(FILE *f, const Page *page)
{
    static const char *const names[][2] = {{"sheet.png", "photos and layers side by side"},
                                           {"views.json", "the posed photos"},
                                           {"evaluate.json", "figures of every view"},
                                           {"log.jsonl", "the training, step by step"}};
    fputs("<h2>Files</h2>\n<table>\n", f);
    write_folder_links(f, page, "export", "ply", "Gaussians, points and meshes for other programs");
    write_folder_links(f, page, "export", "spz sog splat glb", "the same for viewers in a browser");
    write_folder_links(f, page, "video", "mp4", "film");
    write_folder_links(f, page, "clouds", "ply", "Gaussians as trained");
    write_folder_links(f, page, "start", "ply", "where the training began");
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (is_there(page, names[i][0])) write_link(f, names[i][0], names[i][1]);
    fputs("</table>\n", f);
}

static bool is_default(const FsOption *option, const char *value)
{
    if (option->type == FS_OPTION_INT || option->type == FS_OPTION_FLOAT)
        return strtod(value, NULL) == strtod(option->initial, NULL);
    return strcmp(value, option->initial) == 0;
}

// The value an option had when the stages ran, by their done marks; else what it is now.
static void option_text(const Page *page, const json_t *ran_with, const FsOption *option, char *buf, size_t n)
{
    const json_t *value = json_object_get(ran_with, option->name);
    if (json_is_string(value))
        snprintf(buf, n, "%s", json_string_value(value));
    else if (json_is_boolean(value))
        snprintf(buf, n, "%s", json_is_true(value) ? "true" : "false");
    else if (json_is_number(value)) // as %g, but a whole number whole
        snprintf(buf, n, json_is_integer(value) ? "%.0f" : "%g", json_number_value(value));
    else if (fs_settings_get(&page->project->set, option->name, buf, n) < 0)
        *buf = 0;
}

static json_t *read_marks(const Page *page)
{
    json_t *all = json_object();
    for (int i = PROJECT_STAGES - 1; i >= 0; i--) { // what an early stage ran with counts
        json_t *mark = fs_project_mark(page->project->out, fs_project_stages[i].name);
        json_object_update(all, json_object_get(mark, "settings"));
        json_decref(mark);
    }
    return all;
}

static void write_settings(FILE *f, const Page *page)
{
    size_t n;
    const FsOption *options = fs_settings_options(&n);
    json_t *ran_with = read_marks(page);
    fputs("<h2>Settings</h2>\n<details><summary>All settings of these stages; those other than the default stand out"
          "</summary><table>\n",
          f);
    for (size_t i = 0; i < n; i++) {
        char value[400];
        if (!(options[i].stages & FS_STAGE_ALL)) continue;
        option_text(page, ran_with, &options[i], value, sizeof value);
        fputs(is_default(&options[i], value) ? "<tr>" : "<tr class=\"set\">", f);
        fs_html_put(f, "<td><code>--@</code></td><td>@</td><td>@</td></tr>\n", options[i].name, *value ? value : "-",
                    options[i].help);
    }
    fputs("</table></details>\n", f);
    json_decref(ran_with);
}

void fs_page_write(FILE *f, const Page *page)
{
    write_head(f, page);
    write_chips(f, page);
    fs_page_write_warnings(f, page->project->out);
    if (page->viewer.there) fputs(fs_html_viewer, f);
    write_comparison(f, page);
    if (page->previews.n) write_layers(f, page);
    write_films(f, page);
    write_clean(f, page);
    write_figures(f, page);
    write_capture(f, page);
    write_files(f, page);
    write_settings(f, page);
    fprintf(f, "<footer>flashsplat %s</footer>\n</main>\n<script>\n%s</script>\n", fs_version(), fs_html_script);
    if (page->viewer.there)
        fprintf(f, "<script>\n(() => {\n'use strict';\n%s})();\n</script>\n", fs_html_viewer_script);
    fputs("</body></html>\n", f);
}
