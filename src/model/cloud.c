#include "model/cloud.h"

#include <stdlib.h>
#include <string.h>

const CloudFieldInfo fs_cloud_fields[CLOUD_FIELDS] = {
    [CLOUD_MEANS] = {"means", {"x", "y", "z"}, 3},
    [CLOUD_SCALES] = {"scales", {"scale_0", "scale_1", "scale_2"}, 3},
    [CLOUD_QUATS] = {"quats", {"rot_0", "rot_1", "rot_2", "rot_3"}, 4},
    [CLOUD_OPACITIES] = {"opacities", {"opacity"}, 1},
    [CLOUD_COLORS] = {"colors", {"color_0", "color_1", "color_2"}, 3},
    [CLOUD_GAINS] = {"gains", {"gain"}, 1},
    [CLOUD_COVERS] = {"covers", {"cover"}, 1},
};

static int reserve(Cloud *cloud, int capacity, FsError *err)
{
    if (capacity <= cloud->capacity) return 0;
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        if (!cloud->width[f]) continue;
        float *grown = realloc(cloud->field[f], sizeof(float) * (size_t)cloud->width[f] * (size_t)capacity);
        if (!grown) return fs_error_memory(err);
        cloud->field[f] = grown;
    }
    cloud->capacity = capacity;
    return 0;
}

int fs_cloud_resize(Cloud *cloud, int n, FsError *err)
{
    MUST(reserve(cloud, n, err));
    for (int f = 0; f < CLOUD_FIELDS && n > cloud->n; f++)
        if (cloud->width[f])
            memset(cloud->field[f] + (size_t)cloud->n * (size_t)cloud->width[f], 0,
                   sizeof(float) * (size_t)cloud->width[f] * (size_t)(n - cloud->n));
    cloud->n = n;
    return 0;
}

int fs_cloud_new(Cloud *cloud, int n, int color_width, int gain_width, FsError *err)
{
    Cloud like = {0};
    for (int f = 0; f < CLOUD_FIELDS; f++) like.width[f] = fs_cloud_fields[f].width;
    like.width[CLOUD_COLORS] = color_width;
    like.width[CLOUD_GAINS] = gain_width;
    like.width[CLOUD_COVERS] = 0;
    return fs_cloud_new_like(cloud, &like, n, err);
}

int fs_cloud_new_like(Cloud *cloud, const Cloud *like, int n, FsError *err)
{
    *cloud = (Cloud){0};
    memcpy(cloud->width, like->width, sizeof cloud->width);
    int rc = fs_cloud_resize(cloud, n, err);
    if (rc < 0) fs_cloud_free(cloud);
    return rc;
}

int fs_cloud_covers(Cloud *cloud, bool wanted, FsError *err)
{
    if (wanted == (cloud->width[CLOUD_COVERS] > 0)) return 0;
    float *covers = wanted ? calloc((size_t)cloud->capacity + 1, sizeof *covers) : NULL;
    if (wanted && !covers) return fs_error_memory(err);
    free(cloud->field[CLOUD_COVERS]);
    cloud->field[CLOUD_COVERS] = covers;
    cloud->width[CLOUD_COVERS] = wanted;
    return 0;
}

void fs_cloud_free(Cloud *cloud)
{
    for (int f = 0; f < CLOUD_FIELDS; f++) free(cloud->field[f]);
    *cloud = (Cloud){0};
}

int fs_cloud_copy(Cloud *to, const Cloud *from, FsError *err)
{
    MUST(fs_cloud_new_like(to, from, from->n, err));
    for (int f = 0; f < CLOUD_FIELDS; f++)
        if (from->width[f] && from->n)
            memcpy(to->field[f], from->field[f], sizeof(float) * (size_t)from->width[f] * (size_t)from->n);
    return 0;
}

void fs_cloud_compact(Cloud *cloud, const unsigned char *keep)
{
    int n = 0;
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        size_t w = (size_t)cloud->width[f];
        n = 0;
        for (int i = 0; i < cloud->n; i++) {
            if (!keep[i]) continue;
            if (w && n != i)
                memcpy(cloud->field[f] + (size_t)n * w, cloud->field[f] + (size_t)i * w, sizeof(float) * w);
            n++;
        }
    }
    cloud->n = n;
}
