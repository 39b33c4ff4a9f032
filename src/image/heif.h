// HEIC, HEIF and AVIF.
#pragma once

#include "image/ifd.h"
#include "image/profile.h"

// 8 to 16 bits as 0..1, encoded values; turned upright.
int fs_heif_read(const char *path, Image *image, FsError *err);
int fs_heif_read_tag(const char *path, LightTag *tag, FsError *err);
void fs_heif_read_exif(const char *path, ExifInfo *info); // unknown fields stay
int fs_heif_links_check(const char *path, FsError *err);  // heif_links.c; before libheif sees the file
bool fs_heif_is(const unsigned char head[12]);            // a file's first bytes
