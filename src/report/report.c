#include "report/report.h"

#include <stdlib.h>

#include "base/file.h"
#include "report/page.h"

int fs_report_run(FsProject *project, FsError *err)
{
    char *views = fs_file_path("%s/views.json", project->out), *index = fs_file_path("%s/index.html", project->out);
    char *log = fs_file_path("%s/log.jsonl", project->out);
    Dataset dataset = {0};
    AtomicFile file = {0};
    Page page = {.project = project, .dataset = &dataset};
    int rc = 0;
    if (!views || !index || !log) TRY(fs_error_memory(err));
    TRY(fs_dataset_read(&dataset, views, err));
    if (dataset.n == 0) {
        rc = fs_error_set(err, FS_ERR_INPUT, "%s: no posed photos in it; run flashsplat poses first", views);
        goto fail;
    }
    TRY(fs_charts_read_log(log, &page.curve, err));
    TRY(fs_previews_write(project, &dataset, &page.previews, err));
    TRY(fs_file_begin(&file, index, err));
    fs_page_write(file.f, &page);
    TRY(fs_file_commit(&file, err));
    fs_log_info(&project->log, "report: open %s", index);
fail:
    fs_file_abort(&file);
    fs_charts_free_curve(&page.curve);
    fs_dataset_free(&dataset);
    free(views);
    free(index);
    free(log);
    return rc;
}
