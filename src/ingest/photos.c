// Finds the photos of a folder.
#include "ingest/photos.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/hash.h"
#include "base/owned.h"
#include "image/photo.h"

static const struct {
    const char *ext;
    ShotKind kind;
} extensions[] = {
    {"dng", SHOT_RAW},  {"cr2", SHOT_RAW},   {"cr3", SHOT_RAW},   {"crw", SHOT_RAW},  {"nef", SHOT_RAW},
    {"nrw", SHOT_RAW},  {"arw", SHOT_RAW},   {"sr2", SHOT_RAW},   {"srf", SHOT_RAW},  {"raf", SHOT_RAW},
    {"orf", SHOT_RAW},  {"rw2", SHOT_RAW},   {"pef", SHOT_RAW},   {"srw", SHOT_RAW},  {"x3f", SHOT_RAW},
    {"3fr", SHOT_RAW},  {"fff", SHOT_RAW},   {"iiq", SHOT_RAW},   {"erf", SHOT_RAW},  {"mrw", SHOT_RAW},
    {"kdc", SHOT_RAW},  {"dcr", SHOT_RAW},   {"mef", SHOT_RAW},   {"mos", SHOT_RAW},  {"rwl", SHOT_RAW},
    {"gpr", SHOT_RAW},  {"jpg", SHOT_JPEG},  {"jpeg", SHOT_JPEG}, {"jpe", SHOT_JPEG}, {"png", SHOT_PNG},
    {"tif", SHOT_TIFF}, {"tiff", SHOT_TIFF},
};

static const char formats[] = "RAW (DNG, CR2, CR3, NEF, ARW, RAF, ORF, RW2...), JPEG, PNG or TIFF";

static int kind_of(const char *name)
{
    for (size_t i = 0; i < sizeof extensions / sizeof *extensions; i++)
        if (fs_file_has_ext(name, extensions[i].ext)) return (int)extensions[i].kind;
    return -1;
}

static void free_shot(Shot *shot)
{
    free(shot->file);
    free(shot->name);
    *shot = (Shot){0};
}

void fs_shots_free(Shots *shots)
{
    for (int i = 0; i < shots->n; i++) free_shot(&shots->shot[i]);
    free(shots->shot);
    free(shots->folder);
    *shots = (Shots){0};
}

static int compare_shots(const void *a, const void *b)
{
    const Shot *s = a, *t = b;
    int by_name = strcmp(s->name, t->name);
    if (by_name) return by_name;
    return s->kind != t->kind ? (int)s->kind - (int)t->kind : strcmp(s->file, t->file);
}

// Photos of one name stand together, RAW first.
static int drop_doubles(Shots *shots, const Log *log, FsError *err)
{
    int kept = 0, doubles = 0;
    for (int i = 0; i < shots->n; i++) {
        Shot *shot = &shots->shot[i], *last = kept ? &shots->shot[kept - 1] : NULL;
        if (last && strcmp(last->name, shot->name) == 0) {
            if (last->kind != SHOT_RAW || shot->kind != SHOT_JPEG)
                return fs_error_set(err, FS_ERR_INPUT,
                                    "%s: %s and %s would both become the view %s: rename or remove one of them",
                                    shots->folder, last->file, shot->file, shot->name);
            doubles++;
            free_shot(shot);
        } else {
            if (kept != i) {
                shots->shot[kept] = *shot;
                *shot = (Shot){0};
            }
            kept++;
        }
    }
    shots->n = kept;
    if (doubles) fs_log_info(log, "%d photos are there as RAW and as JPEG: the RAW files are used", doubles);
    return 0;
}

