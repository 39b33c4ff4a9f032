#include "model/fingerprint.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "base/file.h"
#include "base/hash.h"
#include "model/colmap_model.h"

#define MAX_DEPTH 4

// Settings that say how a stage works, not what it computes; and the preset, which counts through the values it sets.
// Who is held out stands in views.json, which poses brings up to date.
static bool changes_result(const char *name, unsigned stage)
{
    static const char *const ignored[] = {"threads",          "force",          "resume",
                                          "checkpoint-every", "progress-every", "json",
                                          "test-every",       "originals",      "preset"};
    for (size_t i = 0; i < sizeof ignored / sizeof *ignored; i++)
        if (strcmp(name, ignored[i]) == 0) return false;
    if (strcmp(name, "lighting") == 0 && stage != FS_STAGE_TRAIN) return false; // before it they say which photos there
    if (strcmp(name, "separation") == 0 && (stage & (FS_STAGE_INGEST | FS_STAGE_POSES))) return false; // must be
    return true;
}

static json_t *settings_of(const FsProject *project, unsigned stage)
{
    char *text = fs_settings_json(&project->set, stage);
    json_t *all = text ? json_loads(text, 0, NULL) : NULL, *kept = all ? json_object() : NULL, *value;
    const char *name;
    CpuLevel level;
    free(text);
    if (kept) json_object_foreach(all, name, value)
        {
            if (changes_result(name, stage)) json_object_set(kept, name, value);
        }
    if (json_object_get(kept, "cpu")) { // the instructions that are used: others round otherwise
        fs_cpu_choose(project->set.cpu, &level, NULL);
        json_object_set_new(kept, "cpu", json_string(fs_cpu_name(level)));
    }
    // What "auto" opens here; with a second device it is the one that was opened (engine.h) that counts.
    if (json_object_get(kept, "device") && strcmp(project->set.device, "auto") == 0)
        json_object_set_new(kept, "device", json_string("cpu"));
    json_decref(all);
    return kept;
}

// ---- inputs ----

#define READ "tif png json ply txt bin npy" // by the stages: not what a file manager leaves about
// Of a folder for --poses.
static const char model_files[] = "cameras.bin,cameras.txt,images.bin,images.txt,points3D.bin,points3D.txt,"
                                  "transforms.json,cameras.json,poses_bounds.npy";

// Names and contents, in the order of the names; only: of these alone. False where there is nothing.
static bool hash_path(const char *path, int depth, const char *only, uint64_t *hash)
{
    uint64_t size;
    FileList list;
    if (!fs_file_exists(path)) return false;
    if (!fs_file_is_dir(path)) {
        if (fs_hash_file(path, true, hash, &size) < 0) *hash = fs_hash_text(*hash, "unreadable");
        return true;
    }
    if (depth == 0 || fs_file_list(path, &list, NULL) < 0) return true;
    for (int i = 0; i < list.n; i++) {
        FilePath inside = fs_file_at("%s/%s", path, list.name[i]);
        if (only && !fs_settings_has_word(only, list.name[i])) continue;
        if (fs_file_is_dir(inside.text) ? depth > 1 : fs_file_has_ext(inside.text, READ)) {
            *hash = fs_hash_text(*hash, list.name[i]);
            hash_path(inside.text, depth - 1, only, hash);
        }
    }
    fs_file_list_free(&list);
    return true;
}

static bool hash_text(const char *path, int depth, const char *only, char text[17])
{
    uint64_t hash = FS_HASH_EMPTY;
    bool there = hash_path(path, depth, only, &hash);
    snprintf(text, 17, "%016llx", (unsigned long long)hash);
    return there;
}

bool fs_fingerprint_hash(const char *path, int depth, char text[17])
{
    return hash_text(path, depth, NULL, text);
}

static void put_hash(json_t *inputs, const char *name, const char *path, int depth, const char *only)
{
    char text[17];
    bool there = hash_text(path, depth, only, text);
    json_object_set_new(inputs, name, there ? json_string(text) : json_null());
}

static json_t *inputs_of(const FsProject *project, const ProjectStage *stage)
{
    json_t *inputs = json_object();
    const char *model = project->set.poses;
    if (stage->stage == FS_STAGE_INGEST) // which files are photos, ingest knows
        json_object_set_new(inputs, "the photos", *project->photos ? json_string(project->photos) : json_null());
    if (stage->stage == FS_STAGE_POSES && *model) {
        char *place = fs_colmap_model_find(model);
        put_hash(inputs, "the model of --poses", place ? place : model, 1, model_files);
        free(place);
    }
    const char *const clouds[][2] = {{"the cloud of --points", project->set.points},
                                     {"the cloud of --flash-points", project->set.flash_points},
                                     {"the cloud of --noflash-points", project->set.noflash_points}};
    for (size_t i = 0; i < sizeof clouds / sizeof *clouds; i++)
        if (stage->stage == FS_STAGE_INITIALISE && *clouds[i][1]) put_hash(inputs, clouds[i][0], clouds[i][1], 1, NULL);
    for (int i = 0; i < PROJECT_INPUTS && stage->input[i]; i++)
        put_hash(inputs, stage->input[i], fs_file_at("%s/%s", project->out, stage->input[i]).text, MAX_DEPTH, NULL);
    return inputs;
}

