// Runs another program and waits for it.
#pragma once

#include "base/error.h"
#include "base/log.h"

// argv is NULL-terminated, argv[0] looked up in PATH; stdout and stderr are appended to log_path.
// Polls log->cancelled and then ends the program (FS_ERR_CANCELLED); where we are killed, it ends, too. Returns the
// exit status (>= 0) or a negative FsStatus when the program could not be started or died of a signal.
int fs_process_run(const char *const argv[], const char *log_path, const Log *log, FsError *err);
// Starts a program that may stay, as a browser does that was not open yet: its exit status where it ends within a few
// seconds; 0 where it does not, and it is left to itself. Its output goes nowhere.
int fs_process_leave(const char *const argv[], FsError *err);
bool fs_process_found(const char *program); // in PATH
