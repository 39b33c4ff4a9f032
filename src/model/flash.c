// Which photos were taken with the flash: bit 0 of the EXIF field, the name of their folder, their own name, or the
// user's word.
#include <fnmatch.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "model/photos.h"

#define MAX_LIST_BYTES (1 << 20)

static const char what_to_do[] = "name the flash photos with --flash-glob PATTERN or --flash-list FILE";

static int mark_by_glob(Photos *photos, const char *glob, FsError *err)
{
    int matched = 0;
    for (int i = 0; i < photos->n; i++) {
        PhotoFile *photo = &photos->photo[i];
        bool inside = fnmatch(glob, fs_file_name(photo->file), FNM_EXTMATCH) == 0;
        if (inside || fnmatch(glob, photo->file, FNM_EXTMATCH) == 0) photo->flash = 1, matched++;
    }
    if (matched) return 0;
    return fs_error_input(err, "%s: no photo's name matches --flash-glob '%s' (the first photo is %s)", photos->folder,
                          glob, photos->photo[0].file);
}

// How well a line of the list names a photo: by its file, without its extension, and in whatever case; 0: not at all. A
// JPEG that was left out for a RAW file is that file.
static int likeness(const PhotoFile *photo, const char *line)
{
    const char *file = fs_file_name(photo->file), *name = fs_file_name(line);
    char *own = fs_file_stem(file), *stem = fs_photo_kind(name) < 0 ? strdup(name) : fs_file_stem(name);
    int like = 0;
    if (!own || !stem)
        fs_error_memory(NULL);
    else if (strcmp(line, photo->file) == 0 || strcmp(line, photo->name) == 0)
        like = 5;
    else if (strcmp(name, file) == 0)
        like = 4;
    else if (strcmp(stem, own) == 0)
        like = 3;
    else if (strcasecmp(name, file) == 0)
        like = 2;
    else if (strcasecmp(stem, own) == 0)
        like = 1;
    free(own);
    free(stem);
    return like;
}

// A copy of a photo under another name, which was left out for it.
static void mark_copied(Photos *photos, const char *line)
{
    char *stem = fs_file_stem(line), *name = stem ? fs_photos_copied_name(stem) : NULL;
    PhotoFile *named = NULL;
    for (int i = 0; i < photos->n && name; i++) {
        PhotoFile *photo = &photos->photo[i];
        size_t folder = (size_t)(fs_file_name(line) - line);
        bool same_folder = (size_t)(fs_file_name(photo->file) - photo->file) == folder;
        if (same_folder && strncmp(photo->file, line, folder) == 0 && likeness(photo, name) >= 3) named = photo;
    }
    if (named) named->flash = 1;
    free(stem);
    free(name);
}

static int mark_line(Photos *photos, const char *list, char *line, FsError *err)
{
    int best = 0, n = 0;
    PhotoFile *named = NULL;
    for (char *p = line; *p; p++)
        if (*p == '\\') *p = '/'; // a path of Windows
    for (int i = 0; i < photos->n; i++) {
        int like = likeness(&photos->photo[i], line);
        if (like == 0 || like < best) continue;
        n = like > best ? 1 : n + 1;
        best = like;
        named = &photos->photo[i];
    }
    bool left_out = fs_photo_kind(line) >= 0 && fs_file_exists(fs_file_at("%s/%s", photos->folder, line).text);
    if (n == 0 && left_out) {
        mark_copied(photos, line);
        return 0;
    }
    if (n == 0)
        return fs_error_input(err, "%s: '%s' is no photo of %s (the first one there is %s): correct the list", list,
                              line, photos->folder, photos->photo[0].file);
    if (n > 1)
        return fs_error_input(err, "%s: '%s' may be %d photos of %s, e.g. %s: write it as it is there", list, line, n,
                              photos->folder, named->file);
    named->flash = 1;
    return 0;
}

static char *trimmed(char *line)
{
    line += strspn(line, " \t\"");
    for (size_t n = strlen(line); n > 0 && strchr(" \t\"", line[n - 1]); n--) line[n - 1] = 0;
    return line;
}

// Without what follows a # that is no part of a name: IMG#12.jpg, #12.jpg.
static char *name_in(const Photos *photos, char *line)
{
    line = trimmed(line);
    char *comment = line;
    while (*comment && !(*comment == '#' && (comment == line || strchr(" \t", comment[-1])))) comment++;
    for (int i = 0; i < photos->n && comment == line; i++)
        if (likeness(&photos->photo[i], line) > 0) return line;
    *comment = 0;
    return trimmed(line);
}

static int mark_by_list(Photos *photos, const char *path, FsError *err)
{
    char *text, *rest, *from;
    size_t size;
    int rc = 0, named = 0;
    MUST(fs_file_read(path, MAX_LIST_BYTES, &text, &size, err));
    if (memchr(text, 0, size))
        TRY(fs_error_input(err, "%s: not a text of one photo's name per line; save it as UTF-8", path));
    from = strncmp(text, "\xef\xbb\xbf", 3) == 0 ? text + 3 : text; // byte-order mark
    for (char *line = strtok_r(from, "\r\n", &rest); line; line = strtok_r(NULL, "\r\n", &rest)) {
        line = name_in(photos, line);
        if (!*line) continue;
        TRY(mark_line(photos, path, line, err));
        named++;
    }
    if (!named)
        TRY(fs_error_input(err, "%s: names no photo of %s (the first photo there is %s)", path, photos->folder,
                           photos->photo[0].file));
fail:
    free(text);
    return rc;
}

// A comparison that does without the flash's cues takes photos that say nothing of it.
static bool needs_none(const Settings *set)
{
    int fewest[2];
    fs_photos_fewest(set, false, fewest);
    return fewest[0] == 0 && fewest[1] == 0;
}

