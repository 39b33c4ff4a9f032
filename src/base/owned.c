#include "base/owned.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <time.h>
#include <unistd.h>

#include "base/file.h"
#include "base/hash.h"

#define LIST FS_OWNED_DIR "/made"
#define LOCK FS_OWNED_DIR "/lock"
#define MAX_LIST ((size_t)1 << 30)
#define MARK "user.flashsplat" // extended attribute of files outside our folders: a line of the list, without name
#define SIGNATURE "user.flashsplat.command"

// Where a path is: the nearest folder of ours above it, and the name below that.
typedef struct Place {
    char *root;        // NULL: in none of ours
    const char *below; // in path, what follows root
    char *key;         // the same as in the list
} Place;

static void free_place(Place *place)
{
    free(place->root);
    free(place->key);
    *place = (Place){0};
}

static bool is_root(const char *dir)
{
    struct stat own, list;
    return lstat(fs_file_at("%s/" FS_OWNED_DIR, dir).text, &own) == 0 && S_ISDIR(own.st_mode) &&
           lstat(fs_file_at("%s/" LIST, dir).text, &list) == 0 && S_ISREG(list.st_mode);
}

// The list changes in one thread of one process at a time.
static pthread_mutex_t changing = PTHREAD_MUTEX_INITIALIZER;

static int lock_list(const char *root)
{
    pthread_mutex_lock(&changing);
    int fd = open(fs_file_at("%s/" FS_OWNED_DIR, root).text, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) flock(fd, LOCK_EX); // where the disk knows no locks, only this process is held off
    return fd;
}

static void unlock_list(int fd)
{
    if (fd >= 0) close(fd);
    pthread_mutex_unlock(&changing);
}

// One spelling for a name, on one line. checkpoint.new and .old are the checkpoint before and after its time.
static char *key_of(const char *name)
{
    char *key = malloc(2 * strlen(name) + 2), *to = key;
    for (const char *p = name; key && *p;) {
        size_t n = strcspn(p, "/");
        if (n && !(n == 1 && *p == '.')) {
            if (to > key) *to++ = '/';
            for (size_t i = 0; i < n; i++) {
                if (p[i] == '\n' || p[i] == '\\') *to++ = '\\';
                *to++ = p[i] == '\n' ? 'n' : p[i];
            }
            if (p[n] && n == 14 && (!strncmp(p, "checkpoint.new", n) || !strncmp(p, "checkpoint.old", n))) to -= 4;
        }
        p += n + (p[n] == '/');
    }
    if (key) *to = 0;
    return key;
}

// Negative: out of memory, which is counted.
static int find(const char *path, bool folder, Place *place)
{
    size_t n = strlen(path);
    *place = (Place){0};
    while (n > 1 && path[n - 1] == '/') n--;
    while (n) {
        size_t name = n;
        while (name && path[name - 1] != '/') name--;
        if (n - name == 2 && strncmp(path + name, "..", 2) == 0) return 0;
        for (n = name; n > 1 && path[n - 1] == '/';) n--;
        if (!(place->root = n ? strndup(path, n) : strdup("."))) return fs_error_memory(NULL);
        if (is_root(place->root)) {
            char *below = fs_file_path("%s%s", path + name, folder ? "/" : "");
            place->key = below ? key_of(below) : NULL;
            place->below = path + name;
            free(below);
            return place->key ? 0 : fs_error_memory(NULL);
        }
        free_place(place);
        if (n == 1 && *path == '/') n = 0;
    }
    return 0;
}

static bool is_private(const Place *place)
{
    return strncmp(place->key, FS_OWNED_DIR "/", sizeof FS_OWNED_DIR) == 0;
}

// The first folder of path, from the name below on, that is a link; the caller frees. NULL: none.
static char *find_link(const char *path, const char *below)
{
    struct stat st;
    for (const char *p = below; (p = strchr(p, '/')); p++) {
        char *folder = strndup(path, (size_t)(p - path));
        if (folder ? lstat(folder, &st) == 0 && S_ISLNK(st.st_mode) : fs_error_memory(NULL)) return folder;
        free(folder);
    }
    return NULL;
}

