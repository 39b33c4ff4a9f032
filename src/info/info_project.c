// Describes a project folder: which stages are done, what they left and how much room it takes; and names what a
// person would open first.
#include "info/info.h"

#include <string.h>
#include <sys/stat.h>

#include "base/file.h"
#include "base/json_file.h"
#include "model/layers.h"
#include "model/project.h"
#include "model/scene.h"

#define MAX_DEPTH 8

typedef struct Usage {
    double bytes;
    int files;
} Usage;

static void measure(const char *dir, int depth, Usage *usage)
{
    FileList list;
    if (depth == 0 || fs_file_list(dir, &list, NULL) < 0) return;
    for (int i = 0; i < list.n; i++) {
        struct stat st;
        FilePath path = fs_file_at("%s/%s", dir, list.name[i]);
        if (lstat(path.text, &st) != 0) continue;
        if (S_ISDIR(st.st_mode)) measure(path.text, depth - 1, usage);
        if (S_ISREG(st.st_mode)) usage->bytes += (double)st.st_size, usage->files++;
    }
    fs_file_list_free(&list);
}

static void describe_stage(const char *out, const ProjectStage *stage, const Log *log)
{
    Usage usage = {0};
    char size[32];
    const char *before = "";
    json_t *mark = fs_project_mark(out, stage->name);
    json_t *settings = json_object_get(mark, "settings");
    bool done = mark && (!settings || json_object_size(settings) > 0); // none: it was not finished
    json_decref(mark);
    for (int i = 0; i < PROJECT_OUTPUTS && stage->output[i]; i++) {
        const char *path = stage->output[i] + (*stage->output[i] == '=');
        size_t n = strcspn(path, "/");
        if (!path[n] || strncmp(path, before, n + 1) == 0) continue; // a file alone, or more of the folder before
        before = path;
        measure(fs_file_at("%s/%.*s", out, (int)n, path).text, MAX_DEPTH, &usage);
    }
    fs_info_size(usage.bytes, size, sizeof size);
    const char *state = done ? "done" : usage.files ? "begun" : "not done";
    if (usage.files)
        fs_log_info(log, "  %-10s  %-8s  %d files, %s", stage->name, state, usage.files, size);
    else
        fs_log_info(log, "  %-10s  %s", stage->name, state);
}

static void describe_clouds(const char *out, const char *folder, const Log *log)
{
    char text[200] = "";
    size_t used = 0;
    for (int l = 0; l < LAYERS; l++) {
        int n = fs_info_ply_count(fs_file_at("%s/%s/%s.ply", out, folder, fs_layers[l].name).text);
        if (n >= 0 && used < sizeof text)
            used +=
                (size_t)snprintf(text + used, sizeof text - used, "%s%s %d", used ? ", " : "", fs_layers[l].name, n);
    }
    if (used) fs_log_info(log, "  Gaussians in %s/: %s", folder, text);
}

static bool is_trained(const char *out)
{
    return fs_file_exists(fs_file_at("%s/done/train.json", out).text);
}

// Of a training that was interrupted.
static void describe_checkpoint(const char *out, const Log *log)
{
    if (fs_project_has_checkpoint(out) && !is_trained(out))
        fs_log_info(log, "  training was interrupted: the same command with --resume goes on from the checkpoint");
}

int fs_info_project(const char *out, const Log *log, FsError *err)
{
    fs_log_info(log, "%s: project folder", out);
    for (int i = 0; i < PROJECT_STAGES; i++) describe_stage(out, &fs_project_stages[i], log);
    describe_checkpoint(out, log);
    FilePath views = fs_file_at("%s/views.json", out);
    int rc = fs_file_exists(views.text) ? fs_info_cameras(views.text, log, err) : 0;
    describe_clouds(out, "start", log);
    describe_clouds(out, "clouds", log);
    if (rc == 0) fs_info_results(out, log);
    return rc;
}

// Of the trained scenes; full where nothing says so.
static Separation separation_of(const char *out)
{
    json_t *root = NULL;
    Separation separation = SEPARATIONS;
    if (fs_json_file_read(fs_file_at("%s/clouds/model.json", out).text, 1 << 20, &root, NULL) == 0) {
        const char *name = json_string_value(json_object_get(root, "separation"));
        separation = name ? fs_scene_separation(name) : SEPARATIONS;
    }
    json_decref(root);
    return separation == SEPARATIONS ? SEPARATION_FULL : separation;
}

void fs_info_results(const char *out, const Log *log)
{
    enum { FULL = 1u << SEPARATION_FULL, FLASHLESS = 1u << SEPARATION_FLASHLESS, LINEAR = 1u << SEPARATION_LINEAR };
    const char *progress = is_trained(out) ? "photo, composite and layers at the end of training"
                                           : "photo, composite and layers in the course of training";
    const struct {
        const char *folder, *ext, *what;
        bool whole;    // name the folder, not one file in it
        unsigned only; // of these separations; 0: of all
    } results[] = {
        {"", "html", "everything on one page", false, 0},
        {"", "png", "photos and layers side by side", false, 0},
        {"progress", "png", progress, false, 0},
        {"renders/T_N", "png", "what is behind the glass", true, 0},
        {"renders/T_F", "png", "the same lit by the flash", true, FULL | LINEAR},
        {"renders/R", "png", "what is mirrored in the glass", true, FULL | FLASHLESS | LINEAR},
        {"renders/unseen", "png", "where that is a guess, behind the photographer", true, 0},
        {"video", "mp4", "the camera path", false, 0},
        {"export", "ply", "the clouds, for viewers of Gaussian splats", true, 0},
    };
    const unsigned separation = 1u << separation_of(out);
    bool any = false;
    for (size_t i = 0; i < sizeof results / sizeof *results; i++) {
        const char *folder = results[i].folder;
        FilePath dir = fs_file_at("%s%s%s", out, *folder ? "/" : "", folder), file;
        if (results[i].only && !(results[i].only & separation)) continue;
        if (!fs_file_last(dir.text, results[i].ext, &file)) continue;
        if (!any) fs_log_info(log, "Open these:");
        fs_log_info(log, results[i].whole ? "  %s/  %s" : "  %s  %s", results[i].whole ? dir.text : file.text,
                    results[i].what);
        any = true;
    }
}
