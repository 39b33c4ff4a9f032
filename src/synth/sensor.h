// The camera: from linear light to a noisy Bayer mosaic, and from that to the picture a camera would make of it.
#pragma once

#include <stdint.h>

#include "base/rng.h"
#include "synth/style.h"

#define SENSOR_BLACK 512
#define SENSOR_WHITE 16383
// Sensitivity to white of the red, green and blue pixels (the DNG's AsShotNeutral). But for these factors the sensor's
// primaries are those of sRGB.
#define SENSOR_NEUTRAL                                                                                                 \
    {                                                                                                                  \
        10.0 / 21.0, 1.0, 2.0 / 3.0                                                                                    \
    }

typedef struct Mosaic {
    int width, height;
    uint16_t *px; // (height, width), RGGB, SENSOR_BLACK .. SENSOR_WHITE
} Mosaic;

void fs_sensor_mosaic_free(Mosaic *mosaic);
// linear: white-balanced, 1.0 = green pixels full. The higher the ISO, the fewer electrons fill them.
int fs_sensor_expose(const Image *linear, int iso, Rng rng, Mosaic *mosaic, FsError *err);
double fs_sensor_clipped(const Mosaic *mosaic); // share of the pixels that are full
// Demosaiced, white-balanced (balance: what the camera thinks right, of what is right), coded in the camera's style.
int fs_sensor_develop(const Mosaic *mosaic, const float balance[3], const CameraStyle *style, Image *image,
                      FsError *err);