static char *line_of(const char *path, const char *key)
{
    uint64_t hash = FS_HASH_EMPTY, size;
    if (fs_hash_file(path, false, &hash, &size) < 0) return NULL;
    return fs_file_path("\n%016" PRIx64 " %" PRIu64 " %s\n", hash, size, key);
}

static bool read_list(const char *root, char **list)
{
    size_t size;
    bool read = fs_file_read(fs_file_at("%s/" LIST, root).text, MAX_LIST, list, &size, NULL) == 0;
    for (size_t i = 0; read && i < size; i++)
        if (!(*list)[i]) (*list)[i] = '\n'; // of a crash
    return read;
}

static bool is_listed(const Place *place, const char *path)
{
    char *line = line_of(path, place->key), *list = NULL;
    bool yes = line && read_list(place->root, &list) && strstr(list, line);
    free(line);
    free(list);
    return yes;
}

// Outside our folders the file itself says what we wrote. A disk without such marks leaves all files to the user.
static void mark(const char *made)
{
    char *line = line_of(made, "");
    if (line) lsetxattr(made, MARK, line, strlen(line), 0);
    free(line);
}

static bool is_marked(const char *path)
{
    char was[64];
    ssize_t n = lgetxattr(path, MARK, was, sizeof was);
    char *now = n > 0 ? line_of(path, "") : NULL;
    bool yes = now && strlen(now) == (size_t)n && memcmp(was, now, (size_t)n) == 0;
    free(now);
    return yes;
}

bool fs_owned_is_result(const char *path)
{
    Place place;
    bool yes = find(path, false, &place) == 0 && place.root && !strchr(place.key, '/') && is_listed(&place, path);
    free_place(&place);
    return yes;
}

static int check(const Place *place, const char *path, FsError *err)
{
    struct stat st;
    char *linked = place->root && !is_private(place) ? find_link(path, place->below) : NULL;
    int rc = 0;
    if (linked)
        rc = fs_error_input(err, "%s: is a link; results are not written through links: remove it", linked);
    else if (lstat(path, &st) != 0)
        rc = errno == ENOTDIR ? fs_error_input(err, "%s: a file is where a folder must be", path) : 0;
    else if (place->root ? !is_private(place) && !is_listed(place, path) : !is_marked(path))
        rc = fs_error_input(
            err,
            "%s: is in the way: it is not as flashsplat wrote it, if it did; move it, or let the results go elsewhere",
            path);
    free(linked);
    return rc;
}

int fs_owned_check(const char *path, FsError *err)
{
    Place place;
    int rc = find(path, false, &place) < 0 ? fs_error_memory(err) : check(&place, path, err);
    free_place(&place);
    return rc;
}

int fs_owned_check_single(const char *path, const char *command, FsError *err)
{
    char by[16];
    struct stat st;
    MUST(fs_owned_check(path, err));
    ssize_t n = lgetxattr(path, SIGNATURE, by, sizeof by);
    if (lstat(path, &st) != 0 || (n == (ssize_t)strlen(command) && memcmp(by, command, (size_t)n) == 0)) return 0;
    return fs_error_input(err, "%s: is in the way: it is not of `flashsplat %s`; name another file", path, command);
}

void fs_owned_sign(const char *path, const char *command)
{
    lsetxattr(path, SIGNATURE, command, strlen(command), 0);
}

int fs_owned_check_tree(const char *dir, FsError *err)
{
    struct stat st;
    FileList list;
    int rc = lstat(dir, &st) != 0 ? 1 : S_ISDIR(st.st_mode) ? fs_file_list(dir, &list, err) : fs_owned_check(dir, err);
    if (rc || !S_ISDIR(st.st_mode)) return rc < 0 ? rc : 0;
    for (int i = 0; i < list.n && rc == 0; i++)
        rc = fs_owned_check_tree(fs_file_at("%s/%s", dir, list.name[i]).text, err);
    fs_file_list_free(&list);
    return rc;
}

