// The graph of kernels/gain.h from each Gaussian's nearest neighbours.
#include <stdlib.h>

#include "engine/host_engine.h"

enum { K = ENGINE_NEIGHBOURS };

static bool is_among(const int *neighbour, int i, int j) // j among i's
{
    for (int k = 0; k < K; k++)
        if (neighbour[i * K + k] == j) return true;
    return false;
}

void fs_gain_graph_free(GainGraph *graph)
{
    free((void *)graph->start);
    free((void *)graph->other);
    free((void *)graph->weight);
    *graph = (GainGraph){0};
}

int fs_gain_graph_make(GainGraph *graph, const int *neighbour, int n, FsError *err)
{
    fs_gain_graph_free(graph);
    // An edge is found at i where j is among i's; where i is among j's too, j's turn gives j its end.
    int *start = calloc((size_t)n + 2, sizeof *start);
    int *other = malloc(sizeof *other * 2 * K * (size_t)n);
    float *weight = malloc(sizeof *weight * 2 * K * (size_t)n);
    *graph = (GainGraph){start, other, weight, 1.0 / ((double)n * K)};
    if (!start || !other || !weight) {
        fs_gain_graph_free(graph);
        return fs_error_memory(err);
    }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < K; k++) {
            int j = neighbour[i * K + k];
            start[i + 2]++;
            if (!is_among(neighbour, j, i)) start[j + 2]++;
        }
    for (int i = 0; i < n; i++) start[i + 2] += start[i + 1];
    for (int i = 0; i < n; i++)
        for (int k = 0; k < K; k++) { // start[i + 1] is where i's next edge goes, and in the end where they end
            int j = neighbour[i * K + k];
            bool mutual = is_among(neighbour, j, i);
            weight[start[i + 1]] = mutual ? 2 : 1;
            other[start[i + 1]++] = j;
            if (mutual) continue;
            weight[start[j + 1]] = 1;
            other[start[j + 1]++] = i;
        }
    return 0;
}
