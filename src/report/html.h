// Text into HTML, escaped.
#ifndef FS_REPORT_HTML_H
#define FS_REPORT_HTML_H

#include <stdio.h>

void fs_html_text(FILE *f, const char *text); // also good inside "..." attributes
void fs_html_url(FILE *f, const char *path);  // a relative path as a link's address; '/' stays

// The page's style sheet and its script.
extern const char fs_html_style[];
extern const char fs_html_script[];

#endif
