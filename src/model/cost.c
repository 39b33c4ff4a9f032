#include "model/cost.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

static double limit_in(const char *path)
{
    char text[64] = "";
    double limit = INFINITY;
    FILE *f = fopen(path, "r");
    if (f && fgets(text, sizeof text, f) && isdigit((unsigned char)*text)) limit = strtod(text, NULL); // or "max"
    if (f) fclose(f);
    return limit;
}

// Bytes that the program may have: of the machine, a container (cgroups, either version), or `ulimit -v`.
static double memory_at_most(void)
{
    struct rlimit own;
    double machine = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGESIZE);
    double of_container =
        fmin(limit_in("/sys/fs/cgroup/memory.max"), limit_in("/sys/fs/cgroup/memory/memory.limit_in_bytes"));
    bool limited = getrlimit(RLIMIT_AS, &own) == 0 && own.rlim_cur != RLIM_INFINITY;
    return fmin(fmin(machine, of_container), limited ? (double)own.rlim_cur : INFINITY);
}

int fs_cost_check(const RunSize *size, double bytes, FsError *err)
{
    double machine = memory_at_most();
    if (bytes < 0.9 * machine) return 0;
    int long_edge = size->width > size->height ? size->width : size->height;
    return fs_error_set(err, FS_ERR_INPUT,
                        "%d photos at %d pixels need about %.1f GB of memory, there are %.1f: run again with a smaller "
                        "--long-edge (%d), fewer photos, or a smaller --max-splats",
                        size->photos, long_edge, bytes / 1e9, machine / 1e9,
                        (int)fmax(long_edge * sqrt(0.8 * machine / bytes), 100) / 10 * 10);
}
