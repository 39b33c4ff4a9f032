// One photo to its working image and mask.
#ifndef FS_INGEST_DEVELOP_H
#define FS_INGEST_DEVELOP_H

#include "ingest/shots.h"

// Writes <dir>/<name>.tif and <dir>/<name>_mask.png; fills the shot's sizes and figures, or its failure.
void fs_develop_shot(const Shots *shots, Shot *shot, const char *dir, int long_edge);

#endif
