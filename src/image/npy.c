#include "image/npy.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/file.h"
#include "image/number.h"

#define MAX_FILE ((size_t)8 << 30)
#define MAX_HEADER 65536
#define CLIP_LEVEL 0.98 // of full, as of RAW files
#define REACH 2         // pixels over which demosaicing mixes
#define FLOATS 4        // a pixel, of a row as it is handed on

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "values are taken as they lie in memory");

static int bad(const char *path, const char *what, FsError *err)
{
    return fs_error_input(err, "%s: not an array of NumPy that can be read: %s", path, what);
}

// ---- the header: a dictionary of Python ----

// What stands behind a key; NULL: it is not there.
static const char *find_key(const char *header, const char *key)
{
    size_t n = strlen(key);
    for (const char *p = header; (p = strstr(p, key)); p += n) {
        bool quoted = p > header && (p[-1] == '\'' || p[-1] == '"') && p[n] == p[-1];
        const char *q = p + n + 1;
        while (quoted && *q == ' ') q++;
        if (quoted && *q == ':') return q + 1 + strspn(q + 1, " ");
    }
    return NULL;
}

static int parse_type(const char *path, const char *header, NpyArray *a, FsError *err)
{
    const char *p = find_key(header, "descr");
    if (!p || (*p != '\'' && *p != '"') || strlen(p) < 5) return bad(path, "its type is none of numbers", err);
    char order = p[1], quote = *p;
    a->kind = p[2];
    a->size = isdigit(p[2] ? (unsigned char)p[3] : 0) ? p[3] - '0' : 0;
    bool known = strchr("<>|=", order) && order && p[2] && p[3] && p[4] == quote;
    bool integer = (a->kind == 'i' || a->kind == 'u') && (a->size == 1 || a->size == 2 || a->size == 4);
    bool real = a->kind == 'f' && (a->size == 2 || a->size == 4 || a->size == 8);
    if (!known || (!integer && !real))
        return bad(path, "expected integers of 8, 16 or 32 bits or floats of 16, 32 or 64", err);
    a->swapped = order == '>' && a->size > 1;
    return 0;
}

static int parse_shape(const char *path, const char *header, NpyArray *a, FsError *err)
{
    const char *p = find_key(header, "shape");
    if (!p || *p++ != '(') return bad(path, "its header has no shape", err);
    while (*(p += strspn(p, " ,")) != ')') {
        char *end;
        errno = 0;
        unsigned long long n = isdigit((unsigned char)*p) ? strtoull(p, &end, 10) : 0;
        if (n == 0 || errno || n > MAX_FILE) return bad(path, "a side of its shape is no number above 0", err);
        if (a->n_dims == NPY_DIMS) return bad(path, "its shape has too many sides", err);
        a->dim[a->n_dims++] = n;
        p = end + (*end == 'L'); // Python 2 wrote it
        if (!strchr(" ,)", *p) || !*p) return bad(path, "its shape is no list of numbers", err);
    }
    if (a->n_dims == 0) return bad(path, "one number and no array", err);
    return 0;
}

// Strides, and whether the file holds as many bytes as that takes.
static int lay_out(const char *path, const char *header, size_t bytes, NpyArray *a, FsError *err)
{
    const char *p = find_key(header, "fortran_order");
    bool fortran = p && strncmp(p, "True", 4) == 0;
    if (!p || (!fortran && strncmp(p, "False", 5) != 0)) return bad(path, "its header has no fortran_order", err);
    size_t step = (size_t)a->size;
    for (int i = 0; i < a->n_dims; i++) {
        int d = fortran ? i : a->n_dims - 1 - i;
        a->stride[d] = step;
        if (__builtin_mul_overflow(step, a->dim[d], &step) || step > MAX_FILE)
            return bad(path, "its shape is beyond all files", err);
    }
    if (step != bytes)
        return fs_error_input(err, "%s: %zu bytes of values, expected %zu by its header: cut short or damaged", path,
                              bytes, step);
    return 0;
}

// Of the file's first bytes.
static int parse(const char *path, const char *data, size_t n, size_t size, NpyArray *a, FsError *err)
{
    const unsigned char *p = (const unsigned char *)data;
    if (n < 10 || memcmp(p, "\x93NUMPY", 6) != 0) return bad(path, "it does not begin as one", err);
    if (p[6] < 1 || p[6] > 3) return bad(path, "of a version after 3", err);
    size_t begin = p[6] == 1 ? 10 : 12, length = p[8] | (size_t)p[9] << 8;
    if (p[6] > 1 && n >= 12) length |= (size_t)p[10] << 16 | (size_t)p[11] << 24;
    if (n < begin || length > MAX_HEADER || length > n - begin) return bad(path, "its header is cut off", err);
    char *header = strndup(data + begin, length);
    int rc = 0;
    if (!header) return fs_error_memory(err);
    TRY(parse_type(path, header, a, err));
    TRY(parse_shape(path, header, a, err));
    TRY(lay_out(path, header, size - begin - length, a, err));
    a->data = data + begin + length;
fail:
    free(header);
    return rc;
}

int fs_npy_read(const char *path, NpyArray *array, FsError *err)
{
    *array = (NpyArray){0};
    size_t size;
    MUST(fs_file_read(path, MAX_FILE, &array->file, &size, err));
    int rc = parse(path, array->file, size, size, array, err);
    if (rc < 0) fs_npy_free(array);
    return rc;
}

