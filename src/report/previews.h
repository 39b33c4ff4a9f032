// The page's pictures: a handful of views, each as photo and layers, small JPEGs in OUT/report.
#ifndef FS_REPORT_PREVIEWS_H
#define FS_REPORT_PREVIEWS_H

#include "model/dataset.h"
#include "model/layers.h"
#include "model/project.h"

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
} PreviewSet;

// Pictures whose sources are missing are left out; one that cannot be read is left out with a warning.
int fs_previews_write(const FsProject *project, const Dataset *dataset, PreviewSet *set, FsError *err);

#endif
