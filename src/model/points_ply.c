#include "model/points_ply.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "image/number.h"
#include "model/ply_header.h"

#define MAX_FILE ((size_t)8 << 30)
#define FARTHEST 1e15

// The vertices, which must come first, and where x, y and z are among their properties.
static int find_places(const char *path, const PlyHeader *ply, const PlyProperty *xyz[3], FsError *err)
{
    const PlyElement *v = &ply->element[0];
    static const char *const names[3] = {"x", "y", "z"};
    if (ply->n < 1 || strcmp(v->name, "vertex") != 0 || v->count > INT_MAX || v->n_properties > PLY_PROPERTIES ||
        v->bytes == 0)
        return fs_error_input(err, "%s: expected a PLY of points: vertices first, of numbers and no lists", path);
    for (int k = 0; k < 3; k++) {
        xyz[k] = NULL;
        for (int i = 0; i < v->n_properties; i++)
            if (strcmp(v->property[i].name, names[k]) == 0) xyz[k] = &v->property[i];
        if (!xyz[k]) return fs_error_input(err, "%s: its vertices have no %s", path, names[k]);
    }
    return 0;
}

static double number(const char *at, PlyType type, bool swapped)
{
    static const char kinds[] = {[PLY_I8] = 'i',  [PLY_U8] = 'u',  [PLY_I16] = 'i', [PLY_U16] = 'u',
                                 [PLY_I32] = 'i', [PLY_U32] = 'u', [PLY_F32] = 'f', [PLY_F64] = 'f'};
    return fs_number_read(at, kinds[type], (int)fs_ply_header_bytes(type), swapped);
}

static void keep(const double p[3], float *xyz, int *n)
{
    if (!(fabs(p[0]) < FARTHEST && fabs(p[1]) < FARTHEST && fabs(p[2]) < FARTHEST)) return;
    for (int k = 0; k < 3; k++) xyz[3 * (size_t)*n + (size_t)k] = (float)p[k];
    *n += 1;
}

static int cut_short(const char *path, FsError *err)
{
    return fs_error_input(err, "%s: holds fewer vertices than its header says: cut short or damaged", path);
}

// A line a vertex; any white space between numbers.
static int read_text(const char *path, const PlyElement *v, char *p, const PlyProperty *const at[3], float *xyz, int *n,
                     FsError *err)
{
    for (long long i = 0; i < v->count; i++) {
        double value[3] = {0};
        for (int k = 0; k < v->n_properties; k++) {
            char *end;
            double x = strtod(p, &end);
            if (end == p) return cut_short(path, err);
            p = end;
            for (int c = 0; c < 3; c++)
                if (&v->property[k] == at[c]) value[c] = x;
        }
        keep(value, xyz, n);
    }
    return 0;
}

int fs_points_ply_read(const char *path, float **xyz, int *n, FsError *err)
{
    PlyHeader ply;
    const PlyProperty *at[3];
    char *file = NULL;
    size_t size;
    int rc;
    *xyz = NULL;
    *n = 0;
    TRY(fs_ply_header_read(path, &ply, err));
    TRY(find_places(path, &ply, at, err));
    TRY(fs_file_read(path, MAX_FILE, &file, &size, err));
    const PlyElement *v = &ply.element[0];
    bool text = strcmp(ply.format, "ascii") == 0, swapped = strcmp(ply.format, "binary_big_endian") == 0;
    if (!text && !swapped && strcmp(ply.format, "binary_little_endian") != 0)
        TRY(fs_error_input(err, "%s: a PLY of format '%s', expected ascii or binary", path, ply.format));
    size_t begin = (size_t)ply.bytes, each = text ? 2 * (size_t)v->n_properties : v->bytes;
    if (begin > size || (size_t)v->count > (size - begin + text) / each) TRY(cut_short(path, err));
    *xyz = malloc(sizeof(float) * 3 * ((size_t)v->count + 1));
    if (!*xyz) TRY(fs_error_memory(err));
    if (text) {
        TRY(read_text(path, v, file + begin, at, *xyz, n, err));
        goto fail;
    }
    for (long long i = 0; i < v->count; i++) {
        double value[3];
        for (int c = 0; c < 3; c++)
            value[c] = number(file + begin + (size_t)i * v->bytes + at[c]->offset, at[c]->type, swapped);
        keep(value, *xyz, n);
    }
fail:
    free(file);
    if (rc < 0) free(*xyz), *xyz = NULL, *n = 0;
    return rc;
}
