#include "model/cost.h"

#include <math.h>
#include <unistd.h>

int fs_cost_check(const RunSize *size, double bytes, FsError *err)
{
    double machine = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGESIZE);
    if (bytes < 0.9 * machine) return 0;
    int long_edge = size->width > size->height ? size->width : size->height;
    return fs_error_set(
        err, FS_ERR_INPUT,
        "%d photos at %d pixels need about %.1f GB of memory, this machine has %.1f: run again with a smaller "
        "--long-edge (%d), fewer photos, or a smaller --max-splats",
        size->photos, long_edge, bytes / 1e9, machine / 1e9,
        (int)fmax(long_edge * sqrt(0.8 * machine / bytes), 100) / 10 * 10);
}
