// Clouds as PLY files, binary little-endian: our own layout (every field, exact floats), and plain coloured points.
#include "model/cloud.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/file.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "PLY bodies are copied as they lie in memory");

#define MAX_FLOATS 64    // properties per Gaussian a file may have; ours have 14 to 16
#define MAX_HEADER 16384 // bytes
#define CHUNK 4096       // Gaussians read or written at a time

// Where each float of a Gaussian goes: field and column.
typedef struct Layout {
    int n;
    int field[MAX_FLOATS], column[MAX_FLOATS]; // field -1: a property we do not know, skipped
} Layout;

static Layout layout_of(const Cloud *cloud)
{
    Layout layout = {0};
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int c = 0; c < cloud->width[f]; c++, layout.n++) layout.field[layout.n] = f, layout.column[layout.n] = c;
    return layout;
}

int fs_cloud_ply_write(const Cloud *cloud, const char *path, FsError *err)
{
    Layout layout = layout_of(cloud);
    float *rows = malloc(sizeof(float) * CHUNK * MAX_FLOATS);
    if (!rows) return fs_error_memory(err);
    AtomicFile file = {0};
    int rc;
    TRY(fs_file_begin(&file, path, err));
    fprintf(file.f, "ply\nformat binary_little_endian 1.0\ncomment flashsplat cloud\nelement vertex %d\n", cloud->n);
    for (int p = 0; p < layout.n; p++)
        fprintf(file.f, "property float %s\n", fs_cloud_fields[layout.field[p]].ply[layout.column[p]]);
    fprintf(file.f, "end_header\n");
    for (int i0 = 0; i0 < cloud->n; i0 += CHUNK) {
        int m = cloud->n - i0 < CHUNK ? cloud->n - i0 : CHUNK;
        for (int i = 0; i < m; i++)
            for (int p = 0; p < layout.n; p++) {
                size_t width = (size_t)cloud->width[layout.field[p]];
                rows[(size_t)i * (size_t)layout.n + (size_t)p] =
                    cloud->field[layout.field[p]][(size_t)(i0 + i) * width + (size_t)layout.column[p]];
            }
        fwrite(rows, sizeof(float) * (size_t)layout.n, (size_t)m, file.f);
    }
    TRY(fs_file_commit(&file, err));
fail:
    fs_file_abort(&file);
    free(rows);
    return rc;
}

// ---- reading ----

typedef struct Header {
    long long count; // vertices; -1 before their element line
    Layout layout;
} Header;

static int parse_property(const char *path, const char *line, Header *h, FsError *err)
{
    char type[16], name[32], rest[2];
    if (h->count < 0 || sscanf(line, "property %15s %31s %1s", type, name, rest) != 2 ||
        (strcmp(type, "float") != 0 && strcmp(type, "float32") != 0))
        return fs_error_input(err, "%s: '%.60s': expected only float properties of element vertex", path, line);
    Layout *layout = &h->layout;
    if (layout->n == MAX_FLOATS)
        return fs_error_input(err, "%s: more than %d properties per Gaussian", path, MAX_FLOATS);
    int field = -1, column = 0;
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int c = 0; c < fs_cloud_fields[f].width; c++)
            if (strcmp(fs_cloud_fields[f].ply[c], name) == 0) field = f, column = c;
    for (int p = 0; p < layout->n && field >= 0; p++)
        if (layout->field[p] == field && layout->column[p] == column)
            return fs_error_input(err, "%s: property %s appears twice", path, name);
    layout->field[layout->n] = field;
    layout->column[layout->n++] = column;
    return 0;
}

static int parse_element(const char *path, const char *line, Header *h, FsError *err)
{
    char name[32], rest[2];
    long long count;
    if (h->count >= 0 || sscanf(line, "element %31s %lld %1s", name, &count, rest) != 2 || strcmp(name, "vertex") != 0)
        return fs_error_input(err, "%s: '%.60s': expected one 'element vertex N' and no other element", path, line);
    if (count < 0 || count > INT_MAX)
        return fs_error_input(err, "%s: %lld Gaussians, expected 0 to %d", path, count, INT_MAX);
    h->count = count;
    return 0;
}

static int parse_line(const char *path, const char *line, int number, Header *h, FsError *err)
{
    if (number == 0 && strcmp(line, "ply") != 0) return fs_error_input(err, "%s: not a PLY file", path);
    if (number == 1 && strcmp(line, "format binary_little_endian 1.0") != 0)
        return fs_error_input(err, "%s: '%.60s': expected format binary_little_endian 1.0", path, line);
    if (number < 2 || strncmp(line, "comment", 7) == 0 || strncmp(line, "obj_info", 8) == 0) return 0;
    if (strncmp(line, "element ", 8) == 0) return parse_element(path, line, h, err);
    if (strncmp(line, "property ", 9) == 0) return parse_property(path, line, h, err);
    return fs_error_input(err, "%s: '%.60s': not a PLY header line", path, line);
}

