// The photos of a capture: one a view, with what their headers say.
#include "model/photos.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/hash.h"
#include "image/photo.h"

enum { NAMES = sizeof((Photos *)0)->left_out_names }; // bytes

static void free_photo(PhotoFile *photo)
{
    free(photo->path);
    free(photo->file);
    free(photo->name);
    fs_look_free(&photo->look);
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

// Drops the photos without a path.
static void close_gaps(Photos *photos)
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

// Taken at the same second: 1, or not: 0; where one does not tell: -1.
static int same_time(const Photos *photos, const PhotoFile *a, const PhotoFile *b)
{
    ExifInfo info[2];
    if (fs_exif_read(fs_photos_path(photos, a).text, &info[0], NULL) != 0) return -1;
    if (fs_exif_read(fs_photos_path(photos, b).text, &info[1], NULL) != 0) return -1;
    return *info[0].taken && *info[1].taken ? strcmp(info[0].taken, info[1].taken) == 0 : -1;
}

// Whether the folder's own name is one that cameras give: three digits and five letters or digits, "100CANON/".
static bool camera_folder(const PhotoFile *photo, char name[9])
{
    size_t n = folder_length(photo), k = 0;
    if (n < 9 || (n > 9 && photo->path[n - 10] != '/')) return false;
    snprintf(name, 9, "%s", photo->path + n - 9);
    while (k < 3 && isdigit((unsigned char)name[k])) k++;
    while (k >= 3 && k < 8 && (isalnum((unsigned char)name[k]) || name[k] == '_')) k++;
    return k == 8;
}

// What a camera writes beside its RAW, or its HEIF: 2. In another folder it may be of another shot, as cameras begin to
// count again: 1 where nothing but the name tells, 0: no.
static int is_pair(const Photos *photos, const PhotoFile *better, const PhotoFile *photo)
{
    if (better->folder_says != photo->folder_says || better->kind > PHOTO_HEIF || photo->kind <= better->kind ||
        photo->kind > PHOTO_JPEG)
        return 0;
    int same = same_folder(better, photo) ? 1 : same_time(photos, better, photo);
    char a[9], b[9];
    if (same >= 0) return 2 * same;
    return !camera_folder(better, a) || !camera_folder(photo, b) || strcmp(a, b) == 0;
}

// Photos of one name: the second of them; NULL: none.
static const PhotoFile *find_clash(const Photos *photos)
{
    for (const PhotoFile *photo = photos->photo + 1; photo < photos->photo + photos->n; photo++)
        if (strcmp(photo[-1].name, photo->name) == 0) return photo;
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
static void drop_pairs(Photos *photos, const Log *log)
{
    int doubles = 0, raws = 0, unsure = 0;
    char example[300] = "";
    for (PhotoFile *photo = photos->photo + photos->n - 1; photo > photos->photo; photo--) {
        int pair = 0;
        const PhotoFile *of = NULL;
        for (const PhotoFile *p = photo; p > photos->photo && pair < 2 && strcmp(p[-1].name, photo->name) == 0; p--) {
            int is = is_pair(photos, p - 1, photo);
            if (is > pair) pair = is, of = p - 1;
        }
        if (!of) continue;
        doubles++;
        raws += of->kind == PHOTO_RAW;
        if (pair == 1) snprintf(example, sizeof example, "%s beside %s", photo->file, of->file), unsure++;
        free_photo(photo);
    }
    close_gaps(photos);
    const char *used = raws ? "RAW" : "HEIF";
    if (doubles) fs_log_info(log, "%d photos are there as %s and as JPEG: the %s files are used", doubles, used, used);
    if (unsure)
        fs_log_warn(log, "%d photos are left out for their names alone (e.g. %s): rename them if they are other shots",
                    unsure, example);
}

static int name_apart(Photos *photos, FsError *err)
{
    const PhotoFile *clash = find_clash(photos);
    if (clash && !same_folder(clash, clash - 1)) {
        MUST(add_folders(photos, err));
        clash = find_clash(photos);
    }
    if (!clash) return 0;
    return fs_error_input(err, "%s: %s and %s would both become the view %s: rename or remove one of them",
                          photos->folder, clash[-1].file, clash->file, clash->name);
}

static char *first_of(const char *name, size_t n)
{
    char *first = strndup(name, n);
    if (!first) fs_error_memory(NULL);
    return first;
}

// The name of what "IMG_1 (1)", "IMG_1 copy 2", "IMG_1 - Copy" or "Copy of IMG_1" is a copy of; NULL: it is none.
static char *copied_name(const char *name)
{
    size_t n = strlen(name);
    if (strncasecmp(name, "copy of ", 8) == 0 && n > 8) return first_of(name + 8, n - 8);
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
    return first_of(name, n);
}

static bool same_content(const Photos *photos, const PhotoFile *a, const PhotoFile *b)
{
    uint64_t hash[2] = {FS_HASH_EMPTY, FS_HASH_EMPTY}, size[2];
    return fs_hash_file(fs_photos_path(photos, a).text, true, &hash[0], &size[0]) == 0 &&
           fs_hash_file(fs_photos_path(photos, b).text, true, &hash[1], &size[1]) == 0 && size[0] == size[1] &&
           hash[0] == hash[1];
}

// The photo beside it of such a name, the one it is a copy of before others; NULL: there is none.
static const PhotoFile *find_original(const Photos *photos, const PhotoFile *photo, const char *name, bool *copy)
{
    const PhotoFile *found = NULL;
    *copy = false;
    for (const PhotoFile *of = photos->photo; of < photos->photo + photos->n && !*copy; of++) {
        if (of == photo || !of->path || strcmp(of->name, name) != 0 || !same_folder(of, photo)) continue;
        bool raw_too = of->kind == PHOTO_RAW && photo->kind != PHOTO_RAW;
        *copy = same_content(photos, of, photo) || (raw_too && same_time(photos, of, photo) == 1);
        if (*copy || !found) found = of;
    }
    return found;
}

// One shot under two names would count twice.
static void drop_copies(Photos *photos, const Log *log)
{
    int dropped = 0;
    const char *example = NULL;
    for (PhotoFile *photo = photos->photo; photo < photos->photo + photos->n; photo++) {
        errno = 0;
        char *name = copied_name(photo->name);
        if (!name && errno == ENOMEM) fs_error_memory(NULL);
        bool copy = false;
        const PhotoFile *of = name ? find_original(photos, photo, name, &copy) : NULL;
        free(name);
        if (of && !copy)
            fs_log_warn(log, "%s seems to be another version of %s: take one away if they are one shot", photo->file,
                        of->file);
        if (!copy) continue;
        dropped++;
        example = of->file;
        free_photo(photo);
    }
    if (dropped) fs_log_info(log, "%d photos are copies of others (e.g. of %s): left out", dropped, example);
    close_gaps(photos);
}

// Arrays beside pictures are not photos but something about them: depth, features.
static void drop_arrays(Photos *photos, const Log *log)
{
    int arrays = 0;
    for (int i = 0; i < photos->n; i++) arrays += photos->photo[i].kind == PHOTO_NPY;
    if (arrays == 0 || arrays == photos->n) return;
    for (int i = 0; i < photos->n; i++)
        if (photos->photo[i].kind == PHOTO_NPY) free_photo(&photos->photo[i]);
    close_gaps(photos);
    fs_log_info(log, "%d .npy files beside photos are not taken for photos", arrays);
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
    drop_arrays(photos, log);
    qsort(photos->photo, (size_t)photos->n, sizeof *photos->photo, compare_photos);
    drop_copies(photos, log); // while the JPEGs they may be copies of are there
    drop_pairs(photos, log);
    TRY(name_apart(photos, err));
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

int fs_photos_levels(SensorLevels *npy, const Settings *set, FsError *err)
{
    double *g = npy->gain;
    int end = 0;
    npy->black = set->npy_black;
    npy->white = set->npy_white;
    if (sscanf(set->npy_gains, "%lf,%lf,%lf%n", &g[0], &g[1], &g[2], &end) != 3 || set->npy_gains[end] ||
        !(g[0] > 1e-3 && g[1] > 1e-3 && g[2] > 1e-3 && g[0] < 1e3 && g[1] < 1e3 && g[2] < 1e3))
        return fs_error_set(err, FS_ERR_USAGE, "--npy-gains: '%s' is not three numbers from 0.001 to 1000: R,G,B",
                            set->npy_gains);
    if (!(npy->white > npy->black))
        return fs_error_set(err, FS_ERR_USAGE, "--npy-white %g is not above --npy-black %g", npy->white, npy->black);
    return 0;
}

SensorLevels fs_photos_developed(const Photos *photos)
{
    SensorLevels levels = photos->npy;
    memcpy(levels.gain, photos->white_balance, sizeof levels.gain);
    return levels;
}

static void read_header(void *context, int i, int worker)
{
    (void)worker;
    Photos *photos = context;
    PhotoFile *photo = &photos->photo[i];
    fs_photo_read_info(fs_photos_path(photos, photo).text, &photo->exif, photo->white_balance, &photo->memory,
                       &photo->failure);
    if (photo->failure.code) photo->memory = 0; // nobody will read it
    if (photo->kind == PHOTO_NPY) memcpy(photo->white_balance, photos->npy.gain, sizeof photo->white_balance);
}

void fs_photos_read_headers(Photos *photos, Threads *threads)
{
    fs_threads_for(threads, photos->n, read_header, photos);
}

static void add_name(char names[NAMES], const char *name)
{
    size_t used = strlen(names);
    if (used + strlen(name) + 7 < NAMES)
        snprintf(names + used, NAMES - used, "%s%s", used ? ", " : "", name);
    else if (used && names[used - 1] != '.')
        strcat(names, "...");
}

bool fs_photos_is_copy(const Photos *photos, const PhotoFile *photo)
{
    for (const PhotoFile *of = photos->photo; of < photo; of++)
        if (of->flash == photo->flash && !of->failure.code && !photo->failure.code && of->look.hash &&
            of->look.hash == photo->look.hash)
            return true;
    return false;
}

void fs_photos_drop_copies(Photos *photos)
{
    int n = photos->n;
    for (int i = 0; i < n; i++) {
        if (!fs_photos_is_copy(photos, &photos->photo[i])) continue;
        photos->copies++;
        add_name(photos->copies_names, photos->photo[i].file);
    }
    for (int i = n - 1; i >= 0; i--) // what they are copies of comes before them
        if (fs_photos_is_copy(photos, &photos->photo[i])) free_photo(&photos->photo[i]);
    close_gaps(photos);
}

int fs_photos_drop_failed(Photos *photos, const Log *log, FsError *err)
{
    int n = photos->n, all = n + photos->left_out;
    for (int i = 0; i < n; i++) {
        const PhotoFile *photo = &photos->photo[i];
        if (!photo->failure.code) continue;
        if (photo->failure.code != FS_ERR_INPUT) { // memory, disk: not the photo's fault
            if (err) *err = photo->failure;
            return photo->failure.code;
        }
        if (!photos->left_out++) photos->left_out_why = photo->failure;
        add_name(photos->left_out_names, photo->file);
    }
    if (photos->left_out * 3 > all)
        return fs_error_input(err, "%s: %d of %d photos cannot be used: %s (first: %s)", photos->folder,
                              photos->left_out, all, photos->left_out_names, photos->left_out_why.message);
    for (int i = 0; i < n; i++) {
        PhotoFile *photo = &photos->photo[i];
        if (!photo->failure.code) continue;
        fs_log_warn(log, "left out: %s", photo->failure.message);
        free_photo(photo);
    }
    close_gaps(photos);
    return 0;
}
