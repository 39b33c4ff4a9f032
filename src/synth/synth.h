// Makes a capture through glass with ground truth (the program `flashsplat synth`).
#pragma once

#include "base/log.h"
#include "model/settings.h"

// Fills the folder `out` with capture/raw, capture/jpeg and truth.
int fs_synth_run(const char *out, const FsSettings *settings, const Log *log, FsError *err);
