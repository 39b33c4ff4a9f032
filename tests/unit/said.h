// What the program says, kept for the tests that look for it.
#ifndef TESTS_SAID_H
#define TESTS_SAID_H

#include <stdio.h>
#include <string.h>

#include "base/log.h"

static char said[1 << 16]; // a line each message, "W " before warnings
static char warned[4000];  // the warnings alone

static inline void said_forget(void)
{
    said[0] = warned[0] = 0;
}

static inline void said_keep(void *user, FsLogLevel level, const char *message) // for FsCallbacks.log, Log.log
{
    (void)user;
    size_t n = strlen(said);
    if (level == FS_LOG_DEBUG) return;
    snprintf(said + n, sizeof said - n, "%s%s\n", level == FS_LOG_WARN ? "W " : "", message);
    if (level == FS_LOG_WARN) strncat(warned, message, sizeof warned - strlen(warned) - 1);
}

#endif
