// Naive surface nets (Gibson 1998): where the sign changes in a cell of eight voxels, a vertex at the mean of the
// places where it changes on the cell's edges; around each edge of voxels with a change, the four cells' vertices.
#include <stdlib.h>
#include <string.h>

#include "export/mesh.h"

#define NONE UINT32_MAX

typedef struct Nets {
    const Tsdf *tsdf;
    float least; // weight of a voxel that counts
    Mesh *mesh;
    uint32_t *vertex[2]; // (size[1], size[0]) of the cells of this slice and the one before, by z & 1
} Nets;

static bool is_known(const Nets *nets, int x, int y, int z)
{
    return nets->tsdf->weight[fs_tsdf_at(nets->tsdf, x, y, z)] >= nets->least;
}

static float distance(const Nets *nets, int x, int y, int z)
{
    return nets->tsdf->distance[fs_tsdf_at(nets->tsdf, x, y, z)];
}

static int add_vertex(Mesh *mesh, const double xyz[3], FsError *err)
{
    if (mesh->n == mesh->capacity) {
        int capacity = mesh->capacity ? 2 * mesh->capacity : 4096;
        float *grown = realloc(mesh->xyz, sizeof(float) * 3 * (size_t)capacity);
        if (grown) mesh->xyz = grown;
        unsigned char *rgb = realloc(mesh->rgb, 3 * (size_t)capacity);
        if (rgb) mesh->rgb = rgb;
        if (!grown || !rgb) return fs_error_memory(err);
        mesh->capacity = capacity;
    }
    for (int a = 0; a < 3; a++) mesh->xyz[3 * (size_t)mesh->n + (size_t)a] = (float)xyz[a];
    memset(mesh->rgb + 3 * (size_t)mesh->n, 0, 3);
    mesh->n++;
    return 0;
}

static int add_triangle(Mesh *mesh, uint32_t a, uint32_t b, uint32_t c, FsError *err)
{
    if (mesh->triangles == mesh->triangle_capacity) {
        int capacity = mesh->triangle_capacity ? 2 * mesh->triangle_capacity : 4096;
        uint32_t *grown = realloc(mesh->corner, sizeof *grown * 3 * (size_t)capacity);
        if (!grown) return fs_error_memory(err);
        mesh->corner = grown;
        mesh->triangle_capacity = capacity;
    }
    uint32_t *to = mesh->corner + 3 * (size_t)mesh->triangles++;
    to[0] = a, to[1] = b, to[2] = c;
    return 0;
}

// The vertex of the cell whose least corner is x y z, in steps; false where the surface does not go through it.
static bool place_vertex(const Nets *nets, int x, int y, int z, double at[3])
{
    float corner[8];
    int crossings = 0;
    for (int k = 0; k < 8; k++) {
        int i = x + (k & 1), j = y + (k >> 1 & 1), l = z + (k >> 2);
        if (!is_known(nets, i, j, l)) return false;
        corner[k] = distance(nets, i, j, l);
    }
    at[0] = at[1] = at[2] = 0;
    for (int k = 0; k < 8; k++)
        for (int a = 0; a < 3; a++) {
            int other = k | 1 << a;
            if (other == k || (corner[k] < 0) == (corner[other] < 0)) continue;
            double share = (double)corner[k] / ((double)corner[k] - (double)corner[other]);
            for (int b = 0; b < 3; b++) at[b] += b == a ? share : (k >> b & 1);
            crossings++;
        }
    if (!crossings) return false;
    const int least[3] = {x, y, z};
    for (int a = 0; a < 3; a++) at[a] = nets->tsdf->origin[a] + nets->tsdf->step * (least[a] + at[a] / crossings);
    return true;
}

static uint32_t *cell(const Nets *nets, int x, int y, int z)
{
    return &nets->vertex[z & 1][(size_t)y * (size_t)nets->tsdf->size[0] + (size_t)x];
}

// The two triangles around the edge from voxel x y z along axis a, whose four cells have their vertices by now.
static int add_faces(const Nets *nets, const int at[3], int a, FsError *err)
{
    int b = (a + 1) % 3, c = (a + 2) % 3;
    int end[3] = {at[0] + (a == 0), at[1] + (a == 1), at[2] + (a == 2)};
    if (at[b] == 0 || at[c] == 0 || end[a] >= nets->tsdf->size[a]) return 0;
    bool outside = distance(nets, at[0], at[1], at[2]) >= 0;
    if (outside == (distance(nets, end[0], end[1], end[2]) >= 0)) return 0;
    uint32_t v[4];
    for (int k = 0; k < 4; k++) {
        int of[3] = {at[0], at[1], at[2]};
        of[b] -= k == 1 || k == 2;
        of[c] -= k >= 2;
        for (int d = 0; d < 3; d++)
            if (of[d] >= nets->tsdf->size[d] - 1) return 0;
        v[k] = *cell(nets, of[0], of[1], of[2]);
        if (v[k] == NONE) return 0;
    }
    MUST(add_triangle(nets->mesh, v[0], v[outside ? 3 : 1], v[2], err));
    return add_triangle(nets->mesh, v[0], v[2], v[outside ? 1 : 3], err);
}

static int extract_slice(const Nets *nets, int z, FsError *err)
{
    const int *size = nets->tsdf->size;
    double at[3];
    for (int y = 0; y + 1 < size[1]; y++)
        for (int x = 0; x + 1 < size[0]; x++) {
            uint32_t *vertex = cell(nets, x, y, z);
            *vertex = NONE;
            if (!place_vertex(nets, x, y, z, at)) continue;
            *vertex = (uint32_t)nets->mesh->n;
            MUST(add_vertex(nets->mesh, at, err));
        }
    for (int y = 0; y + 1 < size[1]; y++)
        for (int x = 0; x + 1 < size[0]; x++)
            for (int a = 0; a < 3; a++) {
                if (!is_known(nets, x, y, z)) continue;
                MUST(add_faces(nets, (const int[3]){x, y, z}, a, err));
            }
    return 0;
}

int fs_mesh_extract(const Tsdf *tsdf, int views, Mesh *mesh, FsError *err)
{
    *mesh = (Mesh){0};
    int rc = 0;
    size_t cells = (size_t)tsdf->size[0] * (size_t)tsdf->size[1];
    Nets nets = {.tsdf = tsdf, .least = (float)views, .mesh = mesh};
    for (int k = 0; k < 2; k++) {
        nets.vertex[k] = malloc(sizeof(uint32_t) * cells);
        if (!nets.vertex[k]) TRY(fs_error_memory(err));
        memset(nets.vertex[k], 0xff, sizeof(uint32_t) * cells);
    }
    for (int z = 0; z + 1 < tsdf->size[2]; z++) TRY(extract_slice(&nets, z, err));
fail:
    for (int k = 0; k < 2; k++) free(nets.vertex[k]);
    if (rc < 0) fs_mesh_free(mesh);
    return rc;
}
