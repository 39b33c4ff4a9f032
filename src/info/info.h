// Describes what a path is: a project folder, a camera model, a PLY, a photo. Lines go out through the log.
#pragma once

#include "base/log.h"
#include "base/error.h"

// FS_ERR_INPUT where it is none of these.
int fs_info_run(const char *path, const Log *log, FsError *err);

// The pictures and files of a project that a person would open first, one log line each.
void fs_info_results(const char *out, const Log *log);

// Private to info*.c.
int fs_info_project(const char *out, const Log *log, FsError *err);
int fs_info_ply(const char *path, const Log *log, FsError *err);
int fs_info_ply_count(const char *path); // of its vertices, from the header alone; -1 when it is not a PLY
int fs_info_cameras(const char *path, const Log *log, FsError *err);
int fs_info_photo(const char *path, const Log *log, FsError *err);
int fs_info_photos(const char *folder, const Log *log, FsError *err);
void fs_info_size(double bytes, char *buf, size_t n); // "12.3 MB"
