#include "render/pictures.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/owned.h"
#include "image/colormap.h"
#include "image/sheet.h"
#include "model/preview.h"
#include "render/video.h"

// ---- the contact sheet ----

#define SHEET_VIEWS 4
#define SHEET_COLUMNS 6
#define SHEET_EDGE 360
#define SHEET_TILES (SHEET_VIEWS * SHEET_COLUMNS)

struct PictureSheet {
    int chosen[SHEET_VIEWS], n_chosen;
    Image picture[SHEET_TILES];
    char label[SHEET_TILES][80];
    int n;
};

int fs_pictures_sheet_begin(PictureSheet **result, const Dataset *photos, FsError *err)
{
    PictureSheet *sheet = *result = calloc(1, sizeof *sheet);
    if (!sheet) return fs_error_memory(err);
    sheet->n_chosen = fs_preview_choose(photos, SHEET_VIEWS, sheet->chosen);
    return 0;
}

bool fs_pictures_sheet_wants(const PictureSheet *sheet, int view)
{
    for (int i = 0; i < sheet->n_chosen; i++)
        if (sheet->chosen[i] == view) return true;
    return false;
}

static int add_tile(PictureSheet *sheet, const Image *image, bool depth, const Look *look, const char *label,
                    FsError *err)
{
    Image full = {0}, *picture = &sheet->picture[sheet->n];
    int rc = 0;
    snprintf(sheet->label[sheet->n++], sizeof sheet->label[0], "%s", label);
    if (depth) {
        TRY(fs_colormap_depth(image, look->nearest, look->farthest, &full, err));
        TRY(fs_preview_shrink(&full, SHEET_EDGE, picture, err));
    } else if (image->px) {
        TRY(fs_preview_picture(image, SHEET_EDGE, &look->light, picture, err));
    }
fail:
    fs_image_free(&full);
    return rc;
}

int fs_pictures_sheet_add(PictureSheet *sheet, const Look *look, const Image *photo, const View *view,
                          const Renders *renders, FsError *err)
{
    if (sheet->n + SHEET_COLUMNS > SHEET_TILES) return 0;
    char label[80];
    const RenderLayer layers[] = {view->flash ? RENDER_I_F : RENDER_I_N, RENDER_T_N, RENDER_T_F, RENDER_R,
                                  RENDER_DEPTH_T};
    snprintf(label, sizeof label, "%.40s%s", view->name, view->flash ? " flash" : "");
    MUST(add_tile(sheet, photo, false, look, label, err));
    for (size_t i = 0; i < sizeof layers / sizeof *layers; i++) {
        const RenderLayerInfo *info = &fs_render_layers[layers[i]];
        MUST(add_tile(sheet, &renders->layer[layers[i]], info->depth, look, info->name, err));
    }
    return 0;
}

int fs_pictures_sheet_write(PictureSheet *sheet, const char *path, FsError *err)
{
    SheetTile tiles[SHEET_TILES];
    for (int i = 0; i < sheet->n; i++) tiles[i] = (SheetTile){&sheet->picture[i], sheet->label[i]};
    return sheet->n ? fs_sheet_write(path, tiles, sheet->n, SHEET_COLUMNS, err) : 0;
}

void fs_pictures_sheet_free(PictureSheet *sheet)
{
    if (!sheet) return;
    for (int i = 0; i < SHEET_TILES; i++) fs_image_free(&sheet->picture[i]);
    free(sheet);
}

// ---- films ----

#define FRAMES_PER_SECOND 30
#define MAX_FILM_SIDE 16384 // x264's
enum { FILM_COMPOSITE, FILM_T, FILM_R, FILM_LAYERS, FILM_SIDE_BY_SIDE = FILM_LAYERS, FILMS };

static const struct {
    const char *name;
    RenderLayer layer;
} films_table[FILMS] = {
    [FILM_COMPOSITE] = {"composite", RENDER_I_N},
    [FILM_T] = {"T", RENDER_T_N},
    [FILM_R] = {"R", RENDER_R},
    [FILM_SIDE_BY_SIDE] = {"side_by_side", RENDER_LAYERS},
};

struct Films {
    Video *video[FILMS];
    Image wide; // composite, T, R beside one another; of none where that is wider than films can be
};

int fs_pictures_films_begin(Films **result, const char *dir, int width, int height, const Log *log, FsError *err)
{
    *result = NULL;
    Films *films = calloc(1, sizeof *films);
    if (!films) return fs_error_memory(err);
    int rc;
    TRY(fs_file_mkdirs(dir, err));
    bool beside = FILM_LAYERS * width <= MAX_FILM_SIDE;
    if (beside) TRY(fs_image_new(&films->wide, FILM_LAYERS * width, height, 3, err));
    if (!beside)
        fs_log_warn(log, "render: no film of the layers side by side: %d pixels are wider than films can be (%d)",
                    FILM_LAYERS * width, MAX_FILM_SIDE);
    for (int i = 0; i < (beside ? FILMS : FILM_LAYERS); i++) {
        FilePath path = fs_file_at("%s/%s.mp4", dir, films_table[i].name);
        int film_width = i == FILM_SIDE_BY_SIDE ? FILM_LAYERS * width : width;
        TRY(fs_owned_check(path.text, err));
        TRY(fs_video_open(&films->video[i], path.text, film_width, height, FRAMES_PER_SECOND, log, err));
    }
    *result = films;
    return 0;
fail:
    fs_pictures_films_abort(films);
    return rc;
}

int fs_pictures_films_add(Films *films, const Look *look, const Renders *renders, FsError *err)
{
    Image picture = {0};
    int rc;
    for (int i = 0; i < FILM_LAYERS; i++) {
        TRY(fs_preview_picture(&renders->layer[films_table[i].layer], 0, &look->light, &picture, err));
        TRY(fs_video_add(films->video[i], &picture, err));
        size_t row = (size_t)picture.width * 3;
        for (int y = 0; y < films->wide.height; y++)
            memcpy(films->wide.px + ((size_t)y * FILM_LAYERS + (size_t)i) * row, picture.px + (size_t)y * row,
                   row * sizeof(float));
        fs_image_free(&picture);
    }
    if (films->video[FILM_SIDE_BY_SIDE]) TRY(fs_video_add(films->video[FILM_SIDE_BY_SIDE], &films->wide, err));
fail:
    fs_image_free(&picture);
    return rc;
}

int fs_pictures_films_finish(Films *films, FsError *err)
{
    int rc = 0;
    for (int i = 0; i < FILMS && rc == 0; i++) {
        if (!films->video[i]) continue;
        rc = fs_video_finish(films->video[i], err);
        films->video[i] = NULL;
    }
    fs_pictures_films_abort(films);
    return rc;
}

void fs_pictures_films_abort(Films *films)
{
    if (!films) return;
    for (int i = 0; i < FILMS; i++) fs_video_abort(films->video[i]);
    fs_image_free(&films->wide);
    free(films);
}
