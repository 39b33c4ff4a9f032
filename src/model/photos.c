// The photos of a capture: one a view, with what their headers say.
#include "model/photos.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/hash.h"
#include "image/photo.h"

static void free_photo(PhotoFile *photo)
{
    free(photo->path);
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

FilePath fs_photos_path(const Photos *photos, const PhotoFile *photo)
{
    return fs_file_at("%s/%s", photos->folder, photo->path);
}

void fs_photos_close_gaps(Photos *photos)
{
    int kept = 0;
    for (int i = 0; i < photos->n; i++)
        if (photos->photo[i].path) photos->photo[kept++] = photos->photo[i];
    photos->n = kept;
}

static int compare_photos(const void *a, const void *b)
{
    const PhotoFile *s = a, *t = b;
    int by_name = strcmp(s->name, t->name);
    if (by_name) return by_name;
    return s->kind != t->kind ? (int)s->kind - (int)t->kind : strcmp(s->path, t->path);
}

static size_t folder_length(const PhotoFile *photo)
{
    return (size_t)(fs_file_name(photo->path) - photo->path);
}

static bool same_folder(const PhotoFile *a, const PhotoFile *b)
{
    size_t n = folder_length(a);
    return n == folder_length(b) && strncmp(a->path, b->path, n) == 0;
}

// What a camera writes beside its RAW, or its HEIF.
static bool is_pair(const PhotoFile *better, const PhotoFile *photo)
{
    return better->folder_says == photo->folder_says && better->kind <= PHOTO_HEIF && photo->kind > better->kind &&
           photo->kind <= PHOTO_JPEG;
}

// Photos of one name that are not the same shot twice: the second of them; NULL: none.
static const PhotoFile *find_clash(const Photos *photos, const PhotoFile **first)
{
    *first = photos->photo;
    for (const PhotoFile *photo = *first + 1; photo < photos->photo + photos->n; photo++) {
        if (strcmp((*first)->name, photo->name) != 0)
            *first = photo;
        else if (!is_pair(*first, photo))
            return photo;
    }
    return NULL;
}

// "flash/IMG_1.DNG" and "noflash/IMG_1.DNG" are the views flash_IMG_1 and noflash_IMG_1.
static int add_folders(Photos *photos, FsError *err)
{
    for (int i = 0; i < photos->n; i++) {
        PhotoFile *photo = &photos->photo[i];
        char *whole = fs_file_path("%.*s%s", (int)folder_length(photo), photo->path, photo->name);
        char *name = whole ? fs_photos_view_name(whole) : NULL;
        free(whole);
        if (!name) return fs_error_memory(err);
        free(photo->name);
        photo->name = name;
    }
    qsort(photos->photo, (size_t)photos->n, sizeof *photos->photo, compare_photos);
    return 0;
}

// Photos of one name stand together, RAW first.
static int drop_doubles(Photos *photos, const Log *log, FsError *err)
{
    int doubles = 0, raws = 0;
    const PhotoFile *last, *clash = find_clash(photos, &last);
    if (clash && !same_folder(clash, last)) {
        MUST(add_folders(photos, err));
        clash = find_clash(photos, &last);
    }
    if (clash)
        return fs_error_input(err, "%s: %s and %s would both become the view %s: rename or remove one of them",
                              photos->folder, last->file, clash->file, clash->name);
    last = photos->photo;
    for (PhotoFile *photo = photos->photo + 1; photo < photos->photo + photos->n; photo++) {
        if (strcmp(last->name, photo->name) != 0) {
            last = photo;
            continue;
        }
        doubles++;
        raws += last->kind == PHOTO_RAW;
        free_photo(photo);
    }
    fs_photos_close_gaps(photos);
    const char *used = raws ? "RAW" : "HEIF";
    if (doubles) fs_log_info(log, "%d photos are there as %s and as JPEG: the %s files are used", doubles, used, used);
    return 0;
}

// The name of what "IMG_1 (1)", "IMG_1 copy 2", "IMG_1 - Copy" or "Copy of IMG_1" is a copy of; NULL: it is none.
static char *copied_name(const char *name)
{
    size_t n = strlen(name);
    if (strncasecmp(name, "copy of ", 8) == 0 && n > 8) return strdup(name + 8);
    if (n > 3 && name[n - 1] == ')') { // a number in brackets
        size_t k = n - 1;
        while (k > 0 && isdigit((unsigned char)name[k - 1])) k--;
        if (k == n - 1 || k < 2 || name[k - 1] != '(') return NULL;
        for (n = k - 1; n > 1 && name[n - 1] == ' ';) n--;
    } else { // a number behind "copy"
        while (n > 0 && isdigit((unsigned char)name[n - 1])) n--;
        while (n > 0 && name[n - 1] == ' ') n--;
        if (n < 6 || strncasecmp(name + n - 4, "copy", 4) != 0 || !strchr(" -_", name[n - 5])) return NULL;
    }
    if (n > 5 && strncasecmp(name + n - 4, "copy", 4) == 0 && strchr(" -_", name[n - 5])) n -= 4;
    while (n > 1 && strchr(" -_", name[n - 1])) n--;
    return strndup(name, n);
}

static bool same_content(const Photos *photos, const PhotoFile *a, const PhotoFile *b)
{
    uint64_t hash[2] = {FS_HASH_EMPTY, FS_HASH_EMPTY}, size[2];
    return fs_hash_file(fs_photos_path(photos, a).text, true, &hash[0], &size[0]) == 0 &&
           fs_hash_file(fs_photos_path(photos, b).text, true, &hash[1], &size[1]) == 0 && size[0] == size[1] &&
           hash[0] == hash[1];
}

// One shot under two names would count twice.
static void drop_copies(Photos *photos, const Log *log)
{
    int dropped = 0, n = photos->n;
    const char *example = NULL;
    for (int i = 0; i < n; i++) {
        PhotoFile *photo = &photos->photo[i];
        errno = 0;
        char *name = copied_name(photo->name);
        if (!name && errno == ENOMEM) fs_error_memory(NULL);
        for (int k = 0; name && k < n; k++) {
            const PhotoFile *of = &photos->photo[k];
            if (k == i || !of->path || strcmp(of->name, name) != 0 || !same_folder(of, photo)) continue;
            if ((of->kind == PHOTO_RAW && photo->kind != PHOTO_RAW) || same_content(photos, of, photo)) {
                dropped++;
                example = of->file;
                free_photo(photo);
            } else {
                fs_log_warn(log, "%s seems to be another version of %s: take one away if they are one shot",
                            photo->file, of->file);
            }
            break;
        }
        free(name);
    }
    fs_photos_close_gaps(photos);
    if (dropped) fs_log_info(log, "%d photos are copies of others (e.g. of %s): left out", dropped, example);
}

int fs_photos_scan(Photos *photos, const char *folder, const Log *log, FsError *err)
{
    *photos = (Photos){.folder = strdup(folder), .white_balance = {1, 1, 1}};
    int rc = 0;
    if (!photos->folder) return fs_error_memory(err);
    for (size_t n = strlen(photos->folder); n > 1 && photos->folder[n - 1] == '/'; n--) photos->folder[n - 1] = 0;
    if (fs_file_exists(folder) && !fs_file_is_dir(folder))
        TRY(fs_error_input(err, "%s: is a file, expected the folder that holds the photos", folder));
    TRY(fs_photos_list(photos, log, err));
    qsort(photos->photo, (size_t)photos->n, sizeof *photos->photo, compare_photos);
    TRY(drop_doubles(photos, log, err));
    drop_copies(photos, log);
fail:
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

bool fs_photos_mask(const Photos *photos, const PhotoFile *photo, FilePath *path)
{
    if (!photos->masks || !*photos->masks) return false;
    *path = fs_file_at("%s/%s.png", photos->masks, photo->path);
    if (fs_file_exists(path->text)) return true;
    *path = fs_file_at("%s/%s.png", photos->masks, photo->name);
    return fs_file_exists(path->text);
}

void fs_photos_fingerprint(const Photos *photos, const char *flash_list, char text[17])
{
    uint64_t hash = FS_HASH_EMPTY;
    for (int i = 0; i < photos->n; i++) {
        const PhotoFile *photo = &photos->photo[i];
        FilePath mask;
        hash = add_file(hash, fs_photos_path(photos, photo).text, photo->path);
        if (fs_photos_mask(photos, photo, &mask)) hash = add_file(hash, mask.text, "mask");
    }
    if (flash_list && *flash_list) hash = add_file(hash, flash_list, "flash list");
    snprintf(text, 17, "%016llx", (unsigned long long)hash);
}

static void read_header(void *context, int i, int worker)
{
    (void)worker;
    Photos *photos = context;
    PhotoFile *photo = &photos->photo[i];
    fs_photo_read_info(fs_photos_path(photos, photo).text, &photo->exif, photo->white_balance, &photo->memory,
                       &photo->failure);
}

void fs_photos_read_headers(Photos *photos, Threads *threads)
{
    fs_threads_for(threads, photos->n, read_header, photos);
}

int fs_photos_drop_failed(Photos *photos, const Log *log, FsError *err)
{
    int n = photos->n, all = n + photos->left_out;
    char *names = photos->left_out_names;
    const size_t size = sizeof photos->left_out_names;
    for (int i = 0; i < n; i++) {
        const PhotoFile *photo = &photos->photo[i];
        if (!photo->failure.code) continue;
        if (photo->failure.code != FS_ERR_INPUT) { // memory, disk: not the photo's fault
            if (err) *err = photo->failure;
            return photo->failure.code;
        }
        if (!photos->left_out++) photos->left_out_why = photo->failure;
        size_t used = strlen(names), length = strlen(photo->file);
        if (used + length + 7 < size)
            snprintf(names + used, size - used, "%s%s", used ? ", " : "", photo->file);
        else if (used && names[used - 1] != '.')
            strcat(names, "...");
    }
    if (photos->left_out * 3 > all)
        return fs_error_input(err, "%s: %d of %d photos cannot be used: %s (first: %s)", photos->folder,
                              photos->left_out, all, names, photos->left_out_why.message);
    for (int i = 0; i < n; i++) {
        PhotoFile *photo = &photos->photo[i];
        if (!photo->failure.code) continue;
        fs_log_warn(log, "left out: %s", photo->failure.message);
        free_photo(photo);
    }
    fs_photos_close_gaps(photos);
    return 0;
}
