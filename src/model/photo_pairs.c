// Files that hold one shot: RAW and JPEG beside one another, copies under other names.
#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "model/photos.h"

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
    size_t n = (size_t)(fs_file_name(photo->path) - photo->path), k = 0;
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
    int same = fs_photos_same_folder(better, photo) ? 1 : same_time(photos, better, photo);
    char a[9], b[9];
    if (same >= 0) return 2 * same;
    return !camera_folder(better, a) || !camera_folder(photo, b) || strcmp(a, b) == 0;
}

// Bytes of the name that the files of one shot share: "PXL_20240316_1234.RAW-01.COVER", as Google's phones have it, is
// the JPEG of "PXL_20240316_1234.RAW-02.ORIGINAL".
static size_t shot_length(const char *name)
{
    const char *dot = strncasecmp(name, "PXL_", 4) == 0 ? strchr(name, '.') : NULL;
    return dot ? (size_t)(dot - name) : strlen(name);
}

static int compare_shots(const PhotoFile *a, const PhotoFile *b)
{
    size_t n = shot_length(a->name), m = shot_length(b->name);
    int first = strncasecmp(a->name, b->name, n < m ? n : m);
    return first ? first : (n > m) - (n < m);
}

static int compare_for_pairs(const void *a, const void *b)
{
    const PhotoFile *s = a, *t = b;
    int by_shot = compare_shots(s, t);
    if (by_shot) return by_shot;
    return s->kind != t->kind ? (int)s->kind - (int)t->kind : strcmp(s->path, t->path);
}

// Files of one shot come to stand together, RAW first.
static void drop_pairs(Photos *photos, const Log *log)
{
    qsort(photos->photo, (size_t)photos->n, sizeof *photos->photo, compare_for_pairs);
    int doubles = 0, raws = 0, unsure = 0;
    char example[300] = "";
    for (PhotoFile *photo = photos->photo + photos->n - 1; photo > photos->photo; photo--) {
        int pair = 0;
        PhotoFile *of = NULL;
        for (PhotoFile *p = photo; p > photos->photo && pair < 2 && compare_shots(p - 1, photo) == 0; p--) {
            int is = is_pair(photos, p - 1, photo);
            if (is > pair) pair = is, of = p - 1;
        }
        if (!of) continue;
        doubles++;
        raws += of->kind == PHOTO_RAW;
        if (pair == 1) snprintf(example, sizeof example, "%s beside %s", photo->file, of->file), unsure++;
        free(of->instead);
        of->instead = photo->path;
        photo->path = NULL;
        fs_photos_drop(photo);
    }
    fs_photos_close_gaps(photos);
    const char *used = raws ? "RAW" : "HEIF";
    if (doubles) fs_log_info(log, "%d photos are there as %s and as JPEG: the %s files are used", doubles, used, used);
    if (unsure)
        fs_log_warn(log, "%d photos are left out for their names alone (e.g. %s): rename them if they are other shots",
                    unsure, example);
}

static char *first_of(const char *name, size_t n)
{
    char *first = strndup(name, n);
    if (!first) fs_error_memory(NULL);
    return first;
}

char *fs_photos_copied_name(const char *name)
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
        if (of == photo || !of->path || strcmp(of->name, name) != 0 || !fs_photos_same_folder(of, photo)) continue;
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
        char *name = fs_photos_copied_name(photo->name);
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
        fs_photos_drop(photo);
    }
    if (dropped) fs_log_info(log, "%d photos are copies of others (e.g. of %s): left out", dropped, example);
    fs_photos_close_gaps(photos);
}

void fs_photos_drop_twice(Photos *photos, const Log *log)
{
    drop_copies(photos, log); // while the JPEGs they may be copies of are there
    drop_pairs(photos, log);
}

int fs_photos_take_instead(PhotoFile *photo)
{
    char *file = fs_photos_utf8(photo->instead);
    if (!file) return fs_error_memory(NULL);
    free(photo->path);
    free(photo->file);
    photo->path = photo->instead;
    photo->instead = NULL;
    photo->file = file;
    photo->kind = (PhotoKind)fs_photo_kind(photo->path);
    photo->gain = photo->flash_gain = 1;
    fs_look_free(&photo->look);
    photo->failure = (FsError){0};
    return 0;
}

bool fs_photos_take_jpegs(Photos *photos, const Log *log)
{
    int failed = 0, taken = 0;
    const PhotoFile *first = NULL;
    for (int i = 0; i < photos->n; i++) {
        const PhotoFile *photo = &photos->photo[i];
        if (photo->failure.code != FS_ERR_INPUT || !photo->instead) continue;
        if (!failed++) first = photo;
    }
    if (failed * FS_PHOTOS_MOST_FAILED <= photos->n) return false; // they do not go together with RAW
    fs_log_warn(log, "%d of %d files cannot be read (%s): the JPEG or HEIF files beside them are used, for all", failed,
                photos->n, first->failure.message);
    for (int i = 0; i < photos->n; i++)
        taken += photos->photo[i].instead && fs_photos_take_instead(&photos->photo[i]) == 0;
    return taken;
}
