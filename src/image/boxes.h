// Boxes of ISO media files (ISO/IEC 14496-12): HEIF, AVIF, CR3.
#pragma once

#include "image/ifd.h"

// The box at `at`: what it holds, as far as the block has it, and where the next begins, beyond the block's end where
// this one is cut. False where there is none.
bool fs_boxes_at(const Block *block, uint64_t at, Block *inside, char type[4], uint64_t *next);