static int read_header(FILE *f, const char *path, Header *h, FsError *err)
{
    *h = (Header){.count = -1};
    char line[256];
    size_t total = 0;
    for (int number = 0;; number++) {
        if (!fgets(line, sizeof line, f) || !strchr(line, '\n') || (total += strlen(line)) > MAX_HEADER)
            return fs_error_input(err, "%s: not a PLY file, or its header is cut off", path);
        line[strcspn(line, "\r\n")] = 0;
        if (strcmp(line, "end_header") == 0 && number >= 2) break;
        MUST(parse_line(path, line, number, h, err));
    }
    if (h->count < 0) return fs_error_input(err, "%s: no 'element vertex' in the header", path);
    return 0;
}

// Which fields the header has, whole; means to opacities are a must, colours are 1 or 3 wide, gain and cover 0 or 1.
static int widths_of(const char *path, const Layout *layout, int width[CLOUD_FIELDS], FsError *err)
{
    unsigned have[CLOUD_FIELDS] = {0};
    for (int p = 0; p < layout->n; p++)
        if (layout->field[p] >= 0) have[layout->field[p]] |= 1u << layout->column[p];
    for (int f = 0; f < CLOUD_FIELDS; f++) {
        unsigned whole = (1u << fs_cloud_fields[f].width) - 1;
        bool spare = f == CLOUD_GAINS || f == CLOUD_COVERS;
        bool ok = have[f] == whole || (f == CLOUD_COLORS && have[f] == 1) || (spare && !have[f]);
        if (!ok)
            return fs_error_input(err, "%s: properties of '%s' (%s ...) are missing: not a cloud written by flashsplat",
                                  path, fs_cloud_fields[f].name, fs_cloud_fields[f].ply[0]);
        width[f] = __builtin_popcount(have[f]);
    }
    return 0;
}

static int read_rows(FILE *f, const char *path, const Layout *layout, Cloud *cloud, FsError *err)
{
    size_t n_floats = (size_t)layout->n;
    float *rows = malloc(sizeof(float) * CHUNK * n_floats);
    if (!rows) return fs_error_memory(err);
    int rc = 0;
    for (int i0 = 0; i0 < cloud->n; i0 += CHUNK) {
        int m = cloud->n - i0 < CHUNK ? cloud->n - i0 : CHUNK;
        if (fread(rows, sizeof(float) * n_floats, (size_t)m, f) != (size_t)m)
            TRY(fs_error_input(err, "%s: read failed: %s", path, ferror(f) ? strerror(errno) : "it became shorter"));
        for (int i = 0; i < m; i++)
            for (size_t p = 0; p < n_floats; p++) {
                float v = rows[(size_t)i * n_floats + p];
                int field = layout->field[p];
                if (field < 0) continue;
                if (!isfinite(v))
                    TRY(fs_error_input(err, "%s: Gaussian %d: property %s is not a finite number", path, i0 + i,
                                       fs_cloud_fields[field].ply[layout->column[p]]));
                cloud->field[field][(size_t)(i0 + i) * (size_t)cloud->width[field] + (size_t)layout->column[p]] = v;
            }
    }
fail:
    free(rows);
    return rc;
}

int fs_cloud_ply_read(Cloud *cloud, const char *path, FsError *err)
{
    *cloud = (Cloud){0};
    FILE *f;
    MUST(fs_file_open(path, &f, err));
    int rc;
    Cloud like = {0};
    Header h;
    struct stat st;
    if (fstat(fileno(f), &st) != 0) TRY(fs_error_input(err, "%s: read failed: %s", path, strerror(errno)));
    TRY(read_header(f, path, &h, err));
    TRY(widths_of(path, &h.layout, like.width, err));
    long long body = (long long)st.st_size - (long long)ftello(f);
    long long expected = h.count * (long long)sizeof(float) * h.layout.n;
    if (body != expected)
        TRY(fs_error_input(err, "%s: %lld bytes of data, expected %lld for %lld Gaussians: cut off or damaged", path,
                           body, expected, h.count));
    TRY(fs_cloud_new_like(cloud, &like, (int)h.count, err));
    TRY(read_rows(f, path, &h.layout, cloud, err));
fail:
    if (rc < 0) fs_cloud_free(cloud);
    fclose(f);
    return rc;
}

// ---- points ----

int fs_cloud_points_write(const char *path, int n, const float *xyz, const unsigned char *rgb, const float *value,
                          FsError *err)
{
    AtomicFile file;
    MUST(fs_file_begin(&file, path, err));
    fprintf(file.f,
            "ply\nformat binary_little_endian 1.0\ncomment flashsplat points\nelement vertex %d\n"
            "property float x\nproperty float y\nproperty float z\n"
            "property uchar red\nproperty uchar green\nproperty uchar blue\n%send_header\n",
            n, value ? "property float value\n" : "");
    for (size_t i = 0; i < (size_t)n; i++) {
        char row[19];
        memcpy(row, xyz + 3 * i, 12);
        memcpy(row + 12, rgb + 3 * i, 3);
        if (value) memcpy(row + 15, value + i, 4);
        fwrite(row, value ? 19 : 15, 1, file.f);
    }
    return fs_file_commit(&file, err);
}
