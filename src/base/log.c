#include "base/log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

// Names of files may hold anything; a message is one line.
static void tame(char *line)
{
    for (char *p = line; *p; p++)
        if ((unsigned char)*p < ' ' || *p == 127) *p = strchr("\n\r\t", *p) ? ' ' : '?';
}

static void emit(const Log *log, FsLogLevel level, const char *format, va_list ap)
{
    if (!log || !log->log) return;
    char line[2000];
    vsnprintf(line, sizeof line, format, ap);
    tame(line);
    log->log(log->user, level, line);
}

#define DEFINE_LEVEL(name, level)                                                                                      \
    void name(const Log *log, const char *format, ...)                                                                 \
    {                                                                                                                  \
        va_list ap;                                                                                                    \
        va_start(ap, format);                                                                                          \
        emit(log, level, format, ap);                                                                                  \
        va_end(ap);                                                                                                    \
    }

DEFINE_LEVEL(fs_log_debug, FS_LOG_DEBUG)
DEFINE_LEVEL(fs_log_info, FS_LOG_INFO)
DEFINE_LEVEL(fs_log_warn, FS_LOG_WARN)

void fs_log_progress(const Log *log, const char *stage, int64_t done, int64_t total, const char *text)
{
    if (!log || !log->progress) return;
    char line[400];
    snprintf(line, sizeof line, "%s", text ? text : "");
    tame(line);
    log->progress(log->user, &(FsProgress){.stage = stage, .done = done, .total = total, .text = line});
}

bool fs_log_cancelled(const Log *log)
{
    return log && log->cancelled && log->cancelled(log->user);
}
