#include "export/zip.h"

#include <string.h>
#include <zlib.h>

enum { LOCAL = 30, CENTRAL = 46, END = 22, MOST = 16 };

static unsigned char *put(unsigned char *to, uint32_t value, int bytes)
{
    for (int k = 0; k < bytes; k++) *to++ = (unsigned char)(value >> 8 * k);
    return to;
}

static uint32_t checksum(const ZipEntry *entry)
{
    return (uint32_t)crc32_z(0, entry->data, entry->size);
}

// What the header before a file and that in the directory at the end have in common.
static unsigned char *put_common(unsigned char *to, const ZipEntry *entry)
{
    to = put(to, 10, 2);         // version to read it
    to = put(to, 0, 4);          // flags; method: stored
    to = put(to, 0x00210000, 4); // 1980-01-01: the earliest there is
    to = put(to, checksum(entry), 4);
    to = put(to, (uint32_t)entry->size, 4);
    to = put(to, (uint32_t)entry->size, 4);
    to = put(to, (uint32_t)strlen(entry->name), 2);
    return put(to, 0, 2); // nothing extra
}

int fs_zip_write(const ZipEntry *entry, int n, const char *path, FsError *err)
{
    uint64_t total = END;
    uint32_t offset[MOST], at = 0, directory;
    unsigned char header[CENTRAL];
    AtomicFile file;
    for (int i = 0; i < n; i++) total += LOCAL + CENTRAL + 2 * strlen(entry[i].name) + entry[i].size;
    if (n > MOST || total > UINT32_MAX) return fs_error_input(err, "%s: too large for a ZIP archive", path);
    MUST(fs_file_begin(&file, path, err));
    for (int i = 0; i < n; i++) {
        offset[i] = at;
        put_common(put(header, 0x04034b50, 4), &entry[i]);
        fwrite(header, LOCAL, 1, file.f);
        fputs(entry[i].name, file.f);
        fwrite(entry[i].data, 1, entry[i].size, file.f);
        at += (uint32_t)(LOCAL + strlen(entry[i].name) + entry[i].size);
    }
    directory = at;
    for (int i = 0; i < n; i++) {
        memset(header, 0, sizeof header);
        put_common(put(put(header, 0x02014b50, 4), 10, 2), &entry[i]);
        put(header + 42, offset[i], 4);
        fwrite(header, CENTRAL, 1, file.f);
        fputs(entry[i].name, file.f);
        at += (uint32_t)(CENTRAL + strlen(entry[i].name));
    }
    unsigned char *to = put(put(header, 0x06054b50, 4), 0, 4);
    to = put(put(to, (uint32_t)n, 2), (uint32_t)n, 2);
    put(put(put(to, at - directory, 4), directory, 4), 0, 2);
    fwrite(header, END, 1, file.f);
    return fs_file_commit(&file, err);
}
