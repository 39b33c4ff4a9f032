#include "base/file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <limits.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"
#include "base/order.h"
#include "base/owned.h"

int fs_file_open(const char *path, FILE **f, FsError *err)
{
    struct stat st;
    int rc = 0, fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    *f = NULL;
    if (fd < 0) return fs_error_input(err, "%s: cannot open: %s", path, strerror(errno));
    if (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode))
        rc = fs_error_input(err, "%s: not a regular file", path);
    else if (!(*f = fdopen(fd, "rb")))
        rc = fs_error_memory(err);
    if (rc < 0) close(fd);
    return rc;
}

int fs_file_read(const char *path, size_t max_size, char **data, size_t *size, FsError *err)
{
    *data = NULL;
    *size = 0;
    FILE *f;
    struct stat st;
    int rc = fs_file_open(path, &f, err);
    if (rc < 0) return rc;
    if (fstat(fileno(f), &st) != 0) TRY(fs_error_input(err, "%s: read failed: %s", path, strerror(errno)));
    if ((size_t)st.st_size > max_size)
        TRY(fs_error_input(err, "%s: %lld bytes, expected at most %zu", path, (long long)st.st_size, max_size));
    *data = malloc((size_t)st.st_size + 1);
    if (!*data) TRY(fs_error_memory(err));
    *size = fread(*data, 1, (size_t)st.st_size, f);
    if (ferror(f)) TRY(fs_error_input(err, "%s: read failed: %s", path, strerror(errno)));
    (*data)[*size] = 0;
fail:
    if (rc < 0) free(*data), *data = NULL;
    fclose(f);
    return rc;
}

// ---- names: folders in which a name changed since they were last synced ----

#define MAX_FOLDERS 32

static struct {
    pthread_mutex_t lock;
    int n;
    char path[MAX_FOLDERS][512];
    FsError failure; // of a folder that is no longer among them
} changed = {.lock = PTHREAD_MUTEX_INITIALIZER};

// A folder that is gone, or of a file system that cannot sync folders, is no failure.
static int sync_folder(const char *path, FsError *err)
{
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool bad = fd >= 0 && fsync(fd) != 0 && (errno == EIO || errno == ENOSPC || errno == EDQUOT);
    int rc = bad ? fs_error_set(err, FS_ERR_IO, "%s: cannot write: %s", path, strerror(errno)) : 0;
    if (fd >= 0) close(fd);
    return rc;
}

int fs_file_sync_names(FsError *err)
{
    pthread_mutex_lock(&changed.lock);
    FsError failure = changed.failure;
    for (int i = 0; i < changed.n && !failure.code; i++) sync_folder(changed.path[i], &failure);
    changed.n = 0;
    changed.failure = (FsError){0};
    pthread_mutex_unlock(&changed.lock);
    return fs_error_first(&failure, 1, err);
}

static void name_changed(const char *path)
{
    char folder[sizeof changed.path[0]];
    size_t n = (size_t)(fs_file_name(path) - path);
    if (snprintf(folder, sizeof folder, "%.*s", n ? (int)n : 1, n ? path : ".") >= (int)sizeof folder) {
        sync(); // a name too long to keep
        return;
    }
    pthread_mutex_lock(&changed.lock);
    int i = 0;
    while (i < changed.n && strcmp(changed.path[i], folder) != 0) i++;
    if (i == MAX_FOLDERS) sync_folder(changed.path[i = 0], &changed.failure);
    memcpy(changed.path[i], folder, sizeof folder);
    if (i == changed.n) changed.n++;
    pthread_mutex_unlock(&changed.lock);
}

void fs_file_remove(const char *path)
{
    if (unlink(path) == 0) name_changed(path);
}

int fs_file_rename(const char *temp, const char *path, FsError *err)
{
    int rc = fs_owned_record(temp, path, err);
    if (rc == 0 && fs_file_is_dir(temp)) rc = fs_file_sync_names(err); // what is in it comes before it
    if (rc == 0 && rename(temp, path) != 0)
        rc = fs_error_set(err, FS_ERR_IO, "%s: cannot write: %s", path, strerror(errno));
    if (rc < 0)
        unlink(temp);
    else
        name_changed(path);
    return rc;
}

// ---- files that appear whole or not at all ----

long fs_file_put(AtomicFile *file, const void *data, size_t size)
{
    size_t done = 0;
    while (done < size && !file->error) {
        ssize_t n = write(file->fd, (const char *)data + done, size - done);
        if (n > 0)
            done += (size_t)n;
        else if (n == 0 || errno != EINTR)
            file->error = n == 0 ? ENOSPC : errno;
    }
    return (long)done;
}

