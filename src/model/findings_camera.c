// What is wrong with how the camera was set: body, lens, zoom, focus, exposure that are not the same for all photos.
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "model/findings_parts.h"

#define OTHER_FOCAL 0.015     // share
#define OTHER_FILM_FOCAL 0.05 // of what is told in whole millimetres
#define OTHER_FOCUS 0.01      // of the picture's size
#define OTHER_EXPOSURE 0.02

// The value most photos have, within a share; 0: unknown.
static double commonest(const double *value, int n, double share)
{
    double best = 0;
    int most = 0;
    for (int i = 0; i < n; i++) {
        int same = 0;
        for (int k = 0; k < n && value[i] > 0; k++) same += fabs(value[k] / value[i] - 1) < share;
        if (same > most) most = same, best = value[i];
    }
    return best;
}

// Those unlike most by such a share; the last of them, -1: none. 0 is unknown.
static int mark_odd(const double *value, int n, double share, bool *marked, double *usual)
{
    int last = -1;
    *usual = commonest(value, n, share);
    for (int i = 0; i < n; i++) {
        marked[i] = value[i] > 0 && fabs(value[i] / *usual - 1) >= share;
        if (marked[i]) last = i;
    }
    return last;
}

// Of another focal length. of_film: its equivalent, which tells of a digital zoom, too.
static int mark_zoom(const Photos *photos, bool of_film, double *value, bool *marked, double *usual)
{
    for (int i = 0; i < photos->n; i++)
        value[i] = of_film ? photos->photo[i].exif.focal_35mm : photos->photo[i].exif.focal_mm;
    return mark_odd(value, photos->n, of_film ? OTHER_FILM_FOCAL : OTHER_FOCAL, marked, usual);
}

void fs_findings_camera_zoomed(const Photos *photos, double *focal, bool *marked)
{
    double usual;
    if (mark_zoom(photos, false, focal, marked, &usual) < 0) mark_zoom(photos, true, focal, marked, &usual);
}

static bool same_body(const ExifInfo *a, const ExifInfo *b)
{
    return strcmp(a->model, b->model) == 0 && strcmp(a->make, b->make) == 0;
}

static bool same_lens(const ExifInfo *a, const ExifInfo *b)
{
    return strcmp(a->lens, b->lens) == 0;
}

// Marks the photos that tell their `name` and are not the same as most; one of them, NULL: none.
static const ExifInfo *mark_other(const Photos *photos, size_t name, bool (*same)(const ExifInfo *, const ExifInfo *),
                                  bool *marked, const ExifInfo **usual)
{
    const ExifInfo *odd = NULL;
    int most = 0;
    for (int i = 0; i < photos->n; i++) {
        const ExifInfo *e = &photos->photo[i].exif;
        int alike = 0;
        for (int k = 0; k < photos->n && ((const char *)e)[name]; k++) alike += same(&photos->photo[k].exif, e);
        if (alike > most) most = alike, *usual = e;
    }
    for (int i = 0; i < photos->n; i++) {
        const ExifInfo *e = &photos->photo[i].exif;
        marked[i] = ((const char *)e)[name] && !same(e, *usual);
        if (marked[i]) odd = e;
    }
    return odd;
}

static void find_body(Findings *f, const Photos *photos, bool *marked)
{
    char text[200];
    const ExifInfo *usual = NULL, *odd = mark_other(photos, offsetof(ExifInfo, model), same_body, marked, &usual);
    if (odd)
        fs_findings_add(f, "body", FINDING_DOUBT,
                        "another camera: %s (%s, the others %s): its colours and its lens are others; use one camera",
                        fs_findings_names(photos, marked, text), odd->model, usual->model);
}

