// Multiply, fold the upper half onto the lower: one multiplication for eight bytes, some GB/s.
#include "base/hash.h"

#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/error.h"

#define BLOCK (1 << 18)

static uint64_t mix(uint64_t hash, uint64_t word)
{
    __uint128_t m = (__uint128_t)(hash ^ word) * 0xd6e8feb86659fd93u;
    return ((uint64_t)m ^ (uint64_t)(m >> 64)) + word;
}

uint64_t fs_hash_bytes(uint64_t hash, const void *data, size_t size)
{
    const unsigned char *p = data;
    uint64_t word;
    hash = mix(hash, size);
    for (; size >= sizeof word; size -= sizeof word, p += sizeof word) {
        memcpy(&word, p, sizeof word);
        hash = mix(hash, word);
    }
    word = 0;
    memcpy(&word, p, size);
    return mix(hash, word);
}

uint64_t fs_hash_text(uint64_t hash, const char *text)
{
    return fs_hash_bytes(hash, text, strlen(text));
}

// Reads until the block is full, so that blocks, and with them the hash, do not depend on how the system reads.
static ssize_t read_block(int fd, char *block)
{
    ssize_t all = 0, n = 0;
    while (all < BLOCK && (n = read(fd, block + all, BLOCK - (size_t)all)) > 0) all += n;
    return n < 0 ? -1 : all;
}

int fs_hash_file(const char *path, bool follow, uint64_t *hash, uint64_t *size)
{
    struct stat st;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | (follow ? 0 : O_NOFOLLOW));
    char *block = fd >= 0 ? malloc(BLOCK) : NULL;
    if (fd >= 0 && !block) fs_error_memory(NULL);
    ssize_t n = block && fstat(fd, &st) == 0 && S_ISREG(st.st_mode) ? 1 : -1;
    *size = 0;
    while (n > 0 && (n = read_block(fd, block)) > 0) {
        *hash = fs_hash_bytes(*hash, block, (size_t)n);
        *size += (uint64_t)n;
    }
    free(block);
    if (fd >= 0) close(fd);
    return n < 0 ? -1 : 0;
}
