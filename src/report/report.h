// The report stage: the page a person opens at the end, OUT/index.html with its pictures in OUT/report.
#pragma once

#include "model/project.h"

// Shows what is there: needs OUT/views.json; renders, films, exports, figures and the training log are shown where
// their stages have run. The page asks nothing of the network.
int fs_report_run(FsProject *project, FsError *err);
