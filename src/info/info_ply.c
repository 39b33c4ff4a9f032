// Describes a PLY of any maker from its header, and checks that the file is as long as the header says.
#include "info/info.h"

#include <string.h>
#include <sys/stat.h>

#include "base/file.h"
#include "model/ply_header.h"

int fs_info_ply_count(const char *path)
{
    PlyHeader ply;
    if (!fs_file_exists(path) || fs_ply_header_read(path, &ply, NULL) < 0) return -1;
    for (int i = 0; i < ply.n; i++)
        if (strcmp(ply.element[i].name, "vertex") == 0 && ply.element[i].count <= 1000000000)
            return (int)ply.element[i].count;
    return -1;
}

int fs_info_ply(const char *path, const Log *log, FsError *err)
{
    PlyHeader ply;
    struct stat st;
    MUST(fs_ply_header_read(path, &ply, err));
    if (stat(path, &st) != 0) return fs_error_input(err, "%s: cannot read", path);
    char size[32];
    fs_info_size((double)st.st_size, size, sizeof size);
    fs_log_info(log, "%s: PLY, %s, %s", path, ply.format, size);
    double expected = (double)ply.bytes;
    bool known = strncmp(ply.format, "binary", 6) == 0;
    for (int i = 0; i < ply.n; i++) {
        const PlyElement *e = &ply.element[i];
        fs_log_info(log, "  %lld of %s: %s", e->count, e->name, e->properties);
        if (e->count > 0 && e->bytes == 0) known = false;
        expected += (double)e->count * (double)e->bytes;
    }
    if (known && expected != (double)st.st_size)
        return fs_error_input(err, "%s: %lld bytes, but its header promises %.0f: cut short or damaged", path,
                              (long long)st.st_size, expected);
    return 0;
}
