// Which files of a folder are photos, what each is called as a view, and what names say of the flash.
#include <ctype.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "base/memory.h"
#include "base/owned.h"
#include "model/photos.h"
#include "model/scene_folder.h"

#define MAX_DEPTH 3  // of folders: DCIM/100CANON/flash
#define MAX_NAME 160 // bytes of a view's: files are called so, with something behind it
#define MAX_PHOTOS 100000

static const char formats[] = "RAW (DNG, CR2, CR3, NEF, ARW, RAF, ORF, RW2...), JPEG, HEIF, PNG, TIFF or .npy";

typedef struct Search {
    Photos *photos;
    const Log *log;
    int others;
    char other[100]; // one of these
    FilePath ours;   // a folder that was passed over, as flashsplat made it
} Search;

// ---- names ----

// Bytes of the UTF-8 character that begins here, 0: there is none.
static size_t utf8_length(const unsigned char *p)
{
    size_t n = *p < 0x80                 ? 1
               : *p >= 0xc2 && *p < 0xe0 ? 2
               : *p >= 0xe0 && *p < 0xf0 ? 3
               : *p >= 0xf0 && *p < 0xf5 ? 4
                                         : 0;
    for (size_t i = 1; i < n; i++)
        if ((p[i] & 0xc0) != 0x80) return 0;
    bool overlong = (*p == 0xe0 && p[1] < 0xa0) || (*p == 0xf0 && p[1] < 0x90);
    bool surrogate = *p == 0xed && p[1] >= 0xa0, beyond = *p == 0xf4 && p[1] >= 0x90;
    return overlong || surrogate || beyond ? 0 : n;
}

char *fs_photos_utf8(const char *text)
{
    char *out = malloc(2 * strlen(text) + 1), *to = out;
    const unsigned char *p = (const unsigned char *)text;
    while (out && *p) {
        size_t n = utf8_length(p);
        if (n == 0) {
            *to++ = (char)(0xc0 | *p >> 6);
            *to++ = (char)(0x80 | (*p & 0x3f));
            p++;
        }
        for (size_t i = 0; i < n; i++) *to++ = (char)*p++;
    }
    if (out) *to = 0;
    return out;
}

char *fs_photos_view_name(const char *path)
{
    char *name = fs_photos_utf8(path);
    if (!name) return NULL;
    for (unsigned char *p = (unsigned char *)name; *p; p++) {
        bool control = *p < ' ' || *p == 127, high_control = *p == 0xc2 && p[1] < 0xa0;
        if (*p == '/' || *p == '\\' || control || high_control) *p = '_';
        if (high_control) p[1] = '_';
    }
    for (char *p = name; *p == ' '; p++) *p = '_'; // COLMAP's reader drops them
    size_t n = strlen(name);
    if (n > MAX_NAME) {
        uint64_t hash = fs_hash_text(FS_HASH_EMPTY, name);
        n = MAX_NAME - 9;
        while ((name[n] & 0xc0) == 0x80) n--;
        snprintf(name + n, 10, "~%08x", (unsigned)hash);
    }
    return name;
}

// Is the text, of n letters, one of the words, with spaces between and at their ends?
static bool is_among(const char *words, const char *text, size_t n)
{
    for (const char *p = words; *p; p = strchr(p, ' ') + 1)
        if (strncmp(p, text, n) == 0 && p[n] == ' ') return true;
    return false;
}

// Of letters only, in lower case: 1, 0; -1: neither. People sort their photos in their own language.
static int what_letters_say(const char *letters)
{
    static const char with[] = "with mit avec con com med met ", off[] = "off aus ",
                      without[] = "no non without sans ohne kein keine sin senza sem zonder geen uten utan uden bez ",
                      things[] = "photo photos foto fotos bild bilder ", *const flashes[] = {"flash", "blitz", "flits"};
    if (strcmp(letters, "ambient") == 0) return 0;
    for (size_t i = 0; i < sizeof flashes / sizeof *flashes; i++) {
        const char *flash = strstr(letters, flashes[i]);
        if (!flash) continue;
        const char *after = flash + strlen(flashes[i]);
        size_t n = (size_t)(flash - letters);
        bool alone = !*after || is_among(things, after, strlen(after));
        if (n && alone && is_among(without, letters, n)) return 0;
        if (n == 0 && is_among(off, after, strlen(after))) return 0;
        if (n ? alone && is_among(with, letters, n) : alone || is_among("on an ", after, strlen(after))) return 1;
    }
    return -1;
}

