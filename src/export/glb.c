// Binary glTF 2.0 with KHR_gaussian_splatting (release candidate, as of the editorial review of April 2026): points
// with the attributes of Gaussians, and colours for readers that do not know the extension. The pane, where there is
// one, is a rectangle beside them.
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "export/formats.h"
#include "image/tone.h"

#define EXTENSION "KHR_gaussian_splatting"
enum { FLOAT = 5126, BYTE = 5121, POINTS = 0, TRIANGLE_FAN = 6, CHUNK = 1024 };

typedef void Fill(const Splats *splats, size_t i, void *row);

static void fill_position(const Splats *splats, size_t i, void *row)
{
    memcpy(row, splats->mean + 3 * i, 12);
}

static void fill_rotation(const Splats *splats, size_t i, void *row) // x y z w
{
    memcpy(row, splats->rotation + 4 * i + 1, 12);
    memcpy((char *)row + 12, splats->rotation + 4 * i, 4);
}

static void fill_scale(const Splats *splats, size_t i, void *row)
{
    float scale[3];
    for (size_t a = 0; a < 3; a++) scale[a] = expf(splats->scale[3 * i + a]);
    memcpy(row, scale, 12);
}

static void fill_opacity(const Splats *splats, size_t i, void *row)
{
    float opacity = (float)fs_splats_opacity(splats, i);
    memcpy(row, &opacity, 4);
}

static void fill_harmonic(const Splats *splats, size_t i, void *row)
{
    float dc[3];
    for (size_t c = 0; c < 3; c++) dc[c] = (float)(((double)splats->srgb[3 * i + c] - 0.5) / FS_SPLATS_SH0);
    memcpy(row, dc, 12);
}

static void fill_color(const Splats *splats, size_t i, void *row) // linear light
{
    unsigned char *rgba = row;
    for (size_t c = 0; c < 3; c++) {
        float display = fminf(fmaxf(splats->srgb[3 * i + c], 0), 1);
        rgba[c] = (unsigned char)fs_splats_level(255 * (double)fs_tone_srgb_decode(display), 255);
    }
    rgba[3] = (unsigned char)fs_splats_level(255 * fs_splats_opacity(splats, i), 255);
}

static const struct {
    const char *name, *type;
    int component;
    size_t bytes; // a Gaussian
    Fill *fill;
} attributes[] = {
    {"POSITION", "VEC3", FLOAT, 12, fill_position},
    {EXTENSION ":ROTATION", "VEC4", FLOAT, 16, fill_rotation},
    {EXTENSION ":SCALE", "VEC3", FLOAT, 12, fill_scale},
    {EXTENSION ":OPACITY", "SCALAR", FLOAT, 4, fill_opacity},
    {EXTENSION ":SH_DEGREE_0_COEF_0", "VEC3", FLOAT, 12, fill_harmonic},
    {"COLOR_0", "VEC4", BYTE, 4, fill_color},
};
enum { ATTRIBUTES = sizeof attributes / sizeof *attributes };

typedef struct Parts { // of the document
    json_t *accessors, *views;
    size_t bytes;
} Parts;

static int add_accessor(Parts *parts, size_t n, size_t bytes, int component, const char *type)
{
    int index = (int)json_array_size(parts->accessors);
    json_array_append_new(parts->views,
                          json_pack("{s:i, s:I, s:I, s:i}", "buffer", 0, "byteOffset", (json_int_t)parts->bytes,
                                    "byteLength", (json_int_t)(n * bytes), "target", 34962));
    json_array_append_new(parts->accessors, json_pack("{s:i, s:i, s:I, s:s}", "bufferView", index, "componentType",
                                                      component, "count", (json_int_t)n, "type", type));
    parts->bytes += n * bytes;
    return index;
}

// What positions must have.
static void set_range(const Parts *parts, int index, const float *xyz, int n)
{
    json_t *accessor = json_array_get(parts->accessors, (size_t)index), *least = json_array(), *most = json_array();
    for (int a = 0; a < 3; a++) {
        float range[2];
        fs_splats_range(xyz + a, n, range);
        json_array_append_new(least, json_real((double)range[0]));
        json_array_append_new(most, json_real((double)range[1]));
    }
    json_object_set_new(accessor, "min", least);
    json_object_set_new(accessor, "max", most);
}

