#include "export/codebook.h"

#include <stdlib.h>
#include <string.h>

#include "base/order.h"

#define ROUNDS 30

unsigned char fs_codebook_nearest(const float codebook[CODEBOOK], float value)
{
    int low = 0, high = CODEBOOK - 1; // codebook[low] <= value < codebook[high], but for the ends
    while (high - low > 1) {
        int middle = (low + high) / 2;
        *(codebook[middle] <= value ? &low : &high) = middle;
    }
    double below = (double)value - (double)codebook[low], above = (double)codebook[high] - (double)value;
    return (unsigned char)(below <= above ? low : high);
}

// The first of sorted values that is nearer to b than to a.
static size_t border(const float *sorted, size_t n, float a, float b)
{
    double at = ((double)a + (double)b) / 2;
    size_t low = 0, high = n;
    while (low < high) {
        size_t middle = (low + high) / 2;
        if ((double)sorted[middle] > at)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

// Half of them evenly over the range, so that a few far values have theirs; half where the values are.
static void begin(const float *sorted, size_t n, float codebook[CODEBOOK])
{
    double least = (double)sorted[0], span = (double)sorted[n - 1] - least;
    for (int k = 0; k < CODEBOOK / 2; k++) {
        codebook[2 * k] = (float)(least + span * k / (CODEBOOK / 2 - 1));
        codebook[2 * k + 1] = sorted[(2 * (size_t)k + 1) * n / CODEBOOK];
    }
    fs_order_floats(codebook, CODEBOOK);
}

int fs_codebook_make(const float *value, size_t n, float codebook[CODEBOOK], FsError *err)
{
    memset(codebook, 0, sizeof(float) * CODEBOOK);
    if (n == 0) return 0;
    float *sorted = malloc(sizeof(float) * n);
    if (!sorted) return fs_error_memory(err);
    memcpy(sorted, value, sizeof(float) * n);
    fs_order_floats(sorted, n);
    begin(sorted, n, codebook);
    for (int round = 0; round < ROUNDS; round++) {
        float was[CODEBOOK];
        memcpy(was, codebook, sizeof was);
        size_t from = 0;
        for (int k = 0; k < CODEBOOK; k++) {
            size_t to = k + 1 < CODEBOOK ? border(sorted, n, was[k], was[k + 1]) : n;
            double sum = 0;
            for (size_t i = from; i < to; i++) sum += (double)sorted[i];
            if (to > from) codebook[k] = (float)(sum / (double)(to - from));
            from = to > from ? to : from;
        }
        if (memcmp(was, codebook, sizeof was) == 0) break;
    }
    free(sorted);
    return 0;
}
