// Stroke lettering on a grid 0..4 by 0..6, and words to write with it.
#pragma once

#include "base/rng.h"

// Strokes of a character: points "xy", strokes parted by blanks; NULL for characters without one.
const char *fs_letters_strokes(char c);
const char *fs_letters_word(Rng *rng);
// Fills buf with words parted by blanks, at most n - 1 characters, whole words.
void fs_letters_words(Rng *rng, int words, char *buf, int n);
