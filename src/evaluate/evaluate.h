// The evaluation stage: renders of this project, and folders of other programs, against a truth folder.
#pragma once

#include "model/project.h"

// Writes OUT/evaluate.json (and the file of the setting "json"); the table goes to the log. Always measures anew.
int fs_evaluate_run(FsProject *project, const char *truth, FsError *err);
