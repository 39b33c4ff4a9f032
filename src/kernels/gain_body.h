// gain.h in plain C, for the scalar definition and its twins.
#include <math.h>

static double smooth(const GainGraph *graph, const float *gains, int begin, int end, float weight, float *d_gains)
{
    const float scale = weight * (float)graph->scale;
    double sum = 0;
    for (int i = begin; i < end; i++) {
        float d = 0, phi = 0;
        for (int e = graph->start[i]; e < graph->start[i + 1]; e++) {
            float x = gains[i] - gains[graph->other[e]], root = sqrtf(x * x + FS_GAIN_EPSILON * FS_GAIN_EPSILON);
            phi += graph->weight[e] * (root - FS_GAIN_EPSILON);
            d += graph->weight[e] * (x / root);
        }
        sum += (double)phi;
        d_gains[i] += scale * d;
    }
    return 0.5 * sum * graph->scale;
}

static double push(const float *gains, int begin, int end, float weight, float *d_gains)
{
    double sum = 0;
    for (int i = begin; i < end; i++) {
        if (!(gains[i] < 0)) continue;
        d_gains[i] -= weight;
        sum -= (double)gains[i];
    }
    return sum;
}
