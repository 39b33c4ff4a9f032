#include "model/ply_header.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"

#define MAX_LINE 512
#define MAX_LINES 1000

static PlyType type_of(const char *name)
{
    static const char *const names[][2] = {
        [PLY_I8] = {"char", "int8"},      [PLY_U8] = {"uchar", "uint8"},    [PLY_I16] = {"short", "int16"},
        [PLY_U16] = {"ushort", "uint16"}, [PLY_I32] = {"int", "int32"},     [PLY_U32] = {"uint", "uint32"},
        [PLY_F32] = {"float", "float32"}, [PLY_F64] = {"double", "float64"}};
    for (int t = PLY_I8; t <= PLY_F64; t++)
        if (strcmp(names[t][0], name) == 0 || strcmp(names[t][1], name) == 0) return (PlyType)t;
    return PLY_NONE;
}

size_t fs_ply_header_bytes(PlyType type)
{
    static const size_t bytes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
    return bytes[type];
}

static void add_property(PlyElement *element, const char *type, const char *name)
{
    size_t used = strlen(element->properties), bytes = fs_ply_header_bytes(type_of(type));
    snprintf(element->properties + used, sizeof element->properties - used, "%s%s", used ? " " : "", name);
    if (element->n_properties < PLY_PROPERTIES) {
        PlyProperty *property = &element->property[element->n_properties];
        *property = (PlyProperty){.type = type_of(type), .offset = element->bytes};
        snprintf(property->name, sizeof property->name, "%.31s", name);
    }
    element->bytes = bytes && (element->bytes || element->n_properties == 0) ? element->bytes + bytes : 0;
    element->n_properties++;
}

static int bad(const char *path, const char *what, FsError *err)
{
    return fs_error_input(err, "%s: not a PLY: %s", path, what);
}

// One header line; 1 at end_header.
static int read_line(const char *path, const char *line, PlyHeader *ply, FsError *err)
{
    char word[64] = "", a[64] = "", b[64] = "", c[64] = "", d[64] = "";
    PlyElement *last = ply->n ? &ply->element[ply->n - 1] : NULL;
    sscanf(line, "%63s %63s %63s %63s %63s", word, a, b, c, d);
    if (strcmp(word, "end_header") == 0) return 1;
    if (strcmp(word, "format") == 0) {
        snprintf(ply->format, sizeof ply->format, "%s", a);
    } else if (strcmp(word, "element") == 0) {
        if (ply->n == PLY_ELEMENTS) return bad(path, "too many elements", err);
        char *end;
        long long count = strtoll(b, &end, 10);
        if (!*b || *end || count < 0) return bad(path, "an element without a count", err);
        last = &ply->element[ply->n++];
        snprintf(last->name, sizeof last->name, "%s", a);
        last->count = count;
    } else if (strcmp(word, "property") == 0) {
        if (!last) return bad(path, "a property before any element", err);
        bool list = strcmp(a, "list") == 0;
        add_property(last, list ? "list" : a, list ? d : b);
    } else if (*word && strcmp(word, "comment") != 0 && strcmp(word, "obj_info") != 0) {
        return bad(path, "an unknown line in its header", err);
    }
    return 0;
}

int fs_ply_header_read(const char *path, PlyHeader *ply, FsError *err)
{
    *ply = (PlyHeader){0};
    FILE *f;
    MUST(fs_file_open(path, &f, err));
    char line[MAX_LINE];
    int rc = 0;
    if (!fgets(line, sizeof line, f) || strncmp(line, "ply", 3) != 0 || !strchr("\r\n", line[3]))
        rc = bad(path, "it does not begin with the word ply", err);
    for (int i = 0; rc == 0; i++) {
        if (i == MAX_LINES || !fgets(line, sizeof line, f) || !strchr(line, '\n'))
            rc = bad(path, "its header has no end", err);
        else
            rc = read_line(path, line, ply, err);
    }
    ply->bytes = ftell(f);
    fclose(f);
    return rc < 0 ? rc : 0;
}
