// Smoothness of the flash gain over neighbouring Gaussians: alpha follows ambient shading and angle to the flash, which
// vary slowly over a surface, while the surface's texture does not enter it. A robust (L1-like) penalty lets it bend
// at edges.
//
//   L = mean over i of mean over its nearest neighbours j of phi(g_i - g_j),   phi(x) = sqrt(x^2 + e^2) - e
#include <math.h>
#include <stdlib.h>

#include "base/knn.h"
#include "train/trainer.h"

#define EPSILON 0.05f
#define CHUNK 1024

int fs_gains_find_neighbours(Trainer *trainer, FsError *err)
{
    const Cloud *cloud = &trainer->scene.cloud[LAYER_T_N];
    CloudState *state = &trainer->state[LAYER_T_N];
    free(state->neighbour);
    state->neighbour = NULL;
    if (!cloud->width[CLOUD_GAINS] || trainer->set->gain_smooth <= 0 || cloud->n <= TRAIN_NEIGHBOURS) return 0;
    state->neighbour = malloc(sizeof(int) * TRAIN_NEIGHBOURS * (size_t)cloud->n);
    if (!state->neighbour) return fs_error_memory(err);
    int rc =
        fs_knn(cloud->field[CLOUD_MEANS], cloud->n, TRAIN_NEIGHBOURS, state->neighbour, NULL, trainer->engine->threads);
    return rc < 0 ? fs_error_set(err, rc, "training: a Gaussian's position is not finite") : 0;
}

typedef struct Smooth {
    const Cloud *cloud;
    const int *neighbour;
    float *d_gains, weight;
    double *part; // per job
} Smooth;

static void smooth_job(void *context, int job, int worker)
{
    (void)worker;
    Smooth *s = context;
    const float *gain = s->cloud->field[CLOUD_GAINS];
    int begin = job * CHUNK, end = begin + CHUNK < s->cloud->n ? begin + CHUNK : s->cloud->n;
    double sum = 0;
    for (int i = begin; i < end; i++) {
        float d = 0;
        for (int k = 0; k < TRAIN_NEIGHBOURS; k++) {
            float x = gain[i] - gain[s->neighbour[i * TRAIN_NEIGHBOURS + k]], root = sqrtf(x * x + EPSILON * EPSILON);
            sum += (double)(root - EPSILON);
            d += x / root;
        }
        s->d_gains[i] += 2 * s->weight * d; // twice: the pair's other end pulls as much
    }
    s->part[job] = sum;
}

double fs_gains_smooth(Trainer *trainer, float *d_gains)
{
    const Cloud *cloud = &trainer->scene.cloud[LAYER_T_N];
    const CloudState *state = &trainer->state[LAYER_T_N];
    if (!state->neighbour) return 0;
    int jobs = (cloud->n + CHUNK - 1) / CHUNK;
    double scale = 1.0 / ((double)cloud->n * TRAIN_NEIGHBOURS);
    Smooth s = {cloud, state->neighbour, d_gains, (float)(trainer->set->gain_smooth * scale),
                ARENA_NEW(&trainer->engine->arena, double, jobs)};
    fs_threads_for(trainer->engine->threads, jobs, smooth_job, &s);
    double sum = 0;
    for (int i = 0; i < jobs; i++) sum += s.part[i];
    return sum * scale;
}