static json_t *splats_mesh(const Splats *splats, Parts *parts)
{
    json_t *named = json_object();
    for (int k = 0; k < ATTRIBUTES; k++) {
        int index =
            add_accessor(parts, (size_t)splats->n, attributes[k].bytes, attributes[k].component, attributes[k].type);
        if (attributes[k].component == BYTE)
            json_object_set_new(json_array_get(parts->accessors, (size_t)index), "normalized", json_true());
        json_object_set_new(named, attributes[k].name, json_integer(index));
    }
    set_range(parts, 0, splats->mean, splats->n);
    return json_pack("{s:s, s:[{s:o, s:i, s:{s:{s:s, s:s}}}]}", "name", "Gaussians", "primitives", "attributes", named,
                     "mode", POINTS, "extensions", EXTENSION, "kernel", "ellipse", "colorSpace", "srgb_rec709_display");
}

static json_t *pane_mesh(const Splats *splats, Parts *parts)
{
    int index = add_accessor(parts, 4, 12, FLOAT, "VEC3");
    set_range(parts, index, splats->pane[0], 4);
    return json_pack("{s:s, s:[{s:{s:i}, s:i, s:i}]}", "name", "pane", "primitives", "attributes", "POSITION", index,
                     "mode", TRIANGLE_FAN, "material", 0);
}

static json_t *document(const Splats *splats, size_t *bytes)
{
    Parts parts = {json_array(), json_array(), 0};
    json_t *meshes = json_array(), *nodes = json_pack("[{s:s, s:i}]", "name", "Gaussians", "mesh", 0);
    json_array_append_new(meshes, splats_mesh(splats, &parts));
    json_t *root = json_pack("{s:{s:s, s:s}, s:[s], s:i, s:[{s:[i]}], s:o, s:o}", "asset", "version", "2.0",
                             "generator", "flashsplat", "extensionsUsed", EXTENSION, "scene", 0, "scenes", "nodes", 0,
                             "nodes", nodes, "meshes", meshes);
    if (splats->has_pane) {
        json_array_append_new(meshes, pane_mesh(splats, &parts));
        json_array_append_new(nodes, json_pack("{s:s, s:i}", "name", "pane", "mesh", 1));
        json_t *shown = json_object_get(json_array_get(json_object_get(root, "scenes"), 0), "nodes");
        json_array_append_new(shown, json_integer(1));
        json_object_set_new(root, "materials",
                            json_pack("[{s:s, s:s, s:b, s:{s:[ffff], s:f, s:f}}]", "name", "glass", "alphaMode",
                                      "BLEND", "doubleSided", 1, "pbrMetallicRoughness", "baseColorFactor", 0.6, 0.8,
                                      1.0, 0.15, "metallicFactor", 0.0, "roughnessFactor", 0.1));
    }
    json_object_set_new(root, "accessors", parts.accessors);
    json_object_set_new(root, "bufferViews", parts.views);
    json_object_set_new(root, "buffers", json_pack("[{s:I}]", "byteLength", (json_int_t)parts.bytes));
    *bytes = parts.bytes;
    return root;
}

static void write_rows(FILE *f, const Splats *splats)
{
    unsigned char rows[16 * CHUNK];
    for (int k = 0; k < ATTRIBUTES; k++) {
        size_t n = 0;
        for (size_t i = 0; i < (size_t)splats->n; i++) {
            attributes[k].fill(splats, i, rows + attributes[k].bytes * n);
            if (++n < CHUNK && i + 1 < (size_t)splats->n) continue;
            fwrite(rows, attributes[k].bytes, n, f);
            n = 0;
        }
    }
    if (splats->has_pane) fwrite(splats->pane, sizeof splats->pane, 1, f);
}

int fs_glb_write(const Splats *splats, const char *path, FsError *err)
{
    AtomicFile file = {0};
    size_t bytes = 0;
    json_t *root = document(splats, &bytes);
    char *text = root ? json_dumps(root, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
    int rc = 0;
    json_decref(root);
    if (!text) TRY(fs_error_memory(err));
    size_t length = strlen(text), blanks = (4 - length % 4) % 4;
    uint32_t json_bytes = (uint32_t)(length + blanks), total = 12 + 8 + json_bytes + 8 + (uint32_t)bytes;
    const uint32_t header[5] = {0x46546c67, 2, total, json_bytes, 0x4e4f534a}, body[2] = {(uint32_t)bytes, 0x004e4942};
    TRY(fs_file_begin(&file, path, err));
    fwrite(header, sizeof header, 1, file.f);
    fprintf(file.f, "%s%.*s", text, (int)blanks, "   ");
    fwrite(body, sizeof body, 1, file.f);
    write_rows(file.f, splats);
    TRY(fs_file_commit(&file, err));
fail:
    fs_file_abort(&file);
    free(text);
    return rc;
}