// ---- writing ----

// A line more, unless it is there (one of a checkpoint's is for its new or old folder too, and may go with that). It
// begins with a new line: one that a full disk cut short does not spoil it.
static int append(const Place *place, const char *line, FsError *err)
{
    FilePath path = fs_file_at("%s/" LIST, place->root);
    int locked = lock_list(place->root), rc = 0;
    char *list = NULL;
    bool plain = strcmp(place->key, place->below) == 0;
    if (!plain || !read_list(place->root, &list) || !strstr(list, line)) {
        int fd = open(path.text, O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
        errno = fd < 0 ? errno : ENOSPC;
        if (fd < 0 || write(fd, line, strlen(line)) != (ssize_t)strlen(line) || fdatasync(fd) != 0)
            rc = fs_error_set(err, FS_ERR_IO, "%s: cannot write: %s", path.text, strerror(errno));
        if (fd >= 0) close(fd);
    }
    unlock_list(locked);
    free(list);
    return rc;
}

int fs_owned_record(const char *made, const char *path, FsError *err)
{
    Place place;
    char *line = NULL;
    int rc = find(path, false, &place) < 0 ? fs_error_memory(err) : 0;
    if (rc == 0 && !place.root) mark(made);
    if (rc == 0 && place.root && !is_private(&place)) {
        bool folder = fs_file_is_dir(made); // has its lines, and takes the place of nothing but an empty one
        rc = folder ? 0 : check(&place, path, err);
        if (rc == 0 && !folder) {
            line = line_of(made, place.key);
            rc = line ? append(&place, line, err) : fs_error_set(err, FS_ERR_IO, "%s: cannot read back", made);
        }
    }
    free(line);
    free_place(&place);
    return rc;
}

int fs_owned_record_dir(const char *path, FsError *err)
{
    Place place;
    int rc = find(path, true, &place) < 0 ? fs_error_memory(err) : 0;
    char *line = NULL;
    if (rc == 0 && place.root && !is_private(&place))
        rc = (line = fs_file_path("\n%016d 0 %s/\n", 0, place.key)) ? append(&place, line, err) : fs_error_memory(err);
    free(line);
    free_place(&place);
    return rc;
}

static bool same_disk(const char *root, const char *path)
{
    struct stat a, b;
    FilePath folder = fs_file_at("%.*s.", (int)(fs_file_name(path) - path), path);
    return stat(root, &a) == 0 && stat(folder.text, &b) == 0 && a.st_dev == b.st_dev;
}

// "PID-TIME-": the number of a process alone may come again, as it does in containers.
static FilePath process_name(void)
{
    static _Atomic int64_t began;
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    int64_t none = 0;
    atomic_compare_exchange_strong(&began, &none, (int64_t)now.tv_sec * 1000000000 + now.tv_nsec);
    return fs_file_at("%ld-%" PRIx64 "-", (long)getpid(), (uint64_t)atomic_load(&began));
}

char *fs_owned_temp(const char *path)
{
    static atomic_int number;
    Place place;
    char *temp = NULL;
    int n = atomic_fetch_add(&number, 1);
    if (find(path, false, &place) == 0)
        temp = place.root && same_disk(place.root, path)
                   ? fs_file_path("%s/" FS_OWNED_DIR "/%s%d", place.root, process_name().text, n)
                   : fs_file_path("%s.part%s%d", path, process_name().text, n);
    free_place(&place);
    return temp;
}

// What a process that is gone was writing when it ended.
static void sweep(const char *own)
{
    FileList list;
    FilePath mine = process_name();
    if (fs_file_list(own, &list, NULL) < 0) return;
    for (int i = 0; i < list.n; i++) {
        char *end;
        long pid = strtol(list.name[i], &end, 10);
        bool gone = pid == getpid() ? strncmp(list.name[i], mine.text, strlen(mine.text)) != 0
                                    : pid > 0 && kill((pid_t)pid, 0) != 0 && errno == ESRCH;
        if (gone && *end == '-') unlink(fs_file_at("%s/%s", own, list.name[i]).text);
    }
    fs_file_list_free(&list);
}

// A .flashsplat without list may be what a crash left on the way to one, and nothing else.
static int check_foreign(const char *own, FsError *err)
{
    struct stat st;
    FileList list = {0};
    bool there = lstat(own, &st) == 0, foreign = there && !S_ISDIR(st.st_mode);
    if (there && !foreign && fs_file_list(own, &list, NULL) < 0) foreign = true;
    for (int i = 0; i < list.n; i++)
        foreign |= strncmp(list.name[i], "made.part", 9) != 0 && strcmp(list.name[i], "lock") != 0;
    fs_file_list_free(&list);
    return foreign ? fs_error_input(err, "%s: is in the way: flashsplat did not make it; move it", own) : 0;
}

int fs_owned_check_place(const char *dir, FsError *err)
{
    if (strcmp(fs_file_whole(dir).text, "/") != 0) return 0;
    return fs_error_input(err, "%s: is the root of all folders: let the results go into a folder of their own", dir);
}

int fs_owned_open(const char *dir, const char *kind, FsError *err)
{
    MUST(fs_owned_check_place(dir, err));
    Place above = {0};
    FilePath own = fs_file_at("%s/" FS_OWNED_DIR, dir), path = fs_file_at("%s/" LIST, dir);
    char first[64], *list = NULL;
    int rc = 0;
    if (find(dir, false, &above) < 0) TRY(fs_error_memory(err));
    snprintf(first, sizeof first, "flashsplat %s\n", kind);
    bool inside = !is_root(dir) && strcmp(kind, "renders") == 0 && above.root;
    if (is_root(dir) || inside) {
        if (!read_list(inside ? above.root : dir, &list))
            rc = fs_error_input(err, "%s: cannot be read", path.text);
        else if (strncmp(list, "flashsplat ", 11) != 0 || !strchr(list, '\n'))
            rc = fs_error_input(err,
                                "%s: is damaged, so that nothing here can be told from files of yours; name another "
                                "folder, or move what you want to keep and remove %s",
                                path.text, dir);
        else if (inside ? !strncmp(list, "flashsplat capture\n", 19) : strncmp(list, first, strlen(first)) != 0)
            rc = fs_error_input(err, "%s: belongs to a %.*s that flashsplat made: name another folder", dir,
                                (int)strcspn(list, "\n") - 11, list + 11);
        else if (!inside && strcmp(kind, "project") != 0)
            sweep(own.text);
    } else {
        TRY(check_foreign(own.text, err));
        TRY(fs_file_mkdirs(own.text, err));
        TRY(fs_file_write(path.text, first, strlen(first), err));
    }
fail:
    free_place(&above);
    free(list);
    return rc;
}

bool fs_owned_lock(const char *dir, Lock *lock)
{
    if (lock->held || !is_root(dir)) return true;
    if (!fs_lock_take(lock, fs_file_at("%s/" LOCK, dir).text)) return false;
    if (lock->held) sweep(fs_file_at("%s/" FS_OWNED_DIR, dir).text);
    return true;
}

// ---- removing ----

// What a line means when place's folder or file is path; the caller frees. NULL: another, or what none of ours means.
static char *path_of(const Place *place, const char *path, const char *key)
{
    size_t n = strlen(place->key);
    if (strncmp(key, place->key, n) != 0 || (n && key[n] && key[n] != '/')) return NULL;
    char *full = fs_file_path("%s%s%s", path, n ? "" : "/", key + n), *to = full ? full + strlen(path) : NULL;
    for (const char *p = to; p && *p; p++) {
        bool escaped = *p == '\\' && p[1];
        p += escaped;
        *to++ = escaped && *p == 'n' ? '\n' : *p;
    }
    if (to) *to = 0;
    if (full && strstr(full + strlen(path), "/../")) free(full), full = NULL;
    return full;
}

// Removes what a line means. True when the line has done its duty; plain: nothing else has the same lines.
static bool remove_line(const Place *place, const char *path, const char *line, bool plain)
{
    struct stat st;
    const char *key = strchr(line, ' ');
    key = key ? strchr(key + 1, ' ') : NULL;
    char *file = key ? path_of(place, path, ++key) : NULL;
    char *linked = file ? find_link(file, file + (place->below - path)) : NULL;
    bool done = false;
    if (file && !linked && file[strlen(file) - 1] == '/') {
        done = rmdir(file) == 0;
    } else if (file && !linked) {
        char *now = line_of(file, key);
        done = now && strcspn(now + 1, "\n") == strlen(line) && strncmp(now + 1, line, strlen(line)) == 0;
        if (done) fs_file_remove(file);
        free(now);
    }
    done |= plain && file && lstat(file, &st) != 0 && errno == ENOENT;
    free(file);
    free(linked);
    return done;
}

// From the last line to the first: what a folder holds before the folder.
static void remove_listed(const Place *place, const char *path, char *list)
{
    bool plain = strcmp(place->key, place->below) == 0, changed = false; // else checkpoint.old, say
    size_t end = strlen(list), size = end + 2, kept = size;
    char *left = malloc(size);
    if (!left) fs_error_memory(NULL);
    while (left && end) {
        size_t line = end;
        list[end] = 0;
        while (line && list[line - 1] != '\n') line--;
        if (line && remove_line(place, path, list + line, plain)) {
            changed = true;
        } else if (end > line) {
            left[--kept] = '\n';
            kept -= end - line;
            memcpy(left + kept, list + line, end - line);
        }
        end = line ? line - 1 : 0;
    }
    if (changed) fs_file_write(fs_file_at("%s/" LIST, place->root).text, left + kept, size - kept, NULL);
    free(left);
}

void fs_owned_remove(const char *path)
{
    Place place;
    struct stat st;
    char *list = NULL;
    if (lstat(path, &st) != 0) return;
    bool folder = S_ISDIR(st.st_mode);
    if (find(path, folder, &place) < 0) return;
    int locked = place.root ? lock_list(place.root) : -1;
    if (place.root && is_private(&place))
        fs_file_remove_tree(path);
    else
        for (int pass = 0; pass < 1 + folder && place.root && read_list(place.root, &list); pass++) {
            remove_listed(&place, path, list); // folders whose files' lines come first go in the second pass
            free(list);
        }
    if (place.root) unlock_list(locked);
    free_place(&place);
}

static void take_mark_away(const char *dir, Lock *lock)
{
    char *list = NULL;
    FilePath own = fs_file_at("%s/" FS_OWNED_DIR, dir), path = fs_file_at("%s/" LOCK, dir);
    FileList files = {0};
    if (!is_root(dir)) return;
    int locked = lock_list(dir);
    bool unused = read_list(dir, &list) && strcspn(list, "\n") + 1 == strlen(list);
    if (unused && fs_lock_take(lock, path.text) && fs_file_list(own.text, &files, NULL) == 0 &&
        files.n == 1 + fs_file_exists(path.text)) {
        fs_file_remove(fs_file_at("%s/" LIST, dir).text);
        fs_file_remove(path.text);
        rmdir(own.text);
    }
    unlock_list(locked);
    fs_file_list_free(&files);
    free(list);
}

void fs_owned_leave(const char *dir, size_t made, Lock *lock)
{
    take_mark_away(dir, lock);
    for (size_t n = strlen(dir); made && n >= made; n--)
        if (!dir[n] || dir[n] == '/') rmdir(fs_file_at("%.*s", (int)n, dir).text); // empty ones
}