// The header only, held against the file's size.
static int read_shape(const char *path, NpyArray *array, FsError *err)
{
    *array = (NpyArray){0};
    struct stat st;
    FILE *f;
    MUST(fs_file_open(path, &f, err));
    char *head = malloc(MAX_HEADER + 12);
    int rc = 0;
    if (!head) TRY(fs_error_memory(err));
    if (fstat(fileno(f), &st) != 0) TRY(bad(path, "it cannot be read", err));
    size_t n = fread(head, 1, MAX_HEADER + 12, f);
    TRY(parse(path, head, n, (size_t)st.st_size > n ? (size_t)st.st_size : n, array, err));
fail:
    array->data = NULL;
    fclose(f);
    free(head);
    return rc;
}

void fs_npy_free(NpyArray *array)
{
    free(array->file);
    *array = (NpyArray){0};
}

double fs_npy_value(const NpyArray *array, const char *at)
{
    return fs_number_read(at, array->kind, array->size, array->swapped);
}

// ---- photos ----

static int check_photo(const char *path, const NpyArray *a, FsError *err)
{
    if (a->n_dims == 3 && a->dim[2] == 3 && a->dim[0] <= FS_IMAGE_MAX_SIDE && a->dim[1] <= FS_IMAGE_MAX_SIDE) return 0;
    char shape[120] = "";
    for (int i = 0; i < a->n_dims; i++)
        snprintf(shape + strlen(shape), sizeof shape - strlen(shape), "%s%zu", i ? " x " : "", a->dim[i]);
    return fs_error_input(err, "%s: an array of %s numbers, expected a photo: height x width x 3, demosaiced", path,
                          shape);
}

int fs_npy_photo_size(const char *path, int *width, int *height, double *memory, FsError *err)
{
    NpyArray a;
    MUST(read_shape(path, &a, err));
    MUST(check_photo(path, &a, err));
    *height = (int)a.dim[0];
    *width = (int)a.dim[1];
    if (memory) *memory = (3.0 * a.size + 1) * *width * *height;
    return 0;
}

static double share_at(const NpyArray *a, const SensorLevels *levels, size_t y, size_t x, size_t c)
{
    const char *at = a->data + y * a->stride[0] + x * a->stride[1] + c * a->stride[2];
    return (fs_npy_value(a, at) - levels->black) / (levels->white - levels->black);
}

// Where a channel is full or no number; returns how many values lie above black.
static size_t find_full(const NpyArray *a, const SensorLevels *levels, unsigned char *full)
{
    size_t above = 0, width = a->dim[1];
    for (size_t i = 0; i < a->dim[0] * width; i++) {
        full[i] = 0;
        for (size_t c = 0; c < 3; c++) {
            double v = share_at(a, levels, i / width, i % width, c);
            above += v > 0;
            if (!(v < CLIP_LEVEL)) full[i] = 1; // so is NaN
        }
    }
    return above;
}

// A row as light, and the pixels whose colour was made with the help of full ones, as raw.c has them.
static void convert_row(const NpyArray *a, int y, const SensorLevels *levels, const unsigned char *full, float *rgb)
{
    int width = (int)a->dim[1], height = (int)a->dim[0];
    float *clipped = rgb + 3 * (size_t)width;
    memset(clipped, 0, (size_t)width * sizeof *clipped);
    for (int j = -REACH; j <= REACH; j++)
        for (int x = 0; x < width && y + j >= 0 && y + j < height; x++)
            for (int i = abs(j) - REACH; full[(size_t)(y + j) * (size_t)width + (size_t)x] && i <= REACH - abs(j); i++)
                if (x + i >= 0 && x + i < width) clipped[x + i] = 1;
    for (size_t i = 0; i < 3 * (size_t)width; i++) {
        double v = share_at(a, levels, (size_t)y, i / 3, i % 3), gain = levels->gain[i % 3];
        rgb[i] = (float)(fabs(v) < 1e6 ? v * gain : gain);
    }
}

int fs_npy_read_photo(const char *path, const SensorLevels *levels, PhotoSizes *sizes, FsError *err)
{
    NpyArray a;
    float *row = NULL;
    unsigned char *full = NULL;
    fs_sizes_clear(sizes);
    int rc = fs_npy_read(path, &a, err);
    if (rc < 0) return rc;
    TRY(check_photo(path, &a, err));
    row = malloc(a.dim[1] * FLOATS * sizeof *row);
    full = malloc(a.dim[0] * a.dim[1]);
    if (!row || !full) TRY(fs_error_memory(err));
    if (find_full(&a, levels, full) == 0)
        TRY(fs_error_input(err,
                           "%s: no value is above the black level %g: give the camera's own with --npy-black and "
                           "--npy-white",
                           path, levels->black));
    TRY(fs_sizes_begin(sizes, (int)a.dim[1], (int)a.dim[0], err));
    sizes->white = (float)fmin(levels->gain[0], fmin(levels->gain[1], levels->gain[2]));
    for (int y = 0; y < (int)a.dim[0]; y++) {
        convert_row(&a, y, levels, full, row);
        fs_sizes_whiten(sizes, row, row + 3 * a.dim[1]);
        fs_sizes_row(sizes, row, row + 3 * a.dim[1]);
    }
fail:
    free(row);
    free(full);
    fs_npy_free(&a);
    fs_sizes_end(sizes);
    if (rc < 0) fs_sizes_free(sizes);
    return rc;
}
