// The page while a run is under way: what stands in OUT/index.html until the report takes its place.
#include "report/report.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "base/file.h"
#include "base/owned.h"
#include "model/dataset.h"
#include "report/page.h"

#define BETWEEN 4  // seconds, of pages; they reload as often
#define SILENT 180 // seconds without a page: the run has ended or is stuck

struct ReportLive {
    FsProject *project;
    FsCallbacks to; // what the project's log was
    double last;    // when the page was written
    bool there;     // a page was
    char stage[16]; // at work
    double stage_begin;
    int64_t first, done, total; // of the stage
    char text[400];
};

// ---- the page ----

static void write_stages(FILE *f, const ReportLive *live)
{
    int at = -1;
    for (int i = 0; i < PROJECT_STAGES; i++)
        if (strcmp(fs_project_stages[i].name, live->stage) == 0) at = i;
    fputs("<ol class=\"stages\">", f);
    for (int i = 0; i < PROJECT_STAGES; i++) {
        if (!(live->project->planned & fs_project_stages[i].stage)) continue;
        fprintf(f, "<li class=\"%s\"%s>%s</li>",
                i < at    ? "done"
                : i == at ? "now"
                          : "later",
                i == at ? " aria-current=\"step\"" : "", fs_project_stages[i].name);
    }
    fputs("</ol>\n", f);
}

// Seconds until the stage is done, by how fast it went; negative where that cannot be told.
static double seconds_left(const ReportLive *live)
{
    double seconds = fs_clock_seconds() - live->stage_begin, worked = (double)(live->done - live->first);
    if (!(worked > 0) || live->total <= live->done || seconds < 1) return -1;
    return seconds / worked * (double)(live->total - live->done);
}

static void write_bar(FILE *f, const ReportLive *live)
{
    double left = strstr(live->text, " left") ? -1 : seconds_left(live); // where the stage knows it better
    int share = live->total > 0 ? (int)(100 * live->done / live->total) : 0;
    if (live->total > 0)
        fprintf(f,
                "<div class=\"bar\" role=\"progressbar\" aria-label=\"%s\" aria-valuenow=\"%d\"><i "
                "style=\"width:%d%%\"></i></div>\n<p><b>%lld</b> of <b>%lld</b>",
                live->stage, share, share, (long long)live->done, (long long)live->total);
    else
        fputs("<p><b>at work</b>", f);
    if (left >= 0 && left < 120)
        fprintf(f, ", about <b>%.0f seconds</b> left of it", left);
    else if (left >= 0)
        fprintf(f, ", about <b>%.0f minutes</b> left of it", left / 60);
    fs_html_put(f, "</p>\n<p class=\"small\">@</p>\n", live->text);
}

static void write_picture(FILE *f, const char *out)
{
    FilePath newest; // by step
    if (!fs_file_last(fs_file_at("%s/progress", out).text, "png", &newest)) return;
    fputs("<h2>So far</h2>\n<figure><img src=\"progress/", f);
    fs_html_url(f, fs_file_name(newest.text));
    fprintf(f,
            "\" alt=\"photo, composite and layers\"><figcaption><b>Photo, the model of it, and its layers</b>, at "
            "step %d</figcaption></figure>\n",
            atoi(fs_file_name(newest.text)));
}

static void write_charts(FILE *f, const char *out)
{
    Curve curve;
    Dataset dataset = {0};
    FilePath views = fs_file_at("%s/views.json", out);
    bool posed = fs_file_exists(views.text) && fs_dataset_read(&dataset, views.text, NULL) == 0 && dataset.n > 0;
    if (fs_charts_read_log(fs_file_at("%s/log.jsonl", out).text, &curve, NULL) < 0) curve = (Curve){0};
    fputs("<div class=\"grid live\">\n", f);
    if (curve.n > 1) {
        fputs("<figure>", f);
        fs_charts_curve(f, &curve);
        fputs("<figcaption><b>Difference to the photos</b> (L1, tone-mapped)</figcaption></figure>\n", f);
    }
    if (posed) {
        fputs("<figure>", f);
        fs_charts_cameras(f, &dataset);
        fputs("<figcaption><b>Where the photos were taken</b>, from above</figcaption></figure>\n", f);
    }
    fputs("</div>\n", f);
    fs_charts_free_curve(&curve);
    fs_dataset_free(&dataset);
}

