#include "report/page.h"

#include <ctype.h>
#include <stdarg.h>
#include <string.h>

static void put_text(FILE *f, const char *text)
{
    for (; *text; text++) switch (*text) {
        case '&': fputs("&amp;", f); break;
        case '<': fputs("&lt;", f); break;
        case '>': fputs("&gt;", f); break;
        case '"': fputs("&quot;", f); break;
        case '\'': fputs("&#39;", f); break;
        default: fputc((unsigned char)*text < 32 ? ' ' : *text, f);
        }
}

void fs_html_put(FILE *f, const char *markup, ...)
{
    va_list ap;
    va_start(ap, markup);
    for (; *markup; markup++) {
        if (*markup == '@')
            put_text(f, va_arg(ap, const char *));
        else
            fputc(*markup, f);
    }
    va_end(ap);
}

void fs_html_url(FILE *f, const char *path)
{
    for (; *path; path++) {
        unsigned char c = (unsigned char)*path;
        if ((c < 128 && isalnum(c)) || strchr("/._-~", c))
            fputc(c, f);
        else
            fprintf(f, "%%%02X", c);
    }
}
