#include "export/mesh.h"

#include <stdlib.h>
#include <string.h>

#include "base/file.h"

void fs_mesh_free(Mesh *mesh)
{
    free(mesh->xyz);
    free(mesh->rgb);
    free(mesh->corner);
    *mesh = (Mesh){0};
}

// ---- pieces ----

static uint32_t piece_of(uint32_t *parent, uint32_t v)
{
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
}

// Keeps the triangles of pieces with enough of them; size: of the piece whose first vertex it is.
static void keep_large(Mesh *mesh, uint32_t *parent, const int *size, double least)
{
    int kept = 0;
    for (int t = 0; t < mesh->triangles; t++) {
        const uint32_t *corner = mesh->corner + 3 * (size_t)t;
        if ((double)size[piece_of(parent, corner[0])] < least) continue;
        memmove(mesh->corner + 3 * (size_t)kept++, corner, 3 * sizeof *corner);
    }
    mesh->triangles = kept;
}

// Drops the vertices that no triangle has; index: scratch (N).
static void drop_unused(Mesh *mesh, uint32_t *index)
{
    uint32_t kept = 0;
    memset(index, 0, sizeof *index * (size_t)mesh->n);
    for (size_t c = 0; c < 3 * (size_t)mesh->triangles; c++) index[mesh->corner[c]] = 1;
    for (size_t v = 0; v < (size_t)mesh->n; v++) {
        if (!index[v]) continue;
        memmove(mesh->xyz + 3 * (size_t)kept, mesh->xyz + 3 * v, 3 * sizeof(float));
        memmove(mesh->rgb + 3 * (size_t)kept, mesh->rgb + 3 * v, 3);
        index[v] = kept++;
    }
    for (size_t c = 0; c < 3 * (size_t)mesh->triangles; c++) mesh->corner[c] = index[mesh->corner[c]];
    mesh->n = (int)kept;
}

int fs_mesh_drop_pieces(Mesh *mesh, double share, FsError *err)
{
    uint32_t *parent = malloc(sizeof *parent * ((size_t)mesh->n + 1));
    int *size = calloc((size_t)mesh->n + 1, sizeof *size), rc = 0;
    if (!parent || !size) TRY(fs_error_memory(err));
    for (int v = 0; v < mesh->n; v++) parent[v] = (uint32_t)v;
    for (size_t t = 0; t < (size_t)mesh->triangles; t++)
        for (int k = 1; k < 3; k++) {
            uint32_t a = piece_of(parent, mesh->corner[3 * t]), b = piece_of(parent, mesh->corner[3 * t + (size_t)k]);
            parent[a > b ? a : b] = a > b ? b : a;
        }
    for (size_t t = 0; t < (size_t)mesh->triangles; t++) size[piece_of(parent, mesh->corner[3 * t])]++;
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
