#include "image/sizes.h"

#include <math.h>

void fs_sizes_clear(PhotoSizes *sizes)
{
    sizes->width = sizes->height = 0;
    sizes->white = 1;
    for (int i = 0; i < sizes->n; i++) sizes->size[i] = (PhotoSize){.long_edge = sizes->size[i].long_edge};
}

int fs_sizes_begin(PhotoSizes *sizes, int width, int height, FsError *err)
{
    sizes->width = width;
    sizes->height = height;
    for (int i = 0; i < sizes->n; i++) {
        PhotoSize *s = &sizes->size[i];
        int w = width, h = height;
        fs_image_limit(s->long_edge, &w, &h);
        MUST(fs_image_new(&s->rgb, w, h, 3, err));
        MUST(fs_image_new(&s->clipped, w, h, 1, err));
        MUST(fs_resize_begin(&s->of_rgb, width, height, &s->rgb, err));
        MUST(fs_resize_begin(&s->of_clipped, width, height, &s->clipped, err));
    }
    return 0;
}

void fs_sizes_whiten(const PhotoSizes *sizes, float *rgb, const float *clipped)
{
    for (int x = 0; x < sizes->width; x++)
        for (int c = 0; c < 3 && clipped[x] > 0; c++) rgb[3 * x + c] = fminf(rgb[3 * x + c], sizes->white);
}

void fs_sizes_row(PhotoSizes *sizes, const float *rgb, const float *clipped)
{
    for (int i = 0; i < sizes->n; i++) {
        fs_resize_row(&sizes->size[i].of_rgb, rgb);
        fs_resize_row(&sizes->size[i].of_clipped, clipped);
    }
}

void fs_sizes_end(PhotoSizes *sizes)
{
    for (int i = 0; i < sizes->n; i++) {
        fs_resize_end(&sizes->size[i].of_rgb);
        fs_resize_end(&sizes->size[i].of_clipped);
    }
}

void fs_sizes_free(PhotoSizes *sizes)
{
    fs_sizes_end(sizes);
    for (int i = 0; i < sizes->n; i++) {
        fs_image_free(&sizes->size[i].rgb);
        fs_image_free(&sizes->size[i].clipped);
    }
}
