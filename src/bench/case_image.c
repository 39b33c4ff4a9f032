// The image-space kernels on random pictures, in strips of 32 rows as the training step calls them.
#include <stdlib.h>

#include "base/rng.h"
#include "bench/case.h"

enum { STRIP = 32 };
enum { T, R, BETA, I, Y, MU, VAR, MASK, T_LINEAR, R_LINEAR, I_LINEAR, D_I, D_T, D_R, D_BETA };

typedef struct ImageState {
    Kernels kernels;
    Planes plane[D_BETA + 1];
    ComposeArgs compose;
    PhotometricArgs photometric;
    PearsonArgs pearson;
    SmoothArgs smooth;
    void *memory, *scratch;
    double sink;
} ImageState;

#define FOR_STRIPS(s, y0, y1)                                                                                          \
    for (int y0 = 0, y1 = STRIP < (s)->plane[T].height ? STRIP : (s)->plane[T].height; y0 < (s)->plane[T].height;      \
         y0 = y1, y1 = y1 + STRIP < (s)->plane[T].height ? y1 + STRIP : (s)->plane[T].height)

static int channels_of(int plane)
{
    return plane == BETA || plane == MASK || plane == D_BETA ? 1 : 3;
}

static void point_args(ImageState *s)
{
    Planes *p = s->plane;
    s->compose = (ComposeArgs){&p[T],        &p[R],   &p[BETA], &p[I],   &p[T_LINEAR], &p[R_LINEAR],
                               &p[I_LINEAR], &p[D_I], &p[D_T],  &p[D_R], &p[D_BETA]};
    s->photometric = (PhotometricArgs){&p[I], &p[Y], &p[MU], &p[VAR], &p[MASK], 0, 0.1f, 1.0f, &p[D_I], s->scratch};
    s->pearson = (PearsonArgs){&p[T], &p[R], &p[T_LINEAR], &p[R_LINEAR], &p[D_T], &p[D_R], 0.1f};
    s->smooth = (SmoothArgs){&p[BETA], 2.0f, 0.1f, &p[D_BETA]};
}

void *fs_case_image_open(const BenchMachine *machine, const BenchCase *what)
{
    ImageState *s = calloc(1, sizeof *s);
    if (!s) return NULL;
    size_t plane = (size_t)fs_planes_stride(what->width) * (size_t)what->height, n = 0;
    for (int i = T; i <= D_BETA; i++) n += plane * (size_t)channels_of(i);
    s->memory = aligned_alloc(64, n * sizeof(float));
    s->scratch = aligned_alloc(64, fs_photometric_scratch(what->width));
    if (!s->memory || !s->scratch) {
        fs_case_image_close(s);
        return NULL;
    }
    Rng rng = fs_rng_new(1);
    float *px = s->memory;
    for (size_t i = 0; i < n; i++) px[i] = fs_rng_uniform(&rng);
    for (int i = T; i <= D_BETA; i++) {
        s->plane[i] = (Planes){what->width, what->height, channels_of(i), fs_planes_stride(what->width), px};
        px += plane * (size_t)channels_of(i);
    }
    s->kernels = machine->kernels;
    point_args(s);
    s->kernels.compose->forward(&s->compose, 0, what->height);
    s->kernels.photometric->target_stats(&s->photometric, 0, what->height);
    return s;
}

void fs_case_image_close(void *state)
{
    ImageState *s = state;
    free(s->memory);
    free(s->scratch);
    free(s);
}

static BenchWork work_of(const ImageState *s, int channels)
{
    return (BenchWork){.pairs = (double)channels * s->plane[T].width * s->plane[T].height};
}

BenchWork fs_case_image_compose_forward(void *state)
{
    ImageState *s = state;
    FOR_STRIPS(s, y0, y1) s->kernels.compose->forward(&s->compose, y0, y1);
    return work_of(s, 3);
}
BenchWork fs_case_image_compose_backward(void *state)
{
    ImageState *s = state;
    FOR_STRIPS(s, y0, y1) s->kernels.compose->backward(&s->compose, y0, y1);
    return work_of(s, 3);
}
BenchWork fs_case_image_photometric(void *state)
{
    ImageState *s = state;
    FOR_STRIPS(s, y0, y1) s->sink += s->kernels.photometric->loss(&s->photometric, y0, y1).l1;
    return work_of(s, 3);
}
BenchWork fs_case_image_pearson(void *state)
{
    ImageState *s = state;
    PearsonSums t = {0};
    FOR_STRIPS(s, y0, y1)
    {
        PearsonSums p = s->kernels.pearson->sums(&s->pearson, y0, y1);
        t = (PearsonSums){t.n + p.n, t.x + p.x, t.y + p.y, t.xx + p.xx, t.yy + p.yy, t.xy + p.xy};
    }
    FOR_STRIPS(s, y0, y1) s->kernels.pearson->gradient(&s->pearson, &t, y0, y1);
    return work_of(s, 3);
}
BenchWork fs_case_image_smooth(void *state)
{
    ImageState *s = state;
    FOR_STRIPS(s, y0, y1) s->sink += s->kernels.smooth->loss(&s->smooth, y0, y1);
    return work_of(s, 1);
}
