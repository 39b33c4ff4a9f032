// Which photos were taken with the flash: bit 0 of the EXIF field, or the user's word.
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
        if (fnmatch(glob, photo->file, FNM_EXTMATCH) == 0) photo->flash = 1, matched++;
    }
    if (matched) return 0;
    return fs_error_input(err, "%s: no photo's name matches --flash-glob '%s' (the first photo is %s)", photos->folder,
                          glob, photos->photo[0].file);
}

// A line of the list names a photo with or without its extension, or by the file that was dropped for a RAW one.
static bool is_named(const PhotoFile *photo, const char *line)
{
    if (strcmp(line, photo->file) == 0 || strcmp(line, photo->name) == 0) return true;
    char *stem = fs_file_stem(line);
    bool same =
        stem && strcmp(stem, photo->name) == 0 && strcmp(fs_file_name(line), line) == 0 && fs_file_has_ext(line, "jpg");
    free(stem);
    return same;
}

static int mark_by_list(Photos *photos, const char *path, const Log *log, FsError *err)
{
    char *text, *rest;
    size_t size;
    int named = 0, lost = 0;
    MUST(fs_file_read(path, MAX_LIST_BYTES, &text, &size, err));
    char first_lost[100] = "";
    for (char *line = strtok_r(text, "\r\n", &rest); line; line = strtok_r(NULL, "\r\n", &rest)) {
        line[strcspn(line, "#")] = 0;
        line += strspn(line, " \t");
        for (size_t n = strlen(line); n > 0 && strchr(" \t", line[n - 1]); n--) line[n - 1] = 0;
        if (!*line) continue;
        int found = 0;
        for (int i = 0; i < photos->n; i++)
            if (is_named(&photos->photo[i], line)) photos->photo[i].flash = 1, found = 1;
        named += found;
        if (!found && !lost++) snprintf(first_lost, sizeof first_lost, "%s", line);
    }
    free(text);
    if (!named)
        return fs_error_input(err, "%s: names no photo of %s (the first photo there is %s)", path, photos->folder,
                              photos->photo[0].file);
    if (lost)
        fs_log_warn(log, "%s: %d of its names are no photos of %s, e.g. %s", path, lost, photos->folder, first_lost);
    return 0;
}

static int mark_by_exif(Photos *photos, FsError *err)
{
    int unknown = 0;
    for (int i = 0; i < photos->n; i++) {
        PhotoFile *photo = &photos->photo[i];
        photo->flash = fs_exif_flash_fired(&photo->exif);
        if (photo->flash >= 0) continue;
        unknown++;
        fs_error_input(&photo->failure, "%s/%s: its EXIF does not tell whether the flash fired: %s", photos->folder,
                       photo->file, what_to_do);
    }
    if (unknown < photos->n) return 0;
    return fs_error_input(err, "%s: none of the %d photos tells (EXIF Flash) whether the flash fired: %s",
                          photos->folder, photos->n, what_to_do);
}

int fs_photos_check_groups(const Photos *photos, FsError *err)
{
    int flash = 0;
    for (int i = 0; i < photos->n; i++) flash += photos->photo[i].flash == 1;
    if (photos->n < 2)
        return fs_error_input(err,
                              "%s: one photo (%s): at least one with and one without flash are needed, and 15 of each "
                              "for a good separation",
                              photos->folder, photos->n ? photos->photo[0].file : "none");
    if (flash == 0)
        return fs_error_input(
            err, "%s: no flash photos: the flash fired in none of the %d photos; take some with the flash, or %s",
            photos->folder, photos->n, what_to_do);
    if (flash == photos->n)
        return fs_error_input(
            err, "%s: only flash photos: the flash fired in all of the %d photos; take some without, or %s",
            photos->folder, photos->n, what_to_do);
    return 0;
}

int fs_photos_find_flash(Photos *photos, const Settings *set, const Log *log, FsError *err)
{
    bool by_glob = set->flash_glob && *set->flash_glob, by_list = set->flash_list && *set->flash_list;
    if (by_glob || by_list) {
        for (int i = 0; i < photos->n; i++) photos->photo[i].flash = 0;
        if (by_glob) MUST(mark_by_glob(photos, set->flash_glob, err));
        if (by_list) MUST(mark_by_list(photos, set->flash_list, log, err));
    } else {
        if (photos->n >= 2) MUST(mark_by_exif(photos, err));
        MUST(fs_photos_drop_failed(photos, log, err));
    }
    MUST(fs_photos_check_groups(photos, err));
    int flash = 0;
    for (int i = 0; i < photos->n; i++) flash += photos->photo[i].flash;
    fs_log_info(log, "%d photos: %d with flash, %d without (%s)", photos->n, flash, photos->n - flash,
                by_glob   ? "--flash-glob"
                : by_list ? "--flash-list"
                          : "EXIF");
    return 0;
}
