// Niantic's SPZ, versions 2 and 3: a gzip stream of a header and one array after the other: positions of 24 bits in
// fixed point, then bytes: opacity, colour, scale, rotation (version 2: x y z of 8 bits; version 3: the index of the
// largest component in 2 bits and the three others in 10, sign and magnitude).
#include <math.h>
#include <stdlib.h>
#include <zlib.h>

#include "base/file.h"
#include "export/formats.h"

#define HEADER 16
#define COLOR_SCALE 0.15  // of f_dc in a byte around 127.5
#define STEPS 262144.0    // of position in half the scene: enough, and more bits do not compress
#define ROOM 4            // times half the scene, beyond its ends, for those that lie farther out
#define MOST_FRACTION 20  // bits after the point
#define LARGEST 8388607.0 // of 24 bits

static void put_bits(unsigned char *to, uint32_t value, int bytes)
{
    for (int k = 0; k < bytes; k++) to[k] = (unsigned char)(value >> 8 * k);
}

// As many bits after the point as nearly all positions need, and as there is room for where all lie far from the
// origin.
static int find_fraction(const Splats *splats, int *bits, FsError *err)
{
    double reach, spread;
    MUST(fs_splats_reach(splats, 0.999, &reach, err));
    MUST(fs_splats_spread(splats, 0.998, &spread, err));
    *bits = 0;
    while (*bits < MOST_FRACTION && ldexp(spread, *bits + 1) < STEPS &&
           ldexp(reach + ROOM * spread, *bits + 1) < LARGEST)
        ++*bits;
    return 0;
}

static void pack_position(const float mean[3], int fraction, unsigned char to[9])
{
    double fixed[3], most = 0;
    for (int a = 0; a < 3; a++) {
        fixed[a] = ldexp((double)mean[a], fraction);
        most = fmax(most, fabs(fixed[a]));
    }
    double nearer = most > LARGEST ? LARGEST / most : 1; // in its direction
    for (int a = 0; a < 3; a++) put_bits(to + 3 * a, (uint32_t)(int32_t)round(fixed[a] * nearer), 3);
}

static void pack_rotation_old(const float q[4], unsigned char to[3])
{
    for (int k = 0; k < 3; k++)
        to[k] = (unsigned char)fs_splats_level(127.5 + 127.5 * (double)(q[0] < 0 ? -q[k + 1] : q[k + 1]), 255);
}

static void pack_rotation(const float q[4], unsigned char to[4])
{
    const float xyzw[4] = {q[1], q[2], q[3], q[0]};
    float other[3];
    uint32_t packed = (uint32_t)fs_splats_smallest_three(xyzw, other);
    for (int k = 0; k < 3; k++)
        packed = packed << 10 | (uint32_t)(other[k] < 0) << 9 |
                 fs_splats_level(511.0 * 2 * FS_SPLATS_HALF_ROOT * fabs((double)other[k]), 511);
    put_bits(to, packed, 4);
}

static void pack(const Splats *splats, int version, int fraction, unsigned char *data)
{
    size_t n = (size_t)splats->n, turn_bytes = version == 2 ? 3 : 4;
    const uint32_t header[4] = {0x5053474e, (uint32_t)version, (uint32_t)n, (uint32_t)fraction << 8};
    for (int k = 0; k < 4; k++) put_bits(data + 4 * k, header[k], 4);
    unsigned char *position = data + HEADER, *alpha = position + 9 * n, *color = alpha + n, *scale = color + 3 * n,
                  *rotation = scale + 3 * n;
    for (size_t i = 0; i < n; i++) {
        pack_position(splats->mean + 3 * i, fraction, position + 9 * i);
        for (size_t a = 0; a < 3; a++) {
            double dc = ((double)splats->srgb[3 * i + a] - 0.5) / FS_SPLATS_SH0;
            color[3 * i + a] = (unsigned char)fs_splats_level(255 * (COLOR_SCALE * dc + 0.5), 255);
            scale[3 * i + a] = (unsigned char)fs_splats_level(16 * ((double)splats->scale[3 * i + a] + 10), 255);
        }
        alpha[i] = (unsigned char)fs_splats_level(255 * fs_splats_opacity(splats, i), 255);
        (version == 2 ? pack_rotation_old : pack_rotation)(splats->rotation + 4 * i, rotation + turn_bytes * i);
    }
}

static int compress_to(AtomicFile *file, const unsigned char *data, size_t size, FsError *err)
{
    z_stream z = {.next_in = (unsigned char *)data};
    unsigned char out[1 << 16];
    if (deflateInit2(&z, Z_BEST_COMPRESSION, Z_DEFLATED, 16 + MAX_WBITS, 9, Z_DEFAULT_STRATEGY) != Z_OK)
        return fs_error_memory(err);
    int state = Z_OK;
    while (state == Z_OK) {
        if (z.avail_in == 0) { // avail_in is 32 bits wide
            z.avail_in = (unsigned)(size < (1 << 30) ? size : 1 << 30);
            size -= z.avail_in;
        }
        z.next_out = out, z.avail_out = sizeof out;
        state = deflate(&z, size ? Z_NO_FLUSH : Z_FINISH);
        fwrite(out, 1, sizeof out - z.avail_out, file->f);
    }
    deflateEnd(&z);
    if (state != Z_STREAM_END)
        return fs_error_set(err, FS_ERR_IO, "%s: cannot be compressed: zlib's error %d", file->path, state);
    return 0;
}

static int write_version(const Splats *splats, int version, const char *path, FsError *err)
{
    int rc, fraction;
    AtomicFile file = {0};
    MUST(find_fraction(splats, &fraction, err));
    size_t size = HEADER + (size_t)splats->n * (version == 2 ? 19 : 20);
    unsigned char *data = malloc(size);
    if (!data) return fs_error_memory(err);
    pack(splats, version, fraction, data);
    TRY(fs_file_begin(&file, path, err));
    TRY(compress_to(&file, data, size, err));
    TRY(fs_file_commit(&file, err));
fail:
    fs_file_abort(&file);
    free(data);
    return rc;
}

int fs_spz_write(const Splats *splats, const char *path, FsError *err)
{
    return write_version(splats, 3, path, err);
}

int fs_spz_write_old(const Splats *splats, const char *path, FsError *err)
{
    return write_version(splats, 2, path, err);
}
