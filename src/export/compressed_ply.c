// PlayCanvas's compressed PLY: chunks of 256 Gaussians with their ranges as floats, then four words a Gaussian:
// position 11 + 10 + 11 bits, rotation 2 + 3 x 10, log scale 11 + 10 + 11, colour and opacity 4 x 8.
#include <stdlib.h>

#include "base/file.h"
#include "export/formats.h"

#define CHUNK 256
#define SIZE 20.0f // readers expect log scales within it

static const char *const ranges[] = {
    "min_x",       "min_y",       "min_z",       "max_x", "max_y", "max_z", "min_scale_x", "min_scale_y", "min_scale_z",
    "max_scale_x", "max_scale_y", "max_scale_z", "min_r", "min_g", "min_b", "max_r",       "max_g",       "max_b",
};
static const char *const words[] = {"packed_position", "packed_rotation", "packed_scale", "packed_color"};
enum { RANGES = sizeof ranges / sizeof *ranges, WORDS = sizeof words / sizeof *words };

typedef struct Chunk {
    float range[RANGES]; // (position, scale, colour; least, greatest; 3)
} Chunk;

static unsigned level(const Chunk *chunk, int what, int axis, float v, unsigned most)
{
    double least = (double)chunk->range[6 * what + axis], span = (double)chunk->range[6 * what + 3 + axis] - least;
    return fs_splats_level(span > 0 ? ((double)v - least) / span * most : 0, most);
}

static void find_ranges(const Splats *splats, size_t from, int n, Chunk *chunk)
{
    const float *const array[3] = {splats->mean, splats->scale, splats->srgb};
    for (int what = 0; what < 3; what++)
        for (int a = 0; a < 3; a++) {
            float range[2];
            fs_splats_range(array[what] + 3 * from + a, n, range);
            for (int end = 0; end < 2; end++) {
                float v = range[end];
                if (what == 1) v = v < -SIZE ? -SIZE : v > SIZE ? SIZE : v;
                chunk->range[6 * what + 3 * end + a] = v;
            }
        }
}

static void pack(const Splats *splats, size_t i, const Chunk *chunk, uint32_t row[WORDS])
{
    const float *mean = splats->mean + 3 * i, *scale = splats->scale + 3 * i, *color = splats->srgb + 3 * i;
    float other[3];
    row[0] = level(chunk, 0, 0, mean[0], 2047) << 21 | level(chunk, 0, 1, mean[1], 1023) << 11 |
             level(chunk, 0, 2, mean[2], 2047);
    row[1] = (uint32_t)fs_splats_smallest_three(splats->rotation + 4 * i, other);
    for (int k = 0; k < 3; k++)
        row[1] = row[1] << 10 | fs_splats_level(1023 * ((double)other[k] * FS_SPLATS_HALF_ROOT + 0.5), 1023);
    row[2] = level(chunk, 1, 0, scale[0], 2047) << 21 | level(chunk, 1, 1, scale[1], 1023) << 11 |
             level(chunk, 1, 2, scale[2], 2047);
    row[3] = fs_splats_level(255 * fs_splats_opacity(splats, i), 255);
    for (int c = 0; c < 3; c++) row[3] |= (uint32_t)level(chunk, 2, c, color[c], 255) << (24 - 8 * c);
}

int fs_compressed_ply_write(const Splats *splats, const char *path, FsError *err)
{
    AtomicFile file = {0};
    size_t n = (size_t)splats->n, n_chunks = (n + CHUNK - 1) / CHUNK;
    Chunk *chunks = malloc(sizeof *chunks * (n_chunks + 1));
    int rc = 0;
    if (!chunks) TRY(fs_error_memory(err));
    for (size_t c = 0; c < n_chunks; c++)
        find_ranges(splats, c * CHUNK, n - c * CHUNK < CHUNK ? (int)(n - c * CHUNK) : CHUNK, &chunks[c]);
    TRY(fs_file_begin(&file, path, err));
    fprintf(file.f, "ply\nformat binary_little_endian 1.0\nelement chunk %zu\n", n_chunks);
    for (int k = 0; k < RANGES; k++) fprintf(file.f, "property float %s\n", ranges[k]);
    fprintf(file.f, "element vertex %zu\n", n);
    for (int k = 0; k < WORDS; k++) fprintf(file.f, "property uint %s\n", words[k]);
    fprintf(file.f, "end_header\n");
    fwrite(chunks, sizeof *chunks, n_chunks, file.f);
    for (size_t i = 0; i < n; i++) {
        uint32_t row[WORDS];
        pack(splats, i, &chunks[i / CHUNK], row);
        fwrite(row, sizeof row, 1, file.f);
    }
    TRY(fs_file_commit(&file, err));
fail:
    fs_file_abort(&file);
    free(chunks);
    return rc;
}
