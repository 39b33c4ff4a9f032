#include "export/mesh.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/groups.h"

void fs_mesh_free(Mesh *mesh)
{
    free(mesh->xyz);
    free(mesh->rgb);
    free(mesh->corner);
    *mesh = (Mesh){0};
}

// ---- pieces ----

// Keeps the triangles of pieces with enough of them; size: of the piece whose first vertex it is.
static void keep_large(Mesh *mesh, int *parent, const int *size, double least)
{
    int kept = 0;
    for (int t = 0; t < mesh->triangles; t++) {
        const uint32_t *corner = mesh->corner + 3 * (size_t)t;
        if ((double)size[fs_group_of(parent, (int)corner[0])] < least) continue;
        memmove(mesh->corner + 3 * (size_t)kept++, corner, 3 * sizeof *corner);
    }
    mesh->triangles = kept;
}

// Drops the vertices that no triangle has; index: scratch (N).
static void drop_unused(Mesh *mesh, int *index)
{
    int kept = 0;
    memset(index, 0, sizeof *index * (size_t)mesh->n);
    for (size_t c = 0; c < 3 * (size_t)mesh->triangles; c++) index[mesh->corner[c]] = 1;
    for (size_t v = 0; v < (size_t)mesh->n; v++) {
        if (!index[v]) continue;
        memmove(mesh->xyz + 3 * (size_t)kept, mesh->xyz + 3 * v, 3 * sizeof(float));
        memmove(mesh->rgb + 3 * (size_t)kept, mesh->rgb + 3 * v, 3);
        index[v] = kept++;
    }
    for (size_t c = 0; c < 3 * (size_t)mesh->triangles; c++) mesh->corner[c] = (uint32_t)index[mesh->corner[c]];
    mesh->n = kept;
}

int fs_mesh_drop_pieces(Mesh *mesh, double share, FsError *err)
{
    int *parent = malloc(sizeof *parent * ((size_t)mesh->n + 1));
    int *size = calloc((size_t)mesh->n + 1, sizeof *size), rc = 0;
    if (!parent || !size) TRY(fs_error_memory(err));
    for (int v = 0; v < mesh->n; v++) parent[v] = v;
    for (size_t t = 0; t < (size_t)mesh->triangles; t++)
        for (size_t k = 1; k < 3; k++) fs_group_join(parent, (int)mesh->corner[3 * t], (int)mesh->corner[3 * t + k]);
    for (size_t t = 0; t < (size_t)mesh->triangles; t++) size[fs_group_of(parent, (int)mesh->corner[3 * t])]++;
    keep_large(mesh, parent, size, share * mesh->triangles);
    drop_unused(mesh, parent);
fail:
    free(parent);
    free(size);
    return rc;
}

// ---- file ----

int fs_mesh_write(const Mesh *mesh, const char *path, FsError *err)
{
    AtomicFile file;
    MUST(fs_file_begin(&file, path, err));
    fprintf(file.f,
            "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
            "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face %d\n"
            "property list uchar int vertex_indices\nend_header\n",
            mesh->n, mesh->triangles);
    for (size_t v = 0; v < (size_t)mesh->n; v++) {
        fwrite(mesh->xyz + 3 * v, sizeof(float), 3, file.f);
        fwrite(mesh->rgb + 3 * v, 1, 3, file.f);
    }
    for (size_t t = 0; t < (size_t)mesh->triangles; t++) {
        fputc(3, file.f);
        fwrite(mesh->corner + 3 * t, sizeof *mesh->corner, 3, file.f);
    }
    return fs_file_commit(&file, err);
}
