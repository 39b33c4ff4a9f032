// HEIF files say which pictures others are made of; libheif follows that without end where a picture is made of itself.
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "image/boxes.h"
#include "image/heif.h"

enum { MAX_LINKS = 4096, MAX_DEPTH = 6, MAX_BOXES = 4096 };

typedef struct Links {
    int n;
    bool too_many;
    struct {
        uint32_t whole, part;
        bool ends; // the part is made of nothing further
    } link[MAX_LINKS];
} Links;

static uint32_t big(const unsigned char *p, int bytes)
{
    uint32_t v = 0;
    for (int i = 0; i < bytes; i++) v = v << 8 | p[i];
    return v;
}

static void add_link(Links *links, uint32_t whole, uint32_t part)
{
    if (links->n == MAX_LINKS) links->too_many = true;
    if (links->too_many) return;
    links->link[links->n].whole = whole;
    links->link[links->n++].part = part;
}

// A derived picture and what it is derived from; a picture and, the other way about, what belongs to it (alpha).
static void read_references(const Block *iref, Links *links)
{
    unsigned char p[4];
    uint64_t at = 4, next;
    Block box;
    char type[4];
    if (!fs_ifd_read_at(iref, 0, p, 1)) return;
    int width = p[0] == 0 ? 2 : 4;
    for (int i = 0; i < MAX_BOXES && fs_boxes_at(iref, at, &box, type, &next); i++, at = next) {
        if (!fs_ifd_read_at(&box, 0, p, (size_t)width)) continue;
        uint32_t from = big(p, width);
        if (!fs_ifd_read_at(&box, (uint64_t)width, p, 2)) continue;
        uint32_t n = big(p, 2);
        for (uint32_t k = 0; k < n && !links->too_many; k++) {
            if (!fs_ifd_read_at(&box, (uint64_t)width + 2 + k * (uint64_t)width, p, (size_t)width)) break;
            if (memcmp(type, "auxl", 4) == 0)
                add_link(links, big(p, width), from);
            else
                add_link(links, from, big(p, width));
        }
    }
}

static void read_links(const Block *file, Links *links)
{
    uint64_t at = 0, inner, next, inner_next;
    Block meta, iref;
    char type[4];
    for (int i = 0; i < MAX_BOXES && fs_boxes_at(file, at, &meta, type, &next); i++, at = next) {
        if (memcmp(type, "meta", 4) != 0) continue;
        inner = 4;
        for (int k = 0; k < MAX_BOXES && fs_boxes_at(&meta, inner, &iref, type, &inner_next); k++, inner = inner_next)
            if (memcmp(type, "iref", 4) == 0) read_references(&iref, links);
    }
}

// Takes away, again and again, what is made of nothing further: what is left goes round, or too deep.
static bool ends(Links *links)
{
    int left = links->n;
    for (int round = 0; round < MAX_DEPTH && left > 0; round++) {
        for (int i = 0; i < left; i++) {
            links->link[i].ends = true;
            for (int k = 0; k < left && links->link[i].ends; k++)
                links->link[i].ends = links->link[k].whole != links->link[i].part;
        }
        int kept = 0;
        for (int i = 0; i < left; i++)
            if (!links->link[i].ends) links->link[kept++] = links->link[i];
        left = kept;
    }
    return left == 0;
}

int fs_heif_links_check(const char *path, FsError *err)
{
    struct stat st;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    Links *links = calloc(1, sizeof *links);
    bool sound = true;
    if (links && fd >= 0 && fstat(fd, &st) == 0 && S_ISREG(st.st_mode)) { // else who reads it will say so
        read_links(&(Block){.fd = fd, .size = (uint64_t)st.st_size}, links);
        sound = !links->too_many && ends(links);
    }
    if (fd >= 0) close(fd);
    int rc = !links ? fs_error_memory(err) : 0;
    free(links);
    if (sound) return rc;
    return fs_error_input(err, "%s: bad HEIF: its pictures are made of one another without end", path);
}
