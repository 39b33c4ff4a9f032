// Numbers, and what has a number or a name, in order.
#pragma once

#include <stdbool.h>
#include <stddef.h>

void fs_order_floats(float *value, size_t n); // rising
void fs_order_doubles(double *value, size_t n);
// The middle one, of an even number the upper one in the middle; 0 of none. Puts them in order.
double fs_order_median(double *value, size_t n);

typedef struct Ranked { // what an index means, by a number
    double by;
    int index;
} Ranked;
void fs_order_ranked(Ranked *item, size_t n); // rising, equal ones by index
// Whether the i-th of n things is one of some, spread evenly, `most` or all of them.
static inline bool fs_order_is_some(int i, int n, int most)
{
    return n <= most || i == 0 || (long long)i * most / n != (i - 1LL) * most / n;
}
// n structs of `size` bytes that begin with their name (char *), by that.
void fs_order_named(void *item, size_t n, size_t size);
