#include "view/view.h"

#include <limits.h>
#include <stdlib.h>

#include "base/file.h"
#include "base/process.h"
#include "view/serve.h"

static bool has_display(void)
{
    const char *x = getenv("DISPLAY"), *wayland = getenv("WAYLAND_DISPLAY");
    return (x && *x) || (wayland && *wayland);
}

// Where there is a display and a program that knows what to open pages with; else the person does.
static void open_in_browser(const char *address, const Log *log)
{
    const char *const argv[] = {"xdg-open", address, NULL};
    fs_log_info(log, "%s", address);
    if (!has_display() || !fs_process_found(argv[0])) return;
    if (fs_process_leave(argv, NULL)) fs_log_warn(log, "xdg-open found no browser; open the page named above in one");
}

int fs_view_run(const char *out, const Settings *set, const Log *log, FsError *err)
{
    char whole[PATH_MAX];
    FilePath index = fs_file_at("%s/index.html", out);
    if (!fs_file_exists(index.text) || !realpath(index.text, whole))
        return fs_error_input(err, "%s: no page there; make it with: flashsplat run PHOTOS -o %s", index.text, out);
    if (!set->serve) {
        open_in_browser(whole, log);
        return 0;
    }
    Server server = {.socket = -1};
    int rc;
    TRY(fs_serve_open(&server, out, set->port, err));
    open_in_browser(fs_file_at("http://127.0.0.1:%d/", server.port).text, log);
    fs_log_info(log, "serving %s to this machine only, until Ctrl-C", out);
    fs_serve_until_cancelled(&server, log);
fail:
    fs_serve_close(&server);
    return rc;
}
