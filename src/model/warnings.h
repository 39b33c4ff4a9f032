// Warnings outlive the run that gave them: each goes on to the caller's log and into OUT/warnings/<stage>.txt, one line
// each and each line once, for the report. A stage that starts anew begins with none (fs_project_done sees to it).
#pragma once

#include "base/log.h"

typedef struct Warnings Warnings;

// *log becomes a log that passes everything on to callbacks (may be NULL) and keeps the warnings.
int fs_warnings_new(Warnings **warnings, const char *out, const FsCallbacks *callbacks, Log *log, FsError *err);
void fs_warnings_free(Warnings *warnings); // accepts NULL
// Whose warnings come now: a name that outlives the call; NULL: nobody's, they are not kept.
void fs_warnings_stage(Warnings *warnings, const char *stage);

void fs_warnings_forget(const char *out, const char *stage);
// The kept warnings of all stages in the order of the stages, lines of text; the caller frees. NULL when there are
// none.
char *fs_warnings_read(const char *out);
