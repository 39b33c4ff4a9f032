// The photos of a capture: one a view, with what their headers say.
#include "model/photos.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/hash.h"
#include "base/order.h"
#include "image/photo.h"

#define MOST_GAIN 1000                                // between photos: more is an error of the file
enum { NAMES = sizeof((Photos *)0)->left_out_names }; // bytes

void fs_photos_drop(PhotoFile *photo)
{
    free(photo->path);
    free(photo->instead);
    free(photo->file);
    free(photo->name);
    fs_look_free(&photo->look);
    *photo = (PhotoFile){0};
}

void fs_photos_free(Photos *photos)
{
    for (int i = 0; i < photos->n; i++) fs_photos_drop(&photos->photo[i]);
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

static size_t folder_length(const PhotoFile *photo)
{
    return (size_t)(fs_file_name(photo->path) - photo->path);
}

bool fs_photos_same_folder(const PhotoFile *a, const PhotoFile *b)
{
    size_t n = folder_length(a);
    return n == folder_length(b) && strncmp(a->path, b->path, n) == 0;
}

static int compare_photos(const void *a, const void *b)
{
    const PhotoFile *s = a, *t = b;
    int by_name = strverscmp(s->name, t->name); // "IMG (2)" before "IMG (10)"
    if (by_name) return by_name;
    return s->kind != t->kind ? (int)s->kind - (int)t->kind : strcmp(s->path, t->path);
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

static int name_apart(Photos *photos, FsError *err)
{
    const PhotoFile *clash = find_clash(photos);
    if (clash && !fs_photos_same_folder(clash, clash - 1)) {
        MUST(add_folders(photos, err));
        clash = find_clash(photos);
    }
    if (!clash) return 0;
    return fs_error_input(err, "%s: %s and %s would both become the view %s: rename or remove one of them",
                          photos->folder, clash[-1].file, clash->file, clash->name);
}

// Arrays beside pictures are not photos but something about them: depth, features.
static void drop_arrays(Photos *photos, const Log *log)
{
    int arrays = 0;
    for (int i = 0; i < photos->n; i++) arrays += photos->photo[i].kind == PHOTO_NPY;
    if (arrays == 0 || arrays == photos->n) return;
    for (int i = 0; i < photos->n; i++)
        if (photos->photo[i].kind == PHOTO_NPY) fs_photos_drop(&photos->photo[i]);
    fs_photos_close_gaps(photos);
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
    fs_photos_drop_twice(photos, log);
    qsort(photos->photo, (size_t)photos->n, sizeof *photos->photo, compare_photos);
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

// The first of the names, up to a NULL, that the folder has a mask of, in any case of letters: "MASK_01.PNG".
static bool find_mask(const char *folder, const char *const names[3], FilePath *path)
{
    FileList list;
    bool found = false;
    if (fs_file_list(folder, &list, NULL) < 0) return false;
    for (int k = 0; k < 3 && names[k] && !found; k++) {
        FilePath file = fs_file_at("%s.png", names[k]);
        for (int i = 0; i < list.n && !found; i++) {
            found = strcasecmp(list.name[i], file.text) == 0;
            if (found) *path = fs_file_at("%s/%s", folder, list.name[i]);
        }
    }
    fs_file_list_free(&list);
    return found;
}

// Whether its view is called as its file is: no photo of another folder is.
static bool is_alone(const PhotoFile *photo)
{
    char *stem = fs_file_stem(photo->path), *name = stem ? fs_photos_view_name(stem) : NULL;
    bool alone = name && strcmp(name, photo->name) == 0;
    free(stem);
    free(name);
    return alone;
}

FilePath fs_photos_mask_folder(const Photos *photos, const PhotoFile *photo)
{
    int n = (int)folder_length(photo);
    return n ? fs_file_at("%s/%.*s", photos->masks, n - 1, photo->path) : fs_file_at("%s", photos->masks);
}

bool fs_photos_mask(const Photos *photos, const PhotoFile *photo, FilePath *path)
{
    if (!photos->masks || !*photos->masks) return false;
    *path = fs_file_at("%s/%s.png", photos->masks, photo->path);
    if (fs_file_exists(path->text)) return true;
    char *stem = fs_file_stem(photo->path);
    const char *const view[3] = {photo->name}, *instead = photo->instead ? fs_file_name(photo->instead) : NULL;
    const char *const own[3] = {fs_file_name(photo->path), stem, instead};
    FilePath folder = fs_photos_mask_folder(photos, photo);
    bool found = find_mask(folder.text, own, path) || find_mask(photos->masks, view, path) ||
                 (folder_length(photo) > 0 && is_alone(photo) && find_mask(photos->masks, own, path));
    free(stem);
    return found;
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
    if (photo->failure.code) photo->memory = 0;                             // nobody will read it
    photo->kind = fs_photo_kind_inside(fs_photos_path(photos, photo).text); // JPEGs are called .DNG, too
    if (photo->kind == PHOTO_NPY) memcpy(photo->white_balance, photos->npy.gain, sizeof photo->white_balance);
}

void fs_photos_read_headers(Photos *photos, Threads *threads)
{
    fs_threads_for(threads, photos->n, read_header, photos);
}

double fs_photos_median(const double *value, int n)
{
    double *sorted = malloc((size_t)(n > 0 ? n : 1) * sizeof *sorted), m = 0;
    int k = 0;
    if (!sorted) {
        fs_error_memory(NULL);
        return 0;
    }
    for (int i = 0; i < n; i++)
        if (value[i] > 0) sorted[k++] = value[i];
    if (k) {
        fs_order_doubles(sorted, (size_t)k);
        m = sorted[(k - 1) / 2];
    }
    free(sorted);
    return m;
}

void fs_photos_exposures(const Photos *photos, double *value)
{
    for (int i = 0; i < photos->n; i++) value[i] = photos->photo[i].exif.iso;
    double iso = fs_photos_median(value, photos->n);
    for (int i = 0; i < photos->n; i++) value[i] = photos->photo[i].exif.f_number;
    double f_number = fs_photos_median(value, photos->n);
    for (int i = 0; i < photos->n; i++) {
        ExifInfo exif = photos->photo[i].exif;
        if (!(exif.iso > 0)) exif.iso = iso;
        if (!(exif.f_number > 0)) exif.f_number = f_number;
        value[i] = fs_exif_exposure(&exif);
    }
    double m = fs_photos_median(value, photos->n);
    for (int i = 0; i < photos->n; i++)
        if (!(value[i] < MOST_GAIN * m && MOST_GAIN * value[i] > m)) value[i] = 0;
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
        if (fs_photos_is_copy(photos, &photos->photo[i])) fs_photos_drop(&photos->photo[i]);
    fs_photos_close_gaps(photos);
}

// What cannot be read, and what to do where its JPEG is there, too.
static int warn_left_out(const PhotoFile *photo, const Log *log, FsError *err)
{
    char *instead = photo->instead ? fs_photos_utf8(photo->instead) : NULL;
    if (photo->instead && !instead) return fs_error_memory(err);
    if (instead)
        fs_log_warn(log,
                    "left out: %s. %s of the same shot is there, but would not go together with the others' RAW files: "
                    "copy the RAW file again from the card, or take all RAW files away to have the JPEGs used",
                    photo->failure.message, instead);
    else
        fs_log_warn(log, "left out: %s", photo->failure.message);
    free(instead);
    return 0;
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
    if (photos->left_out * FS_PHOTOS_MOST_FAILED > all)
        return fs_error_input(err, "%s: %d of %d photos cannot be used: %s (first: %s)", photos->folder,
                              photos->left_out, all, photos->left_out_names, photos->left_out_why.message);
    for (int i = 0; i < n; i++) {
        PhotoFile *photo = &photos->photo[i];
        if (!photo->failure.code) continue;
        MUST(warn_left_out(photo, log, err));
        fs_photos_drop(photo);
    }
    fs_photos_close_gaps(photos);
    return 0;
}
