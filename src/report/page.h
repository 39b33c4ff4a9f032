// The page itself: sections in the order a person reads them.
#ifndef FS_REPORT_PAGE_H
#define FS_REPORT_PAGE_H

#include <stdio.h>

#include "report/charts.h"
#include "report/previews.h"

typedef struct Page {
    const FsProject *project;
    const Dataset *dataset;
    PreviewSet previews;
    Curve curve;
} Page;

void fs_page_write(FILE *f, const Page *page);

#endif
