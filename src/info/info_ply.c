// Describes a PLY of any maker from its header, and checks that the file is as long as the header says.
#include "info/info.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/file.h"

#define MAX_LINE 512
#define MAX_LINES 1000

typedef struct Element {
    char name[64];
    long long count;
    int n_properties;
    size_t bytes; // of one, 0 when a list makes it vary
    char properties[400];
} Element;

typedef struct Ply {
    char format[64];
    Element element[8];
    int n;
    long header_bytes;
} Ply;

static size_t type_bytes(const char *type)
{
    static const struct {
        const char *name;
        size_t bytes;
    } types[] = {{"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},  {"short", 2}, {"ushort", 2},
                 {"int16", 2}, {"uint16", 2},  {"int", 4},    {"uint", 4},   {"int32", 4}, {"uint32", 4},
                 {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (strcmp(types[i].name, type) == 0) return types[i].bytes;
    return 0;
}

static void add_property(Element *element, const char *type, const char *name)
{
    size_t used = strlen(element->properties), bytes = type_bytes(type);
    snprintf(element->properties + used, sizeof element->properties - used, "%s%s", used ? " " : "", name);
    element->bytes = bytes && (element->bytes || element->n_properties == 0) ? element->bytes + bytes : 0;
    element->n_properties++;
}

static int bad(const char *path, const char *what, FsError *err)
{
    return fs_error_input(err, "%s: not a PLY: %s", path, what);
}

// One header line; 1 at end_header.
static int read_line(const char *path, const char *line, Ply *ply, FsError *err)
{
    char word[64] = "", a[64] = "", b[64] = "", c[64] = "", d[64] = "";
    Element *last = ply->n ? &ply->element[ply->n - 1] : NULL;
    sscanf(line, "%63s %63s %63s %63s %63s", word, a, b, c, d);
    if (strcmp(word, "end_header") == 0) return 1;
    if (strcmp(word, "format") == 0) {
        snprintf(ply->format, sizeof ply->format, "%s", a);
    } else if (strcmp(word, "element") == 0) {
        if (ply->n == (int)(sizeof ply->element / sizeof *ply->element)) return bad(path, "too many elements", err);
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

static int read_header(const char *path, Ply *ply, FsError *err)
{
    *ply = (Ply){0};
    FILE *f = fopen(path, "rb");
    if (!f) return fs_error_input(err, "%s: cannot open", path);
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
    ply->header_bytes = ftell(f);
    fclose(f);
    return rc < 0 ? rc : 0;
}

int fs_info_ply_count(const char *path)
{
    Ply ply;
    if (!fs_file_exists(path) || read_header(path, &ply, NULL) < 0) return -1;
    for (int i = 0; i < ply.n; i++)
        if (strcmp(ply.element[i].name, "vertex") == 0 && ply.element[i].count <= 1000000000)
            return (int)ply.element[i].count;
    return -1;
}

int fs_info_ply(const char *path, const Log *log, FsError *err)
{
    Ply ply;
    struct stat st;
    MUST(read_header(path, &ply, err));
    if (stat(path, &st) != 0) return fs_error_input(err, "%s: cannot read", path);
    char size[32];
    fs_info_size((double)st.st_size, size, sizeof size);
    fs_log_info(log, "%s: PLY, %s, %s", path, ply.format, size);
    double expected = (double)ply.header_bytes;
    bool known = strncmp(ply.format, "binary", 6) == 0;
    for (int i = 0; i < ply.n; i++) {
        const Element *e = &ply.element[i];
        fs_log_info(log, "  %lld of %s: %s", e->count, e->name, e->properties);
        if (e->count > 0 && e->bytes == 0) known = false;
        expected += (double)e->count * (double)e->bytes;
    }
    if (known && expected != (double)st.st_size)
        return fs_error_input(err, "%s: %lld bytes, but its header promises %.0f: cut short or damaged", path,
                              (long long)st.st_size, expected);
    return 0;
}
