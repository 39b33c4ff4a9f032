#include "train/cloud_edit.h"

#include <stdlib.h>
#include <string.h>

int fs_cloud_edit_begin(Edit *edit, Cloud *cloud, FsError *err)
{
    *edit = (Edit){.cloud = cloud, .capacity = cloud->n, .from = malloc(sizeof(int) * ((size_t)cloud->n + 1))};
    if (!edit->from) return fs_error_memory(err);
    for (int i = 0; i < cloud->n; i++) edit->from[i] = i;
    return 0;
}

void fs_cloud_edit_free(Edit *edit)
{
    free(edit->from);
    *edit = (Edit){0};
}

int fs_cloud_edit_append(Edit *edit, int n, FsError *err)
{
    int old = edit->cloud->n, grown = old + n;
    if (grown > edit->capacity) {
        int capacity = grown > 2 * edit->capacity ? grown : 2 * edit->capacity;
        int *from = realloc(edit->from, sizeof(int) * (size_t)capacity);
        if (!from) return fs_error_memory(err);
        edit->from = from;
        edit->capacity = capacity;
    }
    int rc = fs_cloud_resize(edit->cloud, grown, err);
    for (int i = old; i < grown && rc == 0; i++) edit->from[i] = -1;
    return rc;
}

void fs_cloud_edit_copy(Edit *edit, int to, int from)
{
    Cloud *cloud = edit->cloud;
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        size_t w = (size_t)cloud->width[f];
        if (w) memcpy(cloud->field[f] + (size_t)to * w, cloud->field[f] + (size_t)from * w, sizeof(float) * w);
    }
}

void fs_cloud_edit_compact(Edit *edit, const unsigned char *keep)
{
    int n = 0;
    for (int i = 0; i < edit->cloud->n; i++)
        if (keep[i]) edit->from[n++] = edit->from[i];
    fs_cloud_compact(edit->cloud, keep);
}
