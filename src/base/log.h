// Log lines, progress and cancellation, all through the caller's callbacks.
#pragma once

#include "flashsplat.h"

typedef FsCallbacks Log;

// log, and each of its callbacks, may be NULL: then nobody hears, and nobody has cancelled.
__attribute__((format(printf, 2, 3))) void fs_log_debug(const Log *log, const char *format, ...);
__attribute__((format(printf, 2, 3))) void fs_log_info(const Log *log, const char *format, ...);
__attribute__((format(printf, 2, 3))) void fs_log_warn(const Log *log, const char *format, ...);
void fs_log_progress(const Log *log, const char *stage, int64_t done, int64_t total,
                     const char *text); // text: may be NULL
bool fs_log_cancelled(const Log *log);
