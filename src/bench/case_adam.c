// Adam over the means of n Gaussians, of which runs in space are visible.
#include <stdlib.h>

#include "base/rng.h"
#include "bench/case.h"

typedef struct AdamState {
    const AdamKernels *kernel;
    float *memory; // x, gradient, m, v
    unsigned char *visible;
    size_t n;
    double seen;
} AdamState;

void *fs_case_adam_open(const BenchMachine *machine, const BenchCase *what)
{
    AdamState *s = calloc(1, sizeof *s);
    if (!s) return NULL;
    s->kernel = machine->kernels.adam;
    s->n = (size_t)what->n;
    s->memory = calloc(s->n * 12, sizeof(float));
    s->visible = calloc(s->n, 1);
    if (!s->memory || !s->visible) {
        fs_case_adam_close(s);
        return NULL;
    }
    Rng rng = fs_rng_new(2);
    for (size_t i = 0; i < s->n * 6; i++) s->memory[i] = fs_rng_normal(&rng);
    for (size_t i = 0; i < s->n; i += 256) { // neighbours in memory are neighbours in space
        unsigned char visible = fs_rng_uniform(&rng) < (float)what->wanted;
        for (size_t k = i; k < i + 256 && k < s->n; k++) s->seen += s->visible[k] = visible;
    }
    return s;
}

void fs_case_adam_close(void *state)
{
    AdamState *s = state;
    free(s->memory);
    free(s->visible);
    free(s);
}

BenchWork fs_case_adam_call(void *state)
{
    AdamState *s = state;
    size_t n = s->n * 3;
    AdamFields fields = {s->memory, s->memory + n, s->memory + 2 * n, s->memory + 3 * n};
    s->kernel->step_sparse(&fields, s->n, 3, s->visible, fs_adam_rate(1e-4, 100));
    return (BenchWork){.pairs = (double)n, .flops = s->seen * 3 * 13, .bytes = s->seen * 3 * 28};
}