// "flash", "No-Flash 2", "ohne Blitz": 1, 0, 0; -1: neither.
static int what_folder_says(const char *folder)
{
    char letters[32] = "";
    size_t n = 0;
    for (const char *p = folder; *p && n + 1 < sizeof letters; p++)
        if (isalpha((unsigned char)*p)) letters[n++] = (char)tolower((unsigned char)*p);
    return what_letters_say(letters);
}

// "flash0002" is "flash"; a number alone stays.
static void without_number(char *word)
{
    size_t n = strlen(word);
    while (n > 0 && isdigit((unsigned char)word[n - 1])) n--;
    if (n > 0) word[n] = 0;
}

// By a word of it: "IMG_0001_flash", "noflash-3", "7 no flash", "scene_flash0002": 1, 0, 0, 1; -1: none.
static int what_name_says(const char *name)
{
    char before[32] = "", word[32] = "", both[64];
    int says = -1;
    for (const char *p = name;; p++) {
        size_t n = strlen(word);
        if (*p && !strchr("_-. ()", *p)) {
            if (n + 1 < sizeof word) word[n] = (char)tolower((unsigned char)*p), word[n + 1] = 0;
            continue;
        }
        without_number(word);
        snprintf(both, sizeof both, "%s%s", before, word);
        int one = what_letters_say(word), two = what_letters_say(both);
        if (one == 0 || two == 0) return 0;
        if (one == 1) says = 1;
        if (!*p) return says;
        memcpy(before, word, sizeof word);
        word[0] = 0;
    }
}

// ---- files ----

static int add_photo(Photos *photos, const char *path, int kind, int says, FsError *err)
{
    if (photos->n == MAX_PHOTOS)
        return fs_error_input(err, "%s: more than %d photos: expected those of one capture", photos->folder,
                              MAX_PHOTOS);
    MUST(fs_memory_grow(&photos->photo, photos->n, sizeof *photos->photo, err));
    PhotoFile *photo = &photos->photo[photos->n++];
    char *stem = fs_file_stem(path);
    *photo = (PhotoFile){
        .path = strdup(path), .file = fs_photos_utf8(path), .kind = (PhotoKind)kind, .gain = 1, .flash_gain = 1};
    photo->folder_says = says;
    photo->name_says = stem ? what_name_says(stem) : -1;
    photo->name = stem ? fs_photos_view_name(stem) : NULL;
    free(stem);
    return photo->path && photo->file && photo->name ? 0 : fs_error_memory(err);
}

// The files right in a folder, below the photos' one ("" or with a slash at its end).
static int search(Search *s, const char *below, int says, FsError *err)
{
    FileList list = {0};
    int rc = 0;
    FilePath folder = fs_file_at("%s/%s", s->photos->folder, below);
    TRY(fs_file_list(*below ? folder.text : s->photos->folder, &list, err));
    for (int i = 0; i < list.n; i++) {
        bool poses = strcmp(list.name[i], FS_SCENE_FOLDER_BOUNDS) == 0;
        int kind = poses ? -1 : fs_photo_kind(list.name[i]);
        FilePath path = fs_file_at("%s%s", below, list.name[i]),
                 whole = fs_file_at("%s/%s", s->photos->folder, path.text);
        if (fs_file_is_dir(whole.text)) continue;
        if (kind < 0 || fs_owned_is_result(whole.text)) { // photos and results in one folder
            s->others++;
            snprintf(s->other, sizeof s->other, "%s", list.name[i]);
        } else {
            TRY(add_photo(s->photos, path.text, kind, says, err));
        }
    }
fail:
    fs_file_list_free(&list);
    return rc;
}

// Not the results of another run, nor what is made with a truth beside it.
static bool is_ours(const char *folder)
{
    return fs_file_exists(fs_file_at("%s/" FS_OWNED_DIR, folder).text);
}

