// Opens a project's page in the browser; with the setting serve: over HTTP, from this machine to this machine only.
#pragma once

#include "base/log.h"
#include "model/settings.h"

int fs_view_run(const char *out, const Settings *set, const Log *log, FsError *err);
