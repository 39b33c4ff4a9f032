// Numbers in order.
#pragma once

#include <stddef.h>

void fs_order_floats(float *value, size_t n); // rising
void fs_order_doubles(double *value, size_t n);
// The middle one, of an even number the upper one in the middle; 0 of none. Puts them in order.
double fs_order_median(double *value, size_t n);
