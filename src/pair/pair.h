// The classic of a tripod: gamma(flash photo - no-flash photo), what the flash alone lit behind the glass.
#pragma once

#include "base/log.h"
#include "model/settings.h"

// Writes `out` (PNG, value = linear^0.22 * 255, white-balanced camera RGB of the flash photo's exposure, 1.0 = sensor
// white) and with the setting "linear" the unclamped difference as 32-bit float TIFF beside it.
int fs_pair_run(const char *flash, const char *noflash, const char *out, const FsSettings *settings, const Log *log,
                FsError *err);
