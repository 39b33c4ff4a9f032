#include "report/text7.h"

#include <stdint.h>
#include <string.h>
#include <zlib.h>

#define BUFFER 65536

typedef struct Writer {
    FILE *f;
    uint32_t bits;
    int n;    // bits that wait
    int last; // the character before
} Writer;

// What a string of JavaScript cannot hold as it is. NUL could, but would make the file a binary one to many.
static void put_character(Writer *w, int c)
{
    switch (c) {
    case 0: fputs("\\0", w->f); break;
    case '\n': fputs("\\n", w->f); break;
    case '\r': fputs("\\r", w->f); break;
    case '"': fputs("\\\"", w->f); break;
    case '\\': fputs("\\\\", w->f); break;
    default:
        if (w->last == 0 && c >= '0' && c <= '9')
            fprintf(w->f, "\\x%02x", c); // \0 and a digit would be another number
        else
            fputc(c, w->f);
    }
    w->last = c;
}

static void put_bytes(Writer *w, const unsigned char *byte, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        w->bits |= (uint32_t)byte[i] << w->n;
        for (w->n += 8; w->n >= 7; w->n -= 7, w->bits >>= 7) put_character(w, (int)(w->bits & 127));
    }
}

static int deflate_chunk(Writer *w, z_stream *z, const TextChunk *chunk, int flush)
{
    unsigned char buffer[BUFFER];
    size_t done = 0;
    do {
        if (z->avail_in == 0 && done < chunk->n) {
            size_t part = chunk->n - done < BUFFER ? chunk->n - done : BUFFER;
            z->next_in = (unsigned char *)chunk->byte + done; // zlib takes no const
            z->avail_in = (unsigned)part;
            done += part;
        }
        z->next_out = buffer;
        z->avail_out = BUFFER;
        int code = deflate(z, done < chunk->n ? Z_NO_FLUSH : flush);
        put_bytes(w, buffer, BUFFER - z->avail_out);
        if (code == Z_STREAM_END) return 0;
        if (code != Z_OK && code != Z_BUF_ERROR) return -1;
    } while (done < chunk->n || z->avail_in > 0 || z->avail_out == 0);
    return 0;
}

int fs_text7_write(FILE *f, const TextChunk *chunk, int chunks, FsError *err)
{
    static const TextChunk end;
    Writer w = {.f = f, .last = -1};
    z_stream z;
    memset(&z, 0, sizeof z);
    if (deflateInit(&z, Z_BEST_COMPRESSION) != Z_OK) return fs_error_memory(err);
    fputc('"', f);
    int rc = 0;
    for (int i = 0; i <= chunks && rc == 0; i++)
        rc = deflate_chunk(&w, &z, i < chunks ? &chunk[i] : &end, i < chunks ? Z_NO_FLUSH : Z_FINISH);
    deflateEnd(&z);
    if (w.n) put_character(&w, (int)(w.bits & 127));
    fputc('"', f);
    return rc < 0 ? fs_error_memory(err) : 0;
}
