// .splat: position and scale as floats, colour, opacity and rotation as bytes, no header.
#include <math.h>
#include <string.h>

#include "base/file.h"
#include "export/formats.h"

int fs_splat_write(const Splats *splats, const char *path, FsError *err)
{
    AtomicFile file;
    MUST(fs_file_begin(&file, path, err));
    for (size_t i = 0; i < (size_t)splats->n; i++) {
        unsigned char row[32];
        float scale[3];
        for (size_t a = 0; a < 3; a++) scale[a] = expf(splats->scale[3 * i + a]);
        memcpy(row, splats->mean + 3 * i, 12);
        memcpy(row + 12, scale, 12);
        for (size_t c = 0; c < 3; c++)
            row[24 + c] = (unsigned char)fs_splats_level(255.0 * (double)splats->srgb[3 * i + c], 255);
        row[27] = (unsigned char)fs_splats_level(255.0 * fs_splats_opacity(splats, i), 255);
        for (size_t a = 0; a < 4; a++)
            row[28 + a] = (unsigned char)fs_splats_level(128.0 * (double)splats->rotation[4 * i + a] + 128.0, 255);
        fwrite(row, sizeof row, 1, file.f);
    }
    return fs_file_commit(&file, err);
}
