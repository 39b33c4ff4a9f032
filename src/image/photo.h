// A photo of any format: what its headers say, and its picture in linear light.
#pragma once

#include "image/exif.h"
#include "image/npy.h"
#include "image/profile.h"
#include "image/sizes.h"

typedef enum PhotoKind { PHOTO_RAW, PHOTO_NPY, PHOTO_HEIF, PHOTO_JPEG, PHOTO_PNG, PHOTO_TIFF } PhotoKind;
int fs_photo_kind(const char *path); // by the one table of extensions; -1: none of a photo
// What readers take it for: the same, but a JPEG, PNG, HEIF or TIFF under another's name is known by its first bytes.
PhotoKind fs_photo_kind_inside(const char *path);

typedef enum PhotoLight {
    PHOTO_LIGHT,   // its values were proportional to light
    PHOTO_UNTOLD,  // they were taken to be: more than 8 bits, and nothing said
    PHOTO_ENCODED, // display values, brought back by their curve: reduced quality
    PHOTO_UNREAD,  // the same, by sRGB's, since the colour profile that is there cannot be read
} PhotoLight;

// exif: with the gaps filled from what LibRaw knows. white_balance: as shot (or daylight), green 1; 0 where unknown.
// memory: bytes that fs_photo_read takes beside what it makes; may be NULL.
int fs_photo_read_info(const char *path, ExifInfo *exif, double white_balance[3], double *memory, FsError *err);
// The picture in the sizes wanted (the caller frees them), linear, 1.0 = white; clipped where a channel was at its
// limit or is no number. As stored: orientation not applied. levels: of RAW files the gains, of .npy all. What is
// neither comes in the primaries of sRGB, as its colour profile says.
int fs_photo_read(const char *path, const SensorLevels *levels, PhotoSizes *sizes, PhotoLight *light, FsError *err);

// The space to write what is made of a photo in: wide where its own colours are wider than sRGB. RAW: PROFILE_SRGB.
int fs_photo_space(const char *path, ProfileSpace *space, FsError *err);
// JPEG, PNG, TIFF or HEIF with the values it has; not RAW, not .npy.
int fs_photo_read_stored(const char *path, Image *image, FsError *err);