// EXIF, but for photos in a folder whose name says it; the photo's own name where EXIF is silent.
static int mark_by_itself(Photos *photos, bool needed, const Log *log, FsError *err)
{
    int unknown = 0, differ = 0;
    const PhotoFile *odd = NULL;
    for (int i = 0; i < photos->n; i++) {
        PhotoFile *photo = &photos->photo[i];
        if (photo->failure.code) continue;
        int exif = photo->flash = fs_exif_flash_fired(&photo->exif);
        if (photo->folder_says >= 0) {
            photo->flash = photo->folder_says;
            if (exif >= 0 && exif != photo->flash) differ++, odd = photo;
        }
        if (photo->flash < 0) photo->flash = photo->name_says;
        if (photo->flash >= 0) continue;
        unknown++;
        photo->flash = 0;
        if (!needed) continue;
        fs_error_input(&photo->failure, "%s: its EXIF does not tell whether the flash fired: %s",
                       fs_photos_path(photos, photo).text, what_to_do);
    }
    if (differ)
        fs_log_warn(log,
                    "the folders of %d photos say the opposite of their EXIF (e.g. %s): the folders are believed; name "
                    "the flash photos with --flash-list where that is wrong",
                    differ, odd->file);
    if (unknown && !needed)
        fs_log_info(log, "%d photos do not tell whether the flash fired: taken for photos without it", unknown);
    if (unknown < photos->n || !needed) return 0;
    return fs_error_input(
        err, "%s: none of the %d photos tells (EXIF Flash, or _flash in its name) whether the flash fired: %s",
        photos->folder, photos->n, what_to_do);
}

void fs_photos_fewest(const Settings *set, bool by_colmap, int fewest[2])
{
    int least = by_colmap ? FS_PHOTOS_FOR_COLMAP : 1;
    for (int flash = 0; flash < 2; flash++) {
        bool only_other = strcmp(set->lighting, flash ? "noflash" : "flash") == 0;
        bool no_cue = strcmp(set->separation, "none") == 0 || strcmp(set->separation, "flashless") == 0;
        fewest[flash] = only_other || no_cue ? 0 : least;
    }
}

int fs_photos_check_groups(const Photos *photos, const FsProject *project, FsError *err)
{
    bool by_colmap = (project->planned & FS_STAGE_POSES) && !*project->set.poses;
    int count[2] = {0, 0}, fewest[2], n = photos->n;
    for (int i = 0; i < n; i++) count[photos->photo[i].flash == 1]++;
    fs_photos_fewest(&project->set, by_colmap, fewest);
    if (n < 2)
        return fs_error_input(err,
                              "%s: one photo (%s): at least one with and one without flash are needed, and 15 of each "
                              "for a good separation",
                              photos->folder, n ? photos->photo[0].file : "none");
    if (count[1] == 0 && fewest[1])
        return fs_error_input(
            err, "%s: no flash photos: the flash fired in none of the %d photos; take some with the flash, or %s",
            photos->folder, n, what_to_do);
    if (count[0] == 0 && fewest[0])
        return fs_error_input(
            err, "%s: only flash photos: the flash fired in all of the %d photos; take some without, or %s",
            photos->folder, n, what_to_do);
    for (int flash = 0; flash < 2; flash++)
        if (count[flash] < fewest[flash])
            return fs_error_input(err,
                                  "%s: %d photos with flash and %d without: COLMAP needs at least %d of each, and a "
                                  "good separation 15; take more, or give known poses with --poses",
                                  photos->folder, count[1], count[0], fewest[flash]);
    if (by_colmap && n < FS_PHOTOS_FOR_COLMAP)
        return fs_error_input(err,
                              "%s: %d photos: COLMAP needs at least %d; take more, or give known poses with --poses",
                              photos->folder, n, FS_PHOTOS_FOR_COLMAP);
    return 0;
}

int fs_photos_mark_flash(Photos *photos, const Settings *set, const Log *log, FsError *err)
{
    bool by_glob = set->flash_glob && *set->flash_glob, by_list = set->flash_list && *set->flash_list;
    if (!by_glob && !by_list) return mark_by_itself(photos, photos->n >= 2 && !needs_none(set), log, err);
    for (int i = 0; i < photos->n; i++) photos->photo[i].flash = 0;
    if (by_glob) MUST(mark_by_glob(photos, set->flash_glob, err));
    if (by_list) MUST(mark_by_list(photos, set->flash_list, err));
    return 0;
}

int fs_photos_find_flash(Photos *photos, const FsProject *project, FsError *err)
{
    const Settings *set = &project->set;
    const Log *log = &project->log;
    MUST(fs_photos_mark_flash(photos, set, log, err));
    MUST(fs_photos_drop_failed(photos, log, err));
    MUST(fs_photos_check_groups(photos, project, err));
    int flash = 0, sorted = 0, named = 0;
    for (int i = 0; i < photos->n; i++) {
        flash += photos->photo[i].flash;
        sorted += photos->photo[i].folder_says >= 0;
        named += photos->photo[i].name_says >= 0 && fs_exif_flash_fired(&photos->photo[i].exif) < 0;
    }
    bool by_glob = set->flash_glob && *set->flash_glob, by_list = set->flash_list && *set->flash_list;
    fs_log_info(log, "%d photos: %d with flash, %d without (%s)", photos->n, flash, photos->n - flash,
                by_glob && by_list    ? "--flash-glob and --flash-list"
                : by_glob             ? "--flash-glob"
                : by_list             ? "--flash-list"
                : sorted == photos->n ? "their folders"
                : sorted              ? "their folders and EXIF"
                : named == photos->n  ? "their names"
                : named               ? "their names and EXIF"
                                      : "EXIF");
    return 0;
}
