// Which clouds the layers in a folder of renders show: <dir>/rendered_from.json has a hash of OUT/clouds as they were.
// Layers of two trainings in one folder would be taken for one result; times do not tell, copies have others.
#pragma once

#include "base/file.h"
#include "model/project.h"

typedef enum RenderedFrom {
    RENDERED_FROM_UNKNOWN, // nothing says it, as earlier versions and other programs left folders; or there are no
                           // clouds
    RENDERED_FROM_THESE,
    RENDERED_FROM_OTHERS
} RenderedFrom;

FilePath fs_rendered_from_path(const char *dir);
RenderedFrom fs_rendered_from_ask(const FsProject *project, const char *dir); // whether they are the project's now
// metres_per_unit: of the depths there, 0 where it is not known.
int fs_rendered_from_write(const FsProject *project, const char *dir, double metres_per_unit, FsError *err);
double fs_rendered_from_scale(const char *dir); // as it was written; 0: not known