// Of one camera and one focal length: else another lens is no news.
static void find_lens(Findings *f, const Photos *photos, bool *marked)
{
    char text[200];
    for (int i = 0; i < f->n; i++)
        if (strcmp(f->finding[i].kind, "body") == 0 || strcmp(f->finding[i].kind, "zoom") == 0) return;
    const ExifInfo *usual = NULL, *odd = mark_other(photos, offsetof(ExifInfo, lens), same_lens, marked, &usual);
    if (odd)
        fs_findings_add(
            f, "lens", FINDING_DOUBT,
            "another lens: %s (%s, the others %s): it bends and darkens the picture in its own way; use one lens",
            fs_findings_names(photos, marked, text), odd->lens, usual->lens);
}

static void find_zoom(Findings *f, const Photos *photos, double *value, bool *marked)
{
    char text[200];
    int n = photos->n;
    double usual;
    for (int of_film = 0; of_film < 2; of_film++) {
        int last = mark_zoom(photos, of_film, value, marked, &usual);
        if (last < 0) continue;
        fs_findings_add(
            f, "zoom", FINDING_DOUBT,
            "another focal length: %s (%.4g mm%s, the others %.4g mm): one for all is surer; retake them or "
            "leave them out",
            fs_findings_names(photos, marked, text), value[last], of_film ? " on 35 mm film" : "", usual);
        break;
    }
    for (int i = 0; i < n; i++) {
        const ExifInfo *e = &photos->photo[i].exif;
        value[i] = e->width > e->height ? e->width + 1e-5 * e->height : e->height + 1e-5 * e->width;
    }
    usual = commonest(value, n, 1e-9);
    for (int i = 0; i < n; i++) marked[i] = value[i] > 0 && fabs(value[i] - usual) > 1e-7;
    if (fs_findings_count(marked, n))
        fs_findings_add(f, "size", FINDING_DOUBT, "another size: %s: use one camera, one lens and one format",
                        fs_findings_names(photos, marked, text));
}

// Focused nearer, a lens stands farther from the sensor, and all is larger.
static void find_focus(Findings *f, const Photos *photos, double *value, bool *marked)
{
    char text[200];
    double usual;
    for (int i = 0; i < photos->n; i++) {
        const ExifInfo *e = &photos->photo[i].exif;
        bool known = e->focal_mm > 0 && 1000 * e->focus_m > 2 * e->focal_mm;
        value[i] = known ? 1 / (1 - e->focal_mm / (1000 * e->focus_m)) : 0;
    }
    int last = mark_odd(value, photos->n, OTHER_FOCUS, marked, &usual);
    if (last >= 0)
        fs_findings_add(f, "focus", FINDING_DOUBT,
                        "another focus distance: %s (%.2g m: the picture is %.1f %% %s): focus by hand, once for all",
                        fs_findings_names(photos, marked, text), photos->photo[last].exif.focus_m,
                        100 * fabs(value[last] / usual - 1), value[last] > usual ? "larger" : "smaller");
}

static void find_exposure(Findings *f, const Photos *photos, double *value, bool *marked)
{
    static const char *const what[] = {"shutter time", "ISO", "aperture"};
    char text[200], shutter[24];
    int n = photos->n;
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < n; i++) {
            const ExifInfo *e = &photos->photo[i].exif;
            value[i] = k == 0 ? e->exposure_s : k == 1 ? e->iso : e->f_number;
        }
        double usual;
        if (mark_odd(value, n, OTHER_EXPOSURE, marked, &usual) < 0) continue;
        if (k == 0)
            fs_exif_shutter_text(usual, shutter);
        else
            snprintf(shutter, sizeof shutter, k == 1 ? "ISO %.0f" : "f/%.3g", usual);
        fs_findings_add(f, "exposure", FINDING_DOUBT, "another %s than %s: %s: set it by hand, the same for all",
                        what[k], shutter, fs_findings_names(photos, marked, text));
    }
}

void fs_findings_camera(Findings *f, const Photos *photos, double *value, bool *marked)
{
    find_body(f, photos, marked);
    find_zoom(f, photos, value, marked);
    find_lens(f, photos, marked);
    find_focus(f, photos, value, marked);
    find_exposure(f, photos, value, marked);
}
