// Finds the photos of a folder.
#include "model/photos.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/hash.h"
#include "base/owned.h"
#include "image/photo.h"

static const char formats[] = "RAW (DNG, CR2, CR3, NEF, ARW, RAF, ORF, RW2...), JPEG, PNG or TIFF";

static void free_photo(PhotoFile *photo)
{
    free(photo->file);
    free(photo->name);
    *photo = (PhotoFile){0};
}

void fs_photos_free(Photos *photos)
{
    for (int i = 0; i < photos->n; i++) free_photo(&photos->photo[i]);
    free(photos->photo);
    free(photos->folder);
    *photos = (Photos){0};
}

// Where photos were freed.
static void close_gaps(Photos *photos)
{
    int kept = 0;
    for (int i = 0; i < photos->n; i++)
        if (photos->photo[i].file) photos->photo[kept++] = photos->photo[i];
    photos->n = kept;
}

static int compare_photos(const void *a, const void *b)
{
    const PhotoFile *s = a, *t = b;
    int by_name = strcmp(s->name, t->name);
    if (by_name) return by_name;
    return s->kind != t->kind ? (int)s->kind - (int)t->kind : strcmp(s->file, t->file);
}

// Photos of one name stand together, RAW first.
static int drop_doubles(Photos *photos, const Log *log, FsError *err)
{
    int doubles = 0;
    PhotoFile *last = photos->photo;
    for (PhotoFile *photo = last + 1; photo < photos->photo + photos->n; photo++) {
        if (strcmp(last->name, photo->name) != 0) {
            last = photo;
            continue;
        }
        if (last->kind != PHOTO_RAW || photo->kind != PHOTO_JPEG)
            return fs_error_input(err, "%s: %s and %s would both become the view %s: rename or remove one of them",
                                  photos->folder, last->file, photo->file, photo->name);
        doubles++;
        free_photo(photo);
    }
    close_gaps(photos);
    if (doubles) fs_log_info(log, "%d photos are there as RAW and as JPEG: the RAW files are used", doubles);
    return 0;
}

// Views are listed as JSON.
static int check_name(const char *folder, const char *name, FsError *err)
{
    json_t *text = json_string(name);
    if (!text && errno == ENOMEM) return fs_error_memory(err);
    if (!text) return fs_error_input(err, "%s/%s: a name that is not UTF-8: rename it", folder, name);
    json_decref(text);
    return 0;
}

int fs_photos_scan(Photos *photos, const char *folder, const Log *log, FsError *err)
{
    *photos = (Photos){.folder = strdup(folder), .white_balance = {1, 1, 1}};
    FileList list = {0};
    int rc = 0, others = 0;
    const char *other = NULL;
    if (!photos->folder) return fs_error_memory(err);
    for (size_t n = strlen(photos->folder); n > 1 && photos->folder[n - 1] == '/'; n--) photos->folder[n - 1] = 0;
    if (fs_file_exists(folder) && !fs_file_is_dir(folder))
        TRY(fs_error_input(err, "%s: is a file, expected the folder that holds the photos", folder));
    TRY(fs_file_list(folder, &list, err));
    photos->photo = calloc((size_t)list.n + 1, sizeof *photos->photo);
    if (!photos->photo) TRY(fs_error_memory(err));
    for (int i = 0; i < list.n; i++) {
        int kind = fs_photo_kind(list.name[i]);
        FilePath path = fs_file_at("%s/%s", folder, list.name[i]);
        if (kind < 0 || fs_owned_is_result(path.text)) { // photos and results in one folder
            others++, other = list.name[i];
            continue;
        }
        TRY(check_name(folder, list.name[i], err));
        PhotoFile *photo = &photos->photo[photos->n++];
        *photo = (PhotoFile){
            .file = strdup(list.name[i]), .name = fs_file_stem(list.name[i]), .kind = (PhotoKind)kind, .gain = 1};
        if (!photo->file || !photo->name) TRY(fs_error_memory(err));
    }
    if (photos->n == 0)
        TRY(fs_error_input(err, "%s: no photos (%d other files%s%s): expected %s", folder, others,
                           other ? ", e.g. " : "", other ? other : "", formats));
    if (others) fs_log_info(log, "%s: %d files that are not photos left out, e.g. %s", folder, others, other);
    qsort(photos->photo, (size_t)photos->n, sizeof *photos->photo, compare_photos);
    TRY(drop_doubles(photos, log, err));
fail:
    fs_file_list_free(&list);
    if (rc < 0) fs_photos_free(photos);
    return rc;
}

static uint64_t add_file(uint64_t hash, const char *path, const char *name)
{
    uint64_t size;
    hash = fs_hash_text(hash, name);
    if (fs_hash_file(path, true, &hash, &size) < 0) hash = fs_hash_text(hash, "unreadable");
    return hash;
}

void fs_photos_fingerprint(const Photos *photos, const char *flash_list, char text[17])
{
    uint64_t hash = FS_HASH_EMPTY;
    for (int i = 0; i < photos->n; i++) {
        FilePath path = fs_file_at("%s/%s", photos->folder, photos->photo[i].file);
        hash = add_file(hash, path.text, photos->photo[i].file);
    }
    if (flash_list && *flash_list) hash = add_file(hash, flash_list, "flash list");
    snprintf(text, 17, "%016llx", (unsigned long long)hash);
}

static void read_header(void *context, int i, int worker)
{
    (void)worker;
    Photos *photos = context;
    PhotoFile *photo = &photos->photo[i];
    FilePath path = fs_file_at("%s/%s", photos->folder, photo->file);
    fs_photo_read_info(path.text, &photo->exif, photo->white_balance, &photo->memory, &photo->failure);
}

void fs_photos_read_headers(Photos *photos, Threads *threads)
{
    fs_threads_for(threads, photos->n, read_header, photos);
}

int fs_photos_drop_failed(Photos *photos, const Log *log, FsError *err)
{
    int all = photos->n, failed = 0;
    char names[400] = "";
    FsError first = {0};
    for (int i = 0; i < all; i++) {
        const PhotoFile *photo = &photos->photo[i];
        if (!photo->failure.code) continue;
        if (photo->failure.code != FS_ERR_INPUT) { // memory, disk: not the photo's fault
            if (err) *err = photo->failure;
            return photo->failure.code;
        }
        if (!failed++) first = photo->failure;
        size_t used = strlen(names), length = strlen(photo->file);
        if (used + length + 7 < sizeof names)
            snprintf(names + used, sizeof names - used, "%s%s", used ? ", " : "", photo->file);
        else if (used && names[used - 1] != '.')
            strcat(names, "...");
    }
    if (failed * 3 > all)
        return fs_error_input(err, "%s: %d of %d photos cannot be used: %s (first: %s)", photos->folder, failed, all,
                              names, first.message);
    for (int i = 0; i < all; i++) {
        PhotoFile *photo = &photos->photo[i];
        if (!photo->failure.code) continue;
        fs_log_warn(log, "left out: %s", photo->failure.message);
        free_photo(photo);
    }
    close_gaps(photos);
    return 0;
}
