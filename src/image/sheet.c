#include "image/sheet.h"

#include <stdlib.h>

#include "image/font.h"

#define MARGIN 6
static const float background[3] = {0.11f, 0.11f, 0.12f}, ink[3] = {0.92f, 0.92f, 0.9f};

static bool is_empty(const SheetTile *tile)
{
    return !tile->image || !tile->image->px;
}

// Left edges of the columns and upper edges of the rows, one more than there are: the last is the sheet's size.
typedef struct Layout {
    int columns, rows;
    int *x, *y;
    int scale, label_height;
} Layout;

// Lengths become the places where they end, `between` apart; false where the sheet would be too long.
static bool add_up(int *edge, int n, int between)
{
    edge[0] = MARGIN;
    for (int i = 1; i <= n; i++) {
        edge[i] += edge[i - 1] + between;
        if (edge[i] > FS_IMAGE_MAX_SIDE) return false;
    }
    return true;
}

static int make_layout(Layout *layout, const SheetTile *tiles, int n, int columns, FsError *err)
{
    *layout = (Layout){.columns = columns < n ? columns : n, .scale = 1};
    layout->rows = (n + layout->columns - 1) / layout->columns;
    layout->x = calloc((size_t)layout->columns + 1, sizeof *layout->x);
    layout->y = calloc((size_t)layout->rows + 1, sizeof *layout->y);
    if (!layout->x || !layout->y) return fs_error_memory(err);
    bool labelled = false;
    for (int i = 0; i < n; i++) {
        labelled |= tiles[i].label && *tiles[i].label;
        if (is_empty(&tiles[i])) continue;
        int *width = &layout->x[i % layout->columns + 1], *height = &layout->y[i / layout->columns + 1];
        if (tiles[i].image->width > *width) *width = tiles[i].image->width;
        if (tiles[i].image->height > *height) *height = tiles[i].image->height;
        if (tiles[i].image->width >= 240) layout->scale = 2;
    }
    layout->label_height = labelled ? (FS_FONT_HEIGHT + 3) * layout->scale : 0;
    if (!add_up(layout->x, layout->columns, MARGIN) || !add_up(layout->y, layout->rows, layout->label_height + MARGIN))
        return fs_error_input(err, "contact sheet of %d tiles: wider or higher than %d pixels, use fewer", n,
                              FS_IMAGE_MAX_SIDE);
    return 0;
}

static void paste(Image *sheet, const Image *tile, int x0, int y0)
{
    for (int y = 0; y < tile->height; y++)
        for (int x = 0; x < tile->width; x++) {
            const float *from = fs_image_at(tile, x, y);
            float *to = fs_image_at(sheet, x0 + x, y0 + y);
            for (int c = 0; c < 3; c++) to[c] = from[tile->channels >= 3 ? c : 0];
        }
}

int fs_sheet_draw(Image *sheet, const SheetTile *tiles, int n, int columns, FsError *err)
{
    *sheet = (Image){0};
    if (n <= 0 || columns <= 0)
        return fs_error_input(err, "contact sheet: %d tiles in %d columns, expected at least one", n, columns);
    Layout layout;
    int rc;
    TRY(make_layout(&layout, tiles, n, columns, err));
    TRY(fs_image_new(sheet, layout.x[layout.columns], layout.y[layout.rows], 3, err));
    for (size_t i = 0; i < fs_image_pixels(sheet); i++)
        for (int c = 0; c < 3; c++) sheet->px[3 * i + (size_t)c] = background[c];
    for (int i = 0; i < n; i++) {
        int x = layout.x[i % layout.columns], y = layout.y[i / layout.columns];
        int x_end = layout.x[i % layout.columns + 1] - MARGIN;
        if (tiles[i].label) fs_font_draw(sheet, x, y + layout.scale, x_end, layout.scale, ink, tiles[i].label);
        if (!is_empty(&tiles[i])) paste(sheet, tiles[i].image, x, y + layout.label_height);
    }
fail:
    free(layout.x);
    free(layout.y);
    if (rc < 0) fs_image_free(sheet);
    return rc;
}

int fs_sheet_write(const char *path, const SheetTile *tiles, int n, int columns, FsError *err)
{
    Image sheet;
    int rc = fs_sheet_draw(&sheet, tiles, n, columns, err);
    if (rc == 0) rc = fs_png_write(path, &sheet, 8, err);
    fs_image_free(&sheet);
    return rc;
}
