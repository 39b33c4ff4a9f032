#include "base/error.h"

#include <errno.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>

static atomic_uint memory_failures;

int fs_error_set(FsError *err, int code, const char *format, ...)
{
    if (errno == ENOMEM) atomic_fetch_add(&memory_failures, 1); // "cannot open", say, though err is NULL
    if (err) {
        va_list ap;
        va_start(ap, format);
        vsnprintf(err->message, sizeof err->message, format, ap);
        va_end(ap);
        for (char *p = err->message; *p; p++) // names out of files may hold anything; an error is one line
            if ((unsigned char)*p < ' ' || *p == 127) *p = '?';
        err->code = code;
    }
    return code;
}

int fs_error_memory(FsError *err)
{
    atomic_fetch_add(&memory_failures, 1);
    return fs_error_set(err, FS_ERR_MEMORY, "out of memory: use a smaller --long-edge or fewer splats");
}

int fs_error_first(const FsError *failure, size_t n, FsError *err)
{
    size_t i = 0;
    while (i < n && failure[i].code == 0) i++;
    if (i < n && err) *err = failure[i];
    return i < n ? failure[i].code : 0;
}

int fs_error_about(int rc, const char *what, FsError *err)
{
    if (rc >= 0 || !err) return rc;
    FsError inner = *err;
    return fs_error_set(err, rc, "%s: %s", what, inner.message);
}

int fs_error_then(int rc, const char *remedy, FsError *err)
{
    if (rc != FS_ERR_INPUT || !err) return rc;
    FsError inner = *err;
    return fs_error_set(err, rc, "%s; %s", inner.message, remedy);
}

unsigned fs_error_memory_failures(void)
{
    return atomic_load(&memory_failures);
}