static ssize_t put_cookie(void *file, const char *data, size_t size)
{
    return fs_file_put(file, data, size); // less than size, 0 included, is an error to stdio
}

int fs_file_begin(AtomicFile *file, const char *path, FsError *err)
{
    *file = (AtomicFile){.fd = -1, .path = strdup(path), .temp = fs_owned_temp(path)};
    if (!file->path || !file->temp) {
        fs_file_abort(file);
        return fs_error_memory(err);
    }
    file->fd = open(file->temp, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    file->f = file->fd < 0 ? NULL : fopencookie(file, "w", (cookie_io_functions_t){.write = put_cookie});
    if (!file->f) {
        file->error = errno;
        int rc = fs_file_failed(file, "", err);
        fs_file_abort(file);
        return rc;
    }
    return 0;
}

int fs_file_failed(const AtomicFile *file, const char *why, FsError *err)
{
    if (file->error == ENOMEM) return fs_error_memory(err);
    return fs_error_set(err, FS_ERR_IO, "%s: cannot write: %s", file->path, file->error ? strerror(file->error) : why);
}

int fs_file_commit(AtomicFile *file, FsError *err)
{
    bool bad = fflush(file->f) != 0 || ferror(file->f) || file->error;
    if (!bad && fsync(file->fd) != 0 && errno != EINVAL && errno != EROFS) // no disk behind it
        bad = true, file->error = errno;
    int rc = bad ? fs_file_failed(file, "lost", err) : fs_file_rename(file->temp, file->path, err);
    fs_file_abort(file);
    return rc;
}

void fs_file_abort(AtomicFile *file)
{
    if (file->f) fclose(file->f);
    if (file->temp && file->fd >= 0) {
        close(file->fd);
        unlink(file->temp);
    }
    free(file->temp);
    free(file->path);
    *file = (AtomicFile){0};
}

int fs_file_write(const char *path, const void *data, size_t size, FsError *err)
{
    AtomicFile file;
    MUST(fs_file_begin(&file, path, err));
    fwrite(data, 1, size, file.f);
    return fs_file_commit(&file, err);
}

int fs_file_link(const char *from, const char *path, FsError *err)
{
    char *data;
    size_t size;
    MUST(fs_owned_record(from, path, err));
    unlink(path);
    if (link(from, path) == 0) {
        name_changed(path);
        return 0;
    }
    MUST(fs_file_read(from, (size_t)4 << 30, &data, &size, err));
    int rc = fs_file_write(path, data, size, err);
    free(data);
    return rc;
}

int fs_file_append(const char *path, const char *text, FsError *err)
{
    char *data = NULL;
    size_t size = 0, more = strlen(text);
    if (fs_file_exists(path)) MUST(fs_file_read(path, (size_t)1 << 30, &data, &size, err));
    char *all = realloc(data, size + more + 1);
    if (all) memcpy(all + size, text, more);
    int rc = all ? fs_file_write(path, all, size + more, err) : fs_error_memory(err);
    free(all ? all : data);
    return rc;
}

int fs_file_mkdirs(const char *path, FsError *err)
{
    char *copy = strdup(path);
    if (!copy) return fs_error_memory(err);
    int rc = 0;
    for (char *p = copy + 1;; p++) {
        if (*p != '/' && *p) continue;
        char c = *p;
        *p = 0;
        if (mkdir(copy, 0777) == 0)
            name_changed(copy), rc = fs_owned_record_dir(copy, err);
        else if (errno != EEXIST)
            rc = fs_error_set(err, FS_ERR_IO, "%s: cannot make folder: %s", copy, strerror(errno));
        *p = c;
        if (!c || rc < 0) break;
    }
    if (rc == 0 && !fs_file_is_dir(path))
        rc = fs_error_set(err, FS_ERR_IO, "%s: is %s, expected a folder", path,
                          fs_file_exists(path) ? "a file" : "a link to what is not there");
    free(copy);
    return rc;
}

size_t fs_file_missing(const char *path)
{
    if (fs_file_exists(path)) return 0;
    size_t n = 0;
    do {
        n += strspn(path + n, "/");
        n += strcspn(path + n, "/");
    } while (path[n] && fs_file_exists(fs_file_at("%.*s", (int)n, path).text));
    return n;
}

bool fs_file_exists(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0;
}

bool fs_file_is_dir(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

bool fs_file_is_read_only(const char *path)
{
    return faccessat(AT_FDCWD, path, W_OK, AT_EACCESS) != 0 && (errno == EACCES || errno == EPERM || errno == EROFS);
}

bool fs_file_is_older(const char *path, const char *than)
{
    struct stat a, b;
    if (stat(path, &a) != 0 || stat(than, &b) != 0) return false;
    return a.st_mtim.tv_sec != b.st_mtim.tv_sec ? a.st_mtim.tv_sec < b.st_mtim.tv_sec
                                                : a.st_mtim.tv_nsec < b.st_mtim.tv_nsec;
}

static int remove_one(const char *path, const struct stat *st, int type, struct FTW *ftw)
{
    (void)st, (void)type, (void)ftw;
    remove(path);
    return 0;
}

void fs_file_remove_tree(const char *path)
{
    if (nftw(path, remove_one, 16, FTW_DEPTH | FTW_PHYS) != 0 && errno == ENOMEM) fs_error_memory(NULL);
}

FilePath fs_file_at(const char *format, ...)
{
    FilePath path;
    va_list ap;
    va_start(ap, format);
    vsnprintf(path.text, sizeof path.text, format, ap);
    va_end(ap);
    return path;
}

char *fs_file_path(const char *format, ...)
{
    va_list ap;
    va_start(ap, format);
    char *s = NULL;
    if (vasprintf(&s, format, ap) < 0) s = NULL, fs_error_memory(NULL);
    va_end(ap);
    return s;
}

const char *fs_file_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

char *fs_file_stem(const char *path)
{
    char *stem = strdup(fs_file_name(path));
    if (!stem) fs_error_memory(NULL);
    char *dot = stem ? strrchr(stem, '.') : NULL;
    if (dot && dot != stem) *dot = 0;
    return stem;
}

bool fs_file_has_ext(const char *path, const char *ext)
{
    const char *dot = strrchr(fs_file_name(path), '.');
    for (size_t n; dot && *ext; ext += n + (ext[n] == ' ')) {
        n = strcspn(ext, " ");
        if (strlen(dot + 1) == n && strncasecmp(dot + 1, ext, n) == 0) return true;
    }
    return false;
}

FilePath fs_file_whole(const char *name)
{
    char there[PATH_MAX] = "";
    size_t n = strlen(name), above = n; // up to that part; before it
    if (realpath(name, there)) return fs_file_at("%s", there);
    if (errno == ENOMEM) fs_error_memory(NULL);
    for (;; n = above) {
        while (above && name[above - 1] == '/') above--;
        while (above && name[above - 1] != '/') above--;
        if (!above || fs_file_exists(fs_file_at("%.*s", (int)above, name).text)) break;
    }
    FilePath path = fs_file_at("%s%s%s", there, name[n] ? "/" : "", name + n);
    for (size_t end = strlen(path.text); end > 1 && path.text[end - 1] == '/'; end--) path.text[end - 1] = 0;
    return path;
}

int fs_file_list(const char *dir, FileList *list, FsError *err)
{
    *list = (FileList){0};
    DIR *d = opendir(dir);
    if (!d) return fs_error_input(err, "%s: cannot open folder: %s", dir, strerror(errno));
    struct dirent *e;
    while ((e = readdir(d))) {
        if (e->d_name[0] == '.') continue;
        if (fs_memory_grow(&list->name, list->n, sizeof *list->name, NULL) < 0) goto memory;
        if (!(list->name[list->n] = strdup(e->d_name))) goto memory;
        list->n++;
    }
    closedir(d);
    fs_order_named(list->name, (size_t)list->n, sizeof *list->name);
    return 0;
memory:
    closedir(d);
    fs_file_list_free(list);
    return fs_error_memory(err);
}

void fs_file_list_free(FileList *list)
{
    for (int i = 0; i < list->n; i++) free(list->name[i]);
    free(list->name);
    *list = (FileList){0};
}

bool fs_file_last(const char *dir, const char *ext, FilePath *path)
{
    FileList list;
    const char *last = NULL;
    if (fs_file_list(dir, &list, NULL) < 0) return false;
    for (int i = 0; i < list.n; i++)
        if (fs_file_has_ext(list.name[i], ext) && (!last || atoi(list.name[i]) >= atoi(last))) last = list.name[i];
    if (last) *path = fs_file_at("%s/%s", dir, last);
    fs_file_list_free(&list);
    return last;
}
