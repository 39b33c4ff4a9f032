// What the viewer in the page shows (docs/viewer.md): report/scene.js with the clouds, the pane and the cameras, and a
// picture of each photo.
#pragma once

#include "model/preview.h"
#include "model/project.h"

#define FS_VIEWER_PHOTOS 60 // at most

typedef struct Viewer {
    bool there;                  // there is something to look around in: clouds
    int splats;                  // of all clouds, as written
    long bytes;                  // of scene.js
    int photo[FS_VIEWER_PHOTOS]; // which views have report/photo_<i + 1>.jpg, i from 0
    int photos;
} Viewer;

// Where there are no clouds: nothing, and no error. light: as of the page's other pictures.
int fs_viewer_write(const FsProject *project, const Dataset *dataset, const PreviewLight *light, Viewer *viewer,
                    FsError *err);
