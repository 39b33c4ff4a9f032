#include "initialise/points.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

int fs_points_append(PointList *list, const float xyz[3], FsError *err)
{
    if (fs_memory_grow(&list->xyz, list->n, 3 * sizeof *list->xyz, err) < 0) return FS_ERR_MEMORY;
    memcpy(list->xyz + 3 * (size_t)list->n++, xyz, sizeof(float) * 3);
    return 0;
}

void fs_points_list_free(PointList *list)
{
    free(list->xyz);
    *list = (PointList){0};
}

int fs_points_new(SparsePoints *points, int n, FsError *err)
{
    *points = (SparsePoints){.n = n};
    size_t size = (size_t)n + 1;
    points->xyz = calloc(3 * size, sizeof *points->xyz);
    points->cue = calloc(size, sizeof *points->cue);
    points->kind = calloc(size, sizeof *points->kind);
    points->sightings = calloc(size, sizeof *points->sightings);
    if (points->xyz && points->cue && points->kind && points->sightings) return 0;
    fs_points_free(points);
    return fs_error_memory(err);
}

void fs_points_free(SparsePoints *points)
{
    free(points->xyz);
    free(points->cue);
    free(points->kind);
    free(points->sightings);
    *points = (SparsePoints){0};
}
