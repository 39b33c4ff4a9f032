// volume.h in plain C: the scalar definition, and its twins by what the compiler makes of it for their instruction
// sets.
#include <math.h>
#include <stddef.h>

static void thickness(const float *logarithm, int n, float *tau)
{
    for (int i = 0; i < n; i++) tau[i] = expf(fminf(logarithm[i], FS_VOLUME_THICKEST));
}

static void thickness_backward(const float *logarithm, const float *tau, const float *d_tau, int n, float *d_logarithm)
{
    for (int i = 0; i < n; i++) d_logarithm[i] = logarithm[i] < FS_VOLUME_THICKEST ? d_tau[i] * tau[i] : 0;
}

static float weights(const float *tau, int n, bool from_far, float *w)
{
    float passes = 1;
    for (int k = 0; k < n; k++) {
        int i = from_far ? n - 1 - k : k;
        float next = passes * expf(-tau[i]);
        w[i] = passes - next;
        passes = next;
    }
    return passes;
}

// dL/dtau_i = T_(i+1) dL/dw_i - sum over those behind of w_j dL/dw_j - passes dL/dpasses: from the last to the first.
static void weights_backward(const float *w, int n, bool from_far, const float *d_w, float d_passes, float *d_tau)
{
    float passes = 1, behind = 0;
    for (int i = 0; i < n; i++) passes -= w[i];
    behind = passes * d_passes;
    for (int k = n - 1; k >= 0; k--) {
        int i = from_far ? n - 1 - k : k;
        d_tau[i] += passes * d_w[i] - behind;
        behind += w[i] * d_w[i];
        passes += w[i];
    }
}

static float spread(const float *w, const float *s, int n, float step)
{
    float sum = 0, weight = 0, moment = 0;
    for (int i = 0; i < n; i++) {
        sum += 2 * w[i] * (s[i] * weight - moment) + w[i] * w[i] * step / 3;
        weight += w[i];
        moment += w[i] * s[i];
    }
    return sum;
}

static void spread_backward(const float *w, const float *s, int n, float step, float d_out, float *d_w)
{
    float all_weight = 0, all_moment = 0, weight = 0, moment = 0;
    for (int i = 0; i < n; i++) all_weight += w[i], all_moment += w[i] * s[i];
    for (int i = 0; i < n; i++) {
        float before = s[i] * weight - moment;
        weight += w[i];
        moment += w[i] * s[i];
        float behind = all_moment - moment - s[i] * (all_weight - weight);
        d_w[i] += d_out * (2 * (before + behind) + 2 * w[i] * step / 3);
    }
}

static void blend(const VolumeBlend *b, float out[])
{
    for (int c = 0; c < b->channels; c++) {
        const float *x = b->x + (size_t)c * (size_t)b->stride;
        float sum = 0;
        for (int i = 0; i < b->n; i++) sum += b->w[b->of[i]] * x[i];
        out[c] = sum;
    }
}

static void blend_backward(const VolumeBlend *b, const float d_out[], float *d_x, float *d_w)
{
    for (int c = 0; c < b->channels; c++) {
        const float *x = b->x + (size_t)c * (size_t)b->stride;
        float *d = d_x + (size_t)c * (size_t)b->stride;
        for (int i = 0; i < b->n; i++) {
            d[i] = b->w[b->of[i]] * d_out[c];
            d_w[b->of[i]] += x[i] * d_out[c];
        }
    }
}