// A run that was killed says nothing any more, and its page would be under way for ever: the page itself looks at the
// clock. A stage may be silent for a while.
static void write_heard(FILE *f)
{
    fprintf(
        f,
        "<p id=\"heard\" data-at=\"%lld\">The run is under way. This page brings itself up to date, and ends as the "
        "viewer.</p>\n<script>\n(() => {\nconst heard = document.getElementById('heard');\nconst silent = Date.now() / "
        "1000 - heard.dataset.at;\nif (silent > %d) heard.textContent = 'Nothing was heard of the run since ' + new "
        "Date(1000 * heard.dataset.at).toLocaleString() + ': it has ended, or sleeps. The same command again goes on "
        "from what is done (with --resume, from the last checkpoint of the training).';\nif (silent > %d) "
        "heard.className = 'warn';\n})();\n</script>\n",
        (long long)time(NULL), SILENT, SILENT);
}

// stopped: why; NULL while it works.
static void write_live(FILE *f, const ReportLive *live, const char *stopped)
{
    char *whole = fs_page_name(live->project->out);
    const char *name = whole ? whole : "";
    fs_page_write_head(f, name, stopped ? 0 : BETWEEN);
    if (stopped)
        fs_html_put(f,
                    "<section class=\"warn\"><h2>Stopped</h2><p>@</p><p>The same command again goes on from what is "
                    "done (with --resume, from the last checkpoint of the training).</p></section>\n",
                    stopped);
    else
        write_heard(f);
    write_stages(f, live);
    if (!stopped) write_bar(f, live);
    write_picture(f, live->project->out);
    write_charts(f, live->project->out);
    fs_page_write_warnings(f, live->project->out);
    fprintf(f, "<footer>flashsplat %s</footer>\n</main></body></html>\n", fs_version());
    free(whole);
}

// A courtesy: where it cannot be written, the run goes on without it. Only in a folder that is ours by now.
static void write_index(ReportLive *live, const char *stopped)
{
    const char *out = live->project->out;
    FilePath index = fs_file_at("%s/index.html", out);
    AtomicFile file = {0};
    if (!fs_file_is_dir(fs_file_at("%s/" FS_OWNED_DIR, out).text)) return;
    if (fs_owned_check(index.text, NULL) < 0 || fs_file_begin(&file, index.text, NULL) < 0) return;
    write_live(file.f, live, stopped);
    bool said = live->there;
    live->there = fs_file_commit(&file, NULL) == 0 || live->there;
    if (!said && live->there) fs_log_info(&live->project->log, "report: watch it in %s", index.text);
}

// ---- between the project and its log ----

static bool is_planned(const ReportLive *live, const char *stage)
{
    for (int i = 0; i < PROJECT_STAGES; i++)
        if (strcmp(fs_project_stages[i].name, stage) == 0) return live->project->planned & fs_project_stages[i].stage;
    return false;
}

static void on_log(void *user, FsLogLevel level, const char *message)
{
    const ReportLive *live = user;
    if (live->to.log) live->to.log(live->to.user, level, message);
}

static void on_progress(void *user, const FsProgress *p)
{
    ReportLive *live = user;
    double now = fs_clock_seconds();
    if (live->to.progress) live->to.progress(live->to.user, p);
    if (!is_planned(live, p->stage)) return;
    if (strcmp(live->stage, p->stage) != 0 || p->done < live->done || p->total != live->total) {
        snprintf(live->stage, sizeof live->stage, "%s", p->stage);
        live->stage_begin = now;
        live->first = p->done;
    }
    live->done = p->done;
    live->total = p->total;
    snprintf(live->text, sizeof live->text, "%s", p->text);
    if (live->there && now - live->last < BETWEEN) return;
    write_index(live, NULL);
    live->last = fs_clock_seconds();
}

static bool on_cancelled(void *user)
{
    const ReportLive *live = user;
    return live->to.cancelled && live->to.cancelled(live->to.user);
}

int fs_report_live_begin(ReportLive **result, FsProject *project, FsError *err)
{
    ReportLive *live = *result = calloc(1, sizeof *live);
    if (!live) return fs_error_memory(err);
    *live = (ReportLive){.project = project, .to = project->log};
    project->log = (Log){on_log, on_progress, on_cancelled, live};
    return 0;
}

void fs_report_live_end(ReportLive *live, const char *stopped)
{
    if (!live) return;
    if (stopped && live->there) write_index(live, stopped);
    live->project->log = live->to;
    free(live);
}
