#include "image/extent.h"

#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "image/boxes.h"

#define TRUSTED "dng cr2 nef nrw arw rw2 rwl orf pef srw" // files whose directories say the truth about their data
#define SLACK 64                                          // of which a part so small may still be missing

static uint32_t big32(const unsigned char *p)
{
    return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
}

static bool is_cut_tiff(const Block *file, const char *path)
{
    IfdMissing m = fs_ifd_missing(file);
    return m.missing > (m.dng ? 0 : m.all / SLACK) && fs_file_has_ext(path, TRUSTED);
}

static bool is_cut_raf(const Block *file, const unsigned char *head) // Fujifilm: the places of three parts
{
    for (int i = 0; i < 3; i++)
        if ((uint64_t)big32(head + 84 + 8 * i) + big32(head + 88 + 8 * i) > file->size) return true;
    return false;
}

static bool is_cut_crx(const Block *file) // Canon: boxes one after the other
{
    Block inside;
    char type[4];
    uint64_t at = 0, next;
    for (int i = 0; i < 100 && fs_boxes_at(file, at, &inside, type, &next); i++, at = next)
        if (next > file->size) return true;
    return false;
}

int fs_extent_check(const char *path, FsError *err)
{
    struct stat st;
    unsigned char head[108] = {0};
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0 || fstat(fd, &st) != 0 || !S_ISREG(st.st_mode)) {
        if (fd >= 0) close(fd);
        return 0; // who reads it will say so
    }
    Block file = {.fd = fd, .size = (uint64_t)st.st_size};
    bool read = fs_ifd_read_at(&file, 0, head, sizeof head), cut = false;
    if (read && memcmp(head, "FUJIFILMCCD-RAW ", 16) == 0)
        cut = is_cut_raf(&file, head);
    else if (read && memcmp(head + 4, "ftypcrx ", 8) == 0)
        cut = is_cut_crx(&file);
    else if (read)
        cut = is_cut_tiff(&file, path);
    close(fd);
    if (!cut) return 0;
    return fs_error_input(err, "%s: cut short: it ends before its picture does; copy the file again", path);
}
