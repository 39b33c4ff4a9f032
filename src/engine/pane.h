// The pane as a camera sees it (kernels/pane.h).
#ifndef FS_ENGINE_PANE_H
#define FS_ENGINE_PANE_H

#include "kernels/pane.h"
#include "model/camera.h"
#include "model/scene.h"

PaneView fs_pane_view(const Pane *pane, const Camera *camera);

#endif
