#include "image/boxes.h"

#include <string.h>

static uint64_t big(const unsigned char *p, int bytes)
{
    uint64_t v = 0;
    for (int i = 0; i < bytes; i++) v = v << 8 | p[i];
    return v;
}

bool fs_boxes_at(const Block *block, uint64_t at, Block *inside, char type[4], uint64_t *next)
{
    unsigned char p[16];
    if (!fs_ifd_read_at(block, at, p, 8)) return false;
    uint64_t left = block->size - at, size = big(p, 4), head = 8;
    if (size == 1) {
        if (!fs_ifd_read_at(block, at + 8, p + 8, 8)) return false;
        size = big(p + 8, 8);
        head = 16;
    }
    if (size == 0) size = left;
    if (size < head) return false;
    memcpy(type, p + 4, 4);
    *inside = (Block){.fd = block->fd,
                      .start = block->start + at + head,
                      .size = (size < left ? size : left) - head,
                      .memory = block->memory};
    *next = size > UINT64_MAX - at ? UINT64_MAX : at + size;
    return true;
}
