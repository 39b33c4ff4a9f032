// Whether a file's values are proportional to light.
#pragma once

#include <stdbool.h>
#include <stddef.h>

// An ICC profile whose red (or grey) curve is the identity. False for anything else, damaged ones included.
bool fs_profile_is_linear(const void *icc, size_t size);
