// A look at a folder of photos while one can still go back: a line for each, then what to do.
#pragma once

#include "base/error.h"
#include "base/log.h"

// 0: good; FS_DOUBTS: usable with doubts; FS_ERR_INPUT: not usable. The lines go out through the log.
int fs_check_run(const char *folder, const FsSettings *settings, const Log *log, FsError *err);
