// The page: its sections in the order a person reads them, its pictures, its drawings, and text into HTML.
#pragma once

#include <stdio.h>

#include "model/dataset.h"
#include "model/layers.h"
#include "model/project.h"
#include "report/viewer.h"

// ---- previews.c: a handful of views, each as photo and layers, small JPEGs in OUT/report ----

typedef enum Preview {
    PREVIEW_PHOTO,
    PREVIEW_COMPOSITE,
    PREVIEW_T_N,
    PREVIEW_T_F,
    PREVIEW_R,
    PREVIEW_DEPTH,
    PREVIEWS
} Preview;

typedef struct PreviewInfo {
    const char *key;      // of the file: report/<n>_<key>.jpg
    RenderLayer layer[2]; // the render it shows, at a view without and with flash; none for the photo
    const char *title;    // for the reader
    const char *help;
} PreviewInfo;
extern const PreviewInfo fs_previews[PREVIEWS];

#define FS_PREVIEWS_VIEWS 6
typedef struct PreviewSet {
    int view[FS_PREVIEWS_VIEWS], n;        // indices in the dataset
    bool has[FS_PREVIEWS_VIEWS][PREVIEWS]; // the picture was written
    int width, height;                     // of the first picture
    PreviewLight light;                    // of all of them
} PreviewSet;

// And report/veil.jpg, where there is dirt on the glass. Pictures whose sources are missing are left out; one that cannot be read is left out with a warning.
int fs_previews_write(const FsProject *project, const Dataset *dataset, PreviewSet *set, FsError *err);

// ---- drawings: their size and margins, pixels ----

#define CHART_WIDTH 560
#define CHART_HEIGHT 300
#define CHART_PAD 26

// ---- charts.c: SVG of where the photos were taken, and of how the training went ----

// The cameras from above their common plane, flash and no-flash, with their directions.
void fs_charts_cameras(FILE *f, const Dataset *dataset);

// The training log: points of (step, value).
typedef struct Curve {
    double (*point)[2];
    int n;
    double seconds; // at the last point
} Curve;

// OUT/log.jsonl, the photometric loss; n = 0 when there is no log. Lines that are not JSON are passed over.
int fs_charts_read_log(const char *path, Curve *curve, FsError *err);
void fs_charts_free_curve(Curve *curve);
void fs_charts_curve(FILE *f, const Curve *curve);

// ---- learned.c ----

float fs_learned_white(const char *out); // light that is white in OUT/renders (fs_scene_white)
void fs_learned_write(FILE *f, const char *out); // what OUT/clouds says of the camera; nothing where it says nothing

// ---- html.c: text, escaped ----

// Markup; each @ in it is the next argument, a text (const char *), escaped (also good inside "..." attributes).
void fs_html_put(FILE *f, const char *markup, ...);
void fs_html_url(FILE *f, const char *path); // a relative path as a link's address; '/' stays

// ---- web/: what the page is made of in a browser ----

extern const char fs_html_style[];
extern const char fs_html_script[];
extern const char fs_html_viewer[]; // markup
extern const char fs_html_viewer_script[];

// ---- page.c ----

typedef struct Page {
    const FsProject *project;
    const Dataset *dataset;
    PreviewSet previews;
    Viewer viewer;
    Curve curve;
} Page;
void fs_page_write(FILE *f, const Page *page);
char *fs_page_name(const char *out); // the folder's; NULL when out of memory
// Up to the heading. reload: seconds after which the page loads itself again, 0: never.
void fs_page_write_head(FILE *f, const char *name, int reload);
void fs_page_write_warnings(FILE *f, const char *out);
