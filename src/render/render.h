// The render stage: a trained scene seen from the photos' poses, from any cameras, or along a path.
#pragma once

#include "model/project.h"

// Reads OUT/clouds and OUT/views.json; writes the layers to OUT/renders (OUT/path for a path, or the setting output),
// the films to OUT/video, and OUT/sheet.png to look at.
int fs_render_run(FsProject *project, FsError *err);