char *fs_fingerprint_make(const FsProject *project, const ProjectStage *stage)
{
    json_t *settings = settings_of(project, stage->stage), *inputs = settings ? inputs_of(project, stage) : NULL;
    json_t *root = inputs ? json_pack("{s:o, s:o}", "settings", settings, "inputs", inputs) : NULL;
    char *text = root ? json_dumps(root, JSON_COMPACT) : NULL;
    if (!inputs) json_decref(settings); // json_pack takes both, even where it fails
    json_decref(root);
    return text;
}

// ---- comparing ----

static void say_value(char text[100], const json_t *value)
{
    if (!value)
        snprintf(text, 100, "unknown"); // to an earlier version
    else if (json_is_boolean(value))
        snprintf(text, 100, "%s", json_is_true(value) ? "on" : "off");
    else if (json_is_string(value))
        snprintf(text, 100, "%s", *json_string_value(value) ? json_string_value(value) : "none");
    else
        snprintf(text, 100, "%.9g", json_number_value(value));
}

// As a setting, not as an option: it may follow from a preset or be the default.
static void say_setting(char *text, size_t size, const char *name, const json_t *was, const json_t *now)
{
    char was_text[100], now_text[100];
    say_value(was_text, was);
    say_value(now_text, now);
    snprintf(text, size, "the setting %s was %s and is %s now", name, was_text, now_text);
}

// Where a file lies does not matter, its content is among the inputs, where it is there: what is not must have had that
// name. Nor does it matter what the steps were chosen by.
static bool is_same_setting(const char *name, const json_t *was, const json_t *now)
{
    bool file = strcmp(name, "poses") == 0 || strcmp(name, "flash-list") == 0 || strcmp(name, "masks") == 0 ||
                strcmp(name, "points") == 0 || strcmp(name, "flash-points") == 0 || strcmp(name, "noflash-points") == 0;
    return json_equal(was, now) || strcmp(name, "minutes") == 0 ||
           (file && json_string_length(was) && json_string_length(now) && fs_file_exists(json_string_value(now)));
}

// What explains most comes first: with --minutes the steps follow from the others.
static int rank_of(const char *name)
{
    return strcmp(name, "steps") == 0;
}

static bool settings_differ(const json_t *was, const json_t *now, char *text, size_t size)
{
    const char *name;
    json_t *value;
    if (json_object_size(was) == 0 && json_object_size(now) > 0) { // of what is there no more is told (project.c)
        snprintf(text, size, "it was not finished the last time");
        return true;
    }
    for (int rank = 0; rank < 2; rank++) json_object_foreach((json_t *)now, name, value)
        {
            const json_t *then = json_object_get(was, name);
            if (rank_of(name) != rank || is_same_setting(name, then, value)) continue;
            say_setting(text, size, name, then, value);
            return true;
        }
    return false;
}

// The photos' hash is of their masks and of the list of flash photos too.
static const char *with_lists(const json_t *settings)
{
    bool list = json_string_length(json_object_get(settings, "flash-list"));
    bool masks = json_string_length(json_object_get(settings, "masks"));
    return list && masks ? ", their masks or the flash list"
           : masks       ? " or their masks"
           : list        ? " or the flash list"
                         : "";
}

static bool inputs_differ(const json_t *was, const json_t *now, const json_t *settings, char *text, size_t size)
{
    const char *name;
    json_t *value;
    json_object_foreach((json_t *)now, name, value)
    {
        if (json_is_null(value) || json_equal(value, json_object_get(was, name))) continue;
        snprintf(text, size, "%s%s changed", name, strcmp(name, "the photos") == 0 ? with_lists(settings) : "");
        return true;
    }
    return false;
}

unsigned fs_fingerprint_differs(const char *was_text, const char *now_text, char *text, size_t size)
{
    json_t *was = was_text ? json_loads(was_text, 0, NULL) : NULL,
           *now = now_text ? json_loads(now_text, 0, NULL) : NULL;
    const json_t *settings = json_object_get(was, "settings"), *inputs = json_object_get(was, "inputs");
    unsigned differs = 0;
    if (!now || !json_is_object(settings) || !json_is_object(inputs)) {
        snprintf(text, size, "nothing says what it was made from");
        differs = FINGERPRINT_SETTINGS | FINGERPRINT_INPUTS;
    } else { // settings last: they explain most
        const json_t *set = json_object_get(now, "settings");
        if (inputs_differ(inputs, json_object_get(now, "inputs"), set, text, size)) differs |= FINGERPRINT_INPUTS;
        if (settings_differ(settings, set, text, size)) differs |= FINGERPRINT_SETTINGS;
    }
    json_decref(was);
    json_decref(now);
    return differs;
}
