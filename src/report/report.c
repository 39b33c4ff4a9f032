#include "report/report.h"

#include "base/file.h"
#include "base/owned.h"
#include "report/page.h"

// The page that is there tells what is there, and no other can be written.
static bool stays(const FsProject *project, const char *index)
{
    return !project->worked && fs_project_is_read_only(project) && fs_owned_is_result(index);
}

int fs_report_run(FsProject *project, FsError *err)
{
    FilePath views = fs_file_at("%s/views.json", project->out), index = fs_file_at("%s/index.html", project->out);
    Dataset dataset = {0};
    AtomicFile file = {0};
    Page page = {.project = project, .dataset = &dataset};
    int rc;
    if (stays(project, index.text)) {
        fs_log_warn(&project->log, "report: %s cannot be written to: the page stays as it is", project->out);
        return 0;
    }
    TRY(fs_owned_open(project->out, "project", err));
    TRY(fs_dataset_read(&dataset, views.text, err));
    if (dataset.n == 0) TRY(fs_error_input(err, "%s: no posed photos in it; run flashsplat poses first", views.text));
    TRY(fs_charts_read_log(fs_file_at("%s/log.jsonl", project->out).text, &page.curve, err));
    TRY(fs_previews_write(project, &dataset, &page.previews, err));
    TRY(fs_viewer_write(project, &dataset, &page.previews.light, &page.viewer, err));
    TRY(fs_file_begin(&file, index.text, err));
    fs_page_write(file.f, &page);
    TRY(fs_file_commit(&file, err));
    fs_log_info(&project->log, "report: open %s", index.text);
fail:
    fs_file_abort(&file);
    fs_charts_free_curve(&page.curve);
    fs_dataset_free(&dataset);
    return rc;
}
