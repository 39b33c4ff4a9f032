// An MP4 out of pictures: H.264 where FFmpeg's libraries have libx264, else MPEG-4 part 2; yuv420p, even size.
#pragma once

#include "base/log.h"
#include "image/image.h"

typedef struct Video Video;

// Pictures will be width x height; an odd last column or row is cut off. The file appears when the video is finished.
int fs_video_open(Video **video, const char *path, int width, int height, int frames_per_second, const Log *log,
                  FsError *err);
int fs_video_add(Video *video, const Image *picture, FsError *err); // 3 channels, display values 0..1 (BT.709)
int fs_video_finish(Video *video, FsError *err);                    // writes what is left; frees either way
void fs_video_abort(Video *video);                                  // leaves no file; accepts NULL
