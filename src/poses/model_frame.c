#include "poses/model_frame.h"

#include <math.h>
#include <string.h>

#include "base/file.h"
#include "image/photo.h"

#define MOST_LEFT_OUT 0.03 // of a side, by cameras' JPEGs: sensors are read up to 1 % further

// How unlike two pictures' shapes are.
static double unlike(double width, double height, double other_width, double other_height)
{
    return fabs(log(width / height * other_height / other_width));
}

// Whether the model is of the photo as it is stored. A quarter of a turn shows in the picture's shape; half a turn does
// not, so that the model must name the very file, and one that COLMAP reads without turning it.
static bool is_as_stored(const Photo *photo, const Lens *lens, const char *file, int quarters)
{
    double w = photo->picture_width, h = photo->picture_height;
    if (quarters != 2) return unlike(lens->width, lens->height, h, w) < unlike(lens->width, lens->height, w, h);
    return strcasecmp(fs_file_name(file), fs_file_name(photo->file)) == 0 && fs_photo_kind(photo->file) > PHOTO_NPY;
}

ModelFrame fs_model_frame(const Photo *photo, const Lens *lens, const char *file)
{
    static const int quarters_of[9] = {[6] = 1, [3] = 2, [8] = 3}; // mirrored ones are nobody's photos
    int quarters = quarters_of[photo->orientation];
    if (!file || !is_as_stored(photo, lens, file, quarters)) quarters = 0;
    bool aside = quarters % 2 == 1;
    ModelFrame frame = {quarters, {0, 0}, aside ? lens->height : lens->width, aside ? lens->width : lens->height};
    int more[2] = {photo->orig_width - frame.width, photo->orig_height - frame.height};
    bool cropped = file && more[0] >= 0 && more[1] >= 0 && more[0] <= MOST_LEFT_OUT * photo->orig_width &&
                   more[1] <= MOST_LEFT_OUT * photo->orig_height;
    if (!cropped) return frame;
    for (int i = 0; i < 2; i++) frame.margin[i] = 0.5 * more[i];
    frame.width += more[0];
    frame.height += more[1];
    return frame;
}

Lens fs_model_frame_lens(const ModelFrame *frame, const Lens *lens)
{
    Lens whole = fs_lens_turned(lens, frame->quarters);
    return fs_lens_padded(&whole, frame->margin, frame->width, frame->height);
}

void fs_model_frame_pose(const ModelFrame *frame, double w2c[12])
{
    for (int i = 0; i < frame->quarters; i++) {
        double was[4];
        memcpy(was, w2c, sizeof was);
        for (int k = 0; k < 4; k++) w2c[k] = -w2c[4 + k];
        memcpy(w2c + 4, was, sizeof was);
    }
}

void fs_model_frame_pixel(const ModelFrame *frame, const Lens *lens, double xy[2])
{
    double height = lens->height, width = lens->width;
    for (int i = 0; i < frame->quarters; i++) {
        double was = xy[0], side = height;
        xy[0] = height - xy[1];
        xy[1] = was;
        height = width;
        width = side;
    }
    xy[0] += frame->margin[0];
    xy[1] += frame->margin[1];
}
