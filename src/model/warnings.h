// Warnings outlive the run that gave them: each goes on to the caller's log and into OUT/warnings/<stage>.txt, one line
// each and each line once, for the report. A stage that starts anew begins with none, but not before all is well with
// its inputs (fs_project_done and fs_project_begin see to it).
#pragma once

#include "base/log.h"

typedef struct Warnings Warnings;

// *log becomes a log that passes everything on to callbacks (may be NULL) and keeps the warnings.
int fs_warnings_new(Warnings **warnings, const char *out, const FsCallbacks *callbacks, Log *log, FsError *err);
void fs_warnings_free(Warnings *warnings); // accepts NULL
// Whose warnings come now: a name that outlives the call; NULL: nobody's, they are not kept.
void fs_warnings_stage(Warnings *warnings, const char *stage);

// Warnings from here on are held back, until fs_warnings_settle has them take the place of the stage's earlier ones;
// where another stage comes first, they are dropped.
void fs_warnings_renew(Warnings *warnings);
void fs_warnings_settle(Warnings *warnings);
// The kept warnings of all stages in the order of the stages, lines of text; the caller frees. NULL when there are
// none.
char *fs_warnings_read(const char *out);
