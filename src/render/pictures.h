// Pictures and films for people: OUT/sheet.png and the MP4s, all with one exposure and the pleasant tone curve.
#pragma once

#include "base/log.h"
#include "engine/engine.h"
#include "model/dataset.h"
#include "model/preview.h"

// How to show a scene: filled once per run.
typedef struct Look {
    PreviewLight light;
    float nearest, farthest; // range of the depth colours, world units
} Look;

// The contact sheet of a handful of views: photo, composite, T_N, T_F, R, depth. Rows are added as they are rendered.
typedef struct PictureSheet PictureSheet;
int fs_pictures_sheet_begin(PictureSheet **sheet, const Dataset *photos, FsError *err);
bool fs_pictures_sheet_wants(const PictureSheet *sheet, int view); // index in photos
int fs_pictures_sheet_add(PictureSheet *sheet, const Look *look, const Image *photo, const View *view,
                          const Renders *renders, FsError *err);
int fs_pictures_sheet_write(PictureSheet *sheet, const char *path, FsError *err); // PNG
void fs_pictures_sheet_free(PictureSheet *sheet);                                 // accepts NULL

// The films composite.mp4, T.mp4, R.mp4 and side_by_side.mp4 of a camera path.
typedef struct Films Films;
// Into dir, with frames of width x height pixels.
int fs_pictures_films_begin(Films **films, const char *dir, int width, int height, const Log *log, FsError *err);
int fs_pictures_films_add(Films *films, const Look *look, const Renders *renders, FsError *err);
int fs_pictures_films_finish(Films *films, FsError *err); // frees either way
void fs_pictures_films_abort(Films *films);               // accepts NULL