// As captures that are made have it.
static bool has_raw(const char *folder)
{
    return fs_file_is_dir(fs_file_at("%s/raw", folder).text);
}

// What network drives and archives put beside photos: small pictures of them, and what has their names.
static bool is_rubbish(const char *folder)
{
    return strcmp(folder, "@eaDir") == 0 || strcmp(folder, "__MACOSX") == 0 || strcmp(folder, "#recycle") == 0;
}

static int search_below(Search *s, const char *below, int says, int depth, FsError *err)
{
    FileList list = {0};
    int rc = 0;
    FilePath folder = fs_file_at("%s/%s", s->photos->folder, below);
    if (is_ours(folder.text)) s->ours = fs_file_at("%s", s->photos->folder); // it is not looked into
    if (depth == 0 || is_ours(folder.text) || fs_file_list(folder.text, &list, NULL) < 0) return 0;
    for (int i = 0; i < list.n; i++) {
        FilePath inner = fs_file_at("%s%s/", below, list.name[i]);
        FilePath whole = fs_file_at("%s/%s", s->photos->folder, inner.text);
        int inner_says = what_folder_says(list.name[i]);
        if (!fs_file_is_dir(whole.text) || is_rubbish(list.name[i])) continue;
        if (is_ours(whole.text)) {
            whole.text[strlen(whole.text) - 1] = 0; // slash
            if (!*s->ours.text || has_raw(whole.text)) s->ours = whole;
            continue;
        }
        if (inner_says < 0) inner_says = says;
        FsError why = {0};
        if ((rc = search(s, inner.text, inner_says, &why)) == FS_ERR_INPUT) { // lost+found, say
            fs_log_warn(s->log, "%s; it is passed over", why.message);
            rc = 0;
            continue;
        }
        if (rc < 0 && err) *err = why;
        if (rc < 0) goto fail;
        TRY(search_below(s, inner.text, inner_says, depth - 1, err));
    }
fail:
    fs_file_list_free(&list);
    return rc;
}

static int say_none(const Search *s, FsError *err)
{
    const Photos *photos = s->photos;
    const char *ours = s->ours.text;
    size_t n = strlen(ours);
    bool raw = n && has_raw(ours);
    if (!raw && strcmp(ours, photos->folder) == 0)
        return fs_error_input(err,
                              "%s: no photos right in it, and flashsplat made results there: its subfolders are not "
                              "looked into; give -o a folder of its own, or name the folder with the photos itself",
                              photos->folder);
    if (n)
        return fs_error_input(err,
                              "%s: no photos; what is in folders that flashsplat made (%s) is not taken unasked: name "
                              "the folder with the photos itself%s%s%s",
                              photos->folder, ours, raw ? ", " : "", raw ? ours : "", raw ? "/raw" : "");
    return fs_error_input(err, "%s: no photos (%d other files%s%s): expected %s", photos->folder, s->others,
                          *s->other ? ", e.g. " : "", s->other, formats);
}

int fs_photos_list(Photos *photos, const Log *log, FsError *err)
{
    Search s = {.photos = photos, .log = log};
    SceneFolder scene;
    bool published = fs_scene_folder_find(&scene, photos->folder);
    MUST(search(&s, published ? fs_file_at("%s/", scene.photos).text : "", -1, err));
    int alone = photos->n; // one photo is no capture: a cover, say
    if (alone < 2 && !published) MUST(search_below(&s, "", -1, MAX_DEPTH, err));
    if (photos->n > alone && alone == 0)
        fs_log_info(log, "%s: no photos; %d in its subfolders are taken", photos->folder, photos->n);
    if (photos->n > alone && alone == 1) {
        fs_log_warn(log, "%s: one photo, %s, which is left out: the %d in its subfolders are taken", photos->folder,
                    photos->photo[0].file, photos->n - 1);
        fs_photos_drop(&photos->photo[0]);
        fs_photos_close_gaps(photos);
    }
    if (photos->n == 0) return say_none(&s, err);
    if (s.others)
        fs_log_info(log, "%s: %d files that are not photos left out, e.g. %s", photos->folder, s.others, s.other);
    return 0;
}
