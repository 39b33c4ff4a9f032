#include "base/order.h"

#include <stdlib.h>
#include <string.h>

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

static int compare_ranked(const void *a, const void *b)
{
    const Ranked *x = a, *y = b;
    if (x->by != y->by) return x->by < y->by ? -1 : 1;
    return (x->index > y->index) - (x->index < y->index);
}

static int compare_named(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
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

void fs_order_ranked(Ranked *item, size_t n)
{
    qsort(item, n, sizeof *item, compare_ranked);
}

void fs_order_named(void *item, size_t n, size_t size)
{
    if (n) qsort(item, n, size, compare_named);
}
