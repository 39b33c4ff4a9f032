// `flashsplat bench`: times the kernels and the training step on generated input, as shares of this machine's peak.
#pragma once

#include "base/error.h"
#include "base/log.h"
#include "model/settings.h"

// Settings: cpu, threads, cases (only those whose name contains it), json, compare (two files of --json instead).
int fs_bench_run(const FsSettings *settings, const Log *log, FsError *err);