int fs_shots_scan(Shots *shots, const char *folder, const Log *log, FsError *err)
{
    *shots = (Shots){.folder = strdup(folder), .white_balance = {1, 1, 1}};
    FileList list = {0};
    int rc = 0, others = 0;
    const char *other = NULL;
    if (!shots->folder) return fs_error_memory(err);
    for (size_t n = strlen(shots->folder); n > 1 && shots->folder[n - 1] == '/'; n--) shots->folder[n - 1] = 0;
    if (fs_file_exists(folder) && !fs_file_is_dir(folder)) {
        rc = fs_error_set(err, FS_ERR_INPUT, "%s: is a file, expected the folder that holds the photos", folder);
        goto fail;
    }
    TRY(fs_file_list(folder, &list, err));
    shots->shot = calloc((size_t)list.n + 1, sizeof *shots->shot);
    if (!shots->shot) {
        rc = fs_error_memory(err);
        goto fail;
    }
    for (int i = 0; i < list.n; i++) {
        int kind = kind_of(list.name[i]);
        char *path = kind < 0 ? NULL : fs_file_path("%s/%s", folder, list.name[i]);
        bool result = path && fs_owned_is_result(path); // photos and results in one folder
        free(path);
        if (kind < 0 || result) {
            others++, other = list.name[i];
            continue;
        }
        Shot *shot = &shots->shot[shots->n++];
        *shot =
            (Shot){.file = strdup(list.name[i]), .name = fs_file_stem(list.name[i]), .kind = (ShotKind)kind, .gain = 1};
        if (!shot->file || !shot->name) {
            rc = fs_error_memory(err);
            goto fail;
        }
    }
    if (shots->n == 0) {
        rc = fs_error_set(err, FS_ERR_INPUT, "%s: no photos (%d other files%s%s): expected %s", folder, others,
                          other ? ", e.g. " : "", other ? other : "", formats);
        goto fail;
    }
    if (others) fs_log_info(log, "%s: %d files that are not photos left out, e.g. %s", folder, others, other);
    qsort(shots->shot, (size_t)shots->n, sizeof *shots->shot, compare_shots);
    TRY(drop_doubles(shots, log, err));
fail:
    fs_file_list_free(&list);
    if (rc < 0) fs_shots_free(shots);
    return rc;
}

static uint64_t add_file(uint64_t hash, const char *path, const char *name)
{
    uint64_t size;
    hash = fs_hash_text(hash, name);
    if (!path || fs_hash_file(path, true, &hash, &size) < 0) hash = fs_hash_text(hash, "unreadable");
    return hash;
}

void fs_shots_fingerprint(const Shots *shots, const char *flash_list, char text[17])
{
    uint64_t hash = FS_HASH_EMPTY;
    for (int i = 0; i < shots->n; i++) {
        char *path = fs_file_path("%s/%s", shots->folder, shots->shot[i].file);
        hash = add_file(hash, path, shots->shot[i].file);
        free(path);
    }
    if (flash_list && *flash_list) hash = add_file(hash, flash_list, "flash list");
    snprintf(text, 17, "%016llx", (unsigned long long)hash);
}

static void read_header(void *context, int i, int worker)
{
    (void)worker;
    Shots *shots = context;
    Shot *shot = &shots->shot[i];
    char *path = fs_file_path("%s/%s", shots->folder, shot->file);
    if (!path) {
        fs_error_memory(&shot->failure);
        return;
    }
    fs_photo_read_info(path, &shot->exif, shot->white_balance, &shot->failure);
    free(path);
}

void fs_shots_read_headers(Shots *shots, Threads *threads)
{
    fs_threads_for(threads, shots->n, read_header, shots);
}

int fs_shots_drop_failed(Shots *shots, const Log *log, FsError *err)
{
    int kept = 0, all = shots->n, failed = 0;
    char names[400] = "";
    FsError first = {0};
    for (int i = 0; i < all; i++) {
        const Shot *shot = &shots->shot[i];
        if (!shot->failure.code) continue;
        if (shot->failure.code != FS_ERR_INPUT) { // memory, disk: not the photo's fault
            if (err) *err = shot->failure;
            return shot->failure.code;
        }
        if (!failed++) first = shot->failure;
        size_t used = strlen(names), length = strlen(shot->file);
        if (used + length + 7 < sizeof names)
            snprintf(names + used, sizeof names - used, "%s%s", used ? ", " : "", shot->file);
        else if (used && names[used - 1] != '.')
            strcat(names, "...");
    }
    if (failed * 3 > all)
        return fs_error_set(err, FS_ERR_INPUT, "%s: %d of %d photos cannot be used: %s (first: %s)", shots->folder,
                            failed, all, names, first.message);
    for (int i = 0; i < all; i++) {
        Shot *shot = &shots->shot[i];
        if (shot->failure.code) {
            fs_log_warn(log, "left out: %s", shot->failure.message);
            free_shot(shot);
            continue;
        }
        if (kept != i) {
            shots->shot[kept] = *shot;
            *shot = (Shot){0};
        }
        kept++;
    }
    shots->n = kept;
    return 0;
}
