#include "base/order.h"

#include <stdlib.h>

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void fs_order_floats(float *value, size_t n)
{
    qsort(value, n, sizeof *value, compare_floats);
}

void fs_order_doubles(double *value, size_t n)
{
    qsort(value, n, sizeof *value, compare_doubles);
}

double fs_order_median(double *value, size_t n)
{
    fs_order_doubles(value, n);
    return n ? value[n / 2] : 0;
}
