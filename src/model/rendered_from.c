#include "model/rendered_from.h"

#include <jansson.h>
#include <string.h>

#include "base/json_file.h"
#include "model/fingerprint.h"

#define MAX_BYTES 4096

FilePath fs_rendered_from_path(const char *dir)
{
    return fs_file_at("%s/rendered_from.json", dir);
}

static bool hash_clouds(const FsProject *project, char hash[17])
{
    return fs_fingerprint_hash(fs_file_at("%s/clouds", project->out).text, 1, hash);
}

RenderedFrom fs_rendered_from_ask(const FsProject *project, const char *dir)
{
    char now[17];
    json_t *root;
    fs_json_file_read(fs_rendered_from_path(dir).text, MAX_BYTES, &root, NULL);
    const char *was = json_string_value(json_object_get(root, "clouds"));
    RenderedFrom from = RENDERED_FROM_UNKNOWN;
    if (was && hash_clouds(project, now)) from = strcmp(was, now) == 0 ? RENDERED_FROM_THESE : RENDERED_FROM_OTHERS;
    json_decref(root);
    return from;
}

double fs_rendered_from_scale(const char *dir)
{
    json_t *root;
    fs_json_file_read(fs_rendered_from_path(dir).text, MAX_BYTES, &root, NULL);
    double scale = json_number_value(json_object_get(root, "metres_per_unit"));
    json_decref(root);
    return scale > 0 ? scale : 0;
}

int fs_rendered_from_write(const FsProject *project, const char *dir, double metres_per_unit, FsError *err)
{
    char now[17];
    if (!hash_clouds(project, now)) return 0;
    json_t *root = json_pack("{s:s, s:f}", "clouds", now, "metres_per_unit", metres_per_unit);
    return fs_json_file_write(fs_rendered_from_path(dir).text, root, 0, err);
}
