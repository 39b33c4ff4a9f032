#include "model/pane_veil.h"

#include <math.h>

#include "base/linalg.h"

int fs_pane_veil_check(const Veil *veil, const char *path, FsError *err)
{
    const double *r = veil->right, *d = veil->down;
    bool upright = fabs(v3_dot(r, r) - 1) < 1e-3 && fabs(v3_dot(d, d) - 1) < 1e-3 && fabs(v3_dot(r, d)) < 1e-3;
    if (!upright || !(veil->cell > 0 && veil->distance > 0 && veil->unit > 0))
        return fs_error_input(err,
                              "%s: veil_right, veil_down, veil_cell, veil_distance, veil_unit: expected two directions "
                              "at right angles and lengths above 0",
                              path);
    const Image *light = &veil->light;
    if (light->channels != 1 || light->width < 2 || light->height < 2 || light->width > FS_VEIL_MOST_SIDE ||
        light->height > FS_VEIL_MOST_SIDE)
        return fs_error_input(err, "%s: the veil has %d x %d cells of %d channel(s), expected 2 to %d a side, of 1", path,
                              light->width, light->height, light->channels, FS_VEIL_MOST_SIDE);
    for (size_t i = 0; i < fs_image_values(light); i++)
        if (!(light->px[i] >= 0 && isfinite(light->px[i])))
            return fs_error_input(err, "%s: the veil's light is %g, expected at least 0", path, (double)light->px[i]);
    return 0;
}
