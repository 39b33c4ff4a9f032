// The report stage: the page a person opens at the end, OUT/index.html with its pictures in OUT/report.
#pragma once

#include "model/project.h"

// Shows what is there: needs OUT/views.json; renders, films, exports, figures and the training log are shown where
// their stages have run. The page asks nothing of the network.
int fs_report_run(FsProject *project, FsError *err);

// While a run is under way: OUT/index.html says how far it is (stage, progress picture, loss curve, time left) and
// reloads itself, until fs_report_run writes the page over it. From begin to end it listens to the project's progress.
typedef struct ReportLive ReportLive;
int fs_report_live_begin(ReportLive **live, FsProject *project, FsError *err);
void fs_report_live_end(ReportLive *live, const char *stopped); // NULL, or why the run ended; accepts NULL
