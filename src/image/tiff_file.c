#include "image/tiff_file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int on_error(TIFF *tiff, void *user, const char *module, const char *format, va_list ap)
{
    (void)tiff, (void)module;
    TiffFile *t = user;
    if (!t->why[0]) vsnprintf(t->why, sizeof t->why, format, ap);
    return 1;
}

static int on_warning(TIFF *tiff, void *user, const char *module, const char *format, va_list ap)
{
    (void)tiff, (void)user, (void)module, (void)format, (void)ap;
    return 1;
}

static TIFFOpenOptions *new_options(TiffFile *t)
{
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc();
    if (!options) return NULL;
    TIFFOpenOptionsSetErrorHandlerExtR(options, on_error, t);
    TIFFOpenOptionsSetWarningHandlerExtR(options, on_warning, t);
    return options;
}

// ---- reading ----

int fs_tiff_file_read(TiffFile *t, const char *path, FsError *err)
{
    *t = (TiffFile){.path = path};
    TIFFOpenOptions *options = new_options(t);
    if (!options) return fs_error_memory(err);
    errno = 0;
    t->tiff = TIFFOpenExt(path, "rm", options); // m: no memory map
    TIFFOpenOptionsFree(options);
    if (errno == ENOMEM) return fs_error_memory(err); // a tag may lack; not closed, see fs_tiff_file_commit
    if (t->tiff) return 0;
    return fs_error_input(err, "%s: cannot open as TIFF: %s", path,
                          errno       ? strerror(errno)
                          : t->why[0] ? t->why
                                      : "not a TIFF file");
}

void fs_tiff_file_close(TiffFile *t)
{
    if (t->tiff) TIFFClose(t->tiff);
    t->tiff = NULL;
}

int fs_tiff_file_bad(const TiffFile *t, FsError *err)
{
    if (errno == ENOMEM) return fs_error_memory(err);
    return fs_error_input(err, "%s: bad TIFF: %s", t->path, t->why[0] ? t->why : "damaged or cut short");
}

// ---- writing ----

static tmsize_t put_back(thandle_t handle, void *data, tmsize_t size)
{
    return read(((TiffFile *)handle)->file.fd, data, (size_t)size);
}

static tmsize_t put_out(thandle_t handle, void *data, tmsize_t size)
{
    return fs_file_put(&((TiffFile *)handle)->file, data, (size_t)size);
}

static toff_t seek_to(thandle_t handle, toff_t offset, int whence)
{
    return (toff_t)lseek(((TiffFile *)handle)->file.fd, (off_t)offset, whence);
}

static toff_t size_of(thandle_t handle)
{
    struct stat st;
    return fstat(((TiffFile *)handle)->file.fd, &st) == 0 ? (toff_t)st.st_size : 0;
}

static int keep_open(thandle_t handle)
{
    (void)handle;
    return 0; // ours to close
}

int fs_tiff_file_begin(TiffFile *t, const char *path, const char *mode, FsError *err)
{
    *t = (TiffFile){.path = path};
    TIFFOpenOptions *options = NULL;
    char whole[8];
    int rc;
    TRY(fs_file_begin(&t->file, path, err));
    errno = 0;
    options = new_options(t);
    snprintf(whole, sizeof whole, "w%sm", mode);
    if (options)
        t->tiff =
            TIFFClientOpenExt(path, whole, t, put_back, put_out, seek_to, keep_open, size_of, NULL, NULL, options);
    if (!t->tiff) rc = t->file.error ? fs_file_failed(&t->file, "", err) : fs_error_memory(err);
fail:
    if (options) TIFFOpenOptionsFree(options);
    if (rc < 0) fs_file_abort(&t->file);
    return rc;
}

int fs_tiff_file_commit(TiffFile *t, bool ok, FsError *err)
{
    bool starved = errno == ENOMEM; // then libtiff 4.5 may count tags that it has no memory for: left as it is
    ok = ok && !starved;
    errno = 0;
    if (!ok) TIFFSetMode(t->tiff, O_RDONLY); // or it writes
    if (!starved) TIFFClose(t->tiff);        // may write, and has no other way to say that it failed
    t->tiff = NULL;
    if (ok && !t->why[0] && errno != ENOMEM) return fs_file_commit(&t->file, err);
    int rc = t->file.error || t->why[0] ? fs_file_failed(&t->file, t->why, err) : fs_error_memory(err);
    fs_file_abort(&t->file);
    return rc;
}
