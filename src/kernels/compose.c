#include "kernels/compose.h"

#include "kernels/tone_curve.h"

static void forward(const ComposeArgs *a, int y0, int y1)
{
    for (int c = 0; c < a->T->channels; c++)
        for (int y = y0; y < y1; y++) {
            const float *T = fs_planes_row(a->T, c, y), *R = fs_planes_row(a->R, c, y);
            const float *beta = a->beta ? fs_planes_row(a->beta, 0, y) : NULL;
            const float *tau = a->tau ? fs_planes_row(a->tau, 0, y) : NULL;
            const float *veil = a->veil ? fs_planes_row(a->veil, c, y) : NULL;
            float *I = fs_planes_row(a->I, c, y), *I_linear = fs_planes_row(a->I_linear, c, y);
            float *T_linear = fs_planes_row(a->T_linear, c, y), *R_linear = fs_planes_row(a->R_linear, c, y);
            for (int x = 0; x < a->T->width; x++) {
                T_linear[x] = tone_decode(T[x]) * (tau ? tau[x] : 1);
                R_linear[x] = tone_decode(R[x]);
                I_linear[x] = T_linear[x] + (beta ? beta[x] : 1) * R_linear[x];
                if (veil) I_linear[x] += veil[x];
                I[x] = tone_encode(I_linear[x]);
            }
        }
}

static void backward(const ComposeArgs *a, int y0, int y1)
{
    for (int c = 0; c < a->T->channels; c++)
        for (int y = y0; y < y1; y++) {
            const float *T = fs_planes_row(a->T, c, y), *R = fs_planes_row(a->R, c, y);
            const float *beta = a->beta ? fs_planes_row(a->beta, 0, y) : NULL;
            const float *I = fs_planes_row(a->I, c, y), *I_linear = fs_planes_row(a->I_linear, c, y);
            const float *T_linear = fs_planes_row(a->T_linear, c, y), *R_linear = fs_planes_row(a->R_linear, c, y);
            const float *d_I = fs_planes_row(a->d_I, c, y);
            float *d_T = a->d_T ? fs_planes_row(a->d_T, c, y) : NULL;
            float *d_R = a->d_R ? fs_planes_row(a->d_R, c, y) : NULL;
            const float *tau = a->tau ? fs_planes_row(a->tau, 0, y) : NULL;
            float *d_tau = a->tau && a->d_tau ? fs_planes_row(a->d_tau, 0, y) : NULL;
            float *d_beta = a->d_beta ? fs_planes_row(a->d_beta, 0, y) : NULL;
            float *d_veil = a->d_veil ? fs_planes_row(a->d_veil, c, y) : NULL;
            for (int x = 0; x < a->T->width; x++) {
                float d_linear = d_I[x] * tone_encode_slope(I_linear[x], I[x]);
                float through = tau ? tau[x] : 1;
                if (d_T)
                    d_T[x] +=
                        d_linear * through * fmaxf(tone_decode_slope(T[x], T_linear[x] / through), a->slope_floor);
                if (d_tau) d_tau[x] += d_linear * T_linear[x] / through;
                if (d_R)
                    d_R[x] +=
                        d_linear * (beta ? beta[x] : 1) * fmaxf(tone_decode_slope(R[x], R_linear[x]), a->slope_floor);
                if (d_beta) d_beta[x] += d_linear * R_linear[x];
                if (d_veil) d_veil[x] = d_linear;
            }
        }
}

static void decode(const Planes *toned, const Planes *linear, int y0, int y1)
{
    for (int c = 0; c < toned->channels; c++)
        for (int y = y0; y < y1; y++) {
            const float *from = fs_planes_row(toned, c, y);
            float *to = fs_planes_row(linear, c, y);
            for (int x = 0; x < toned->width; x++) to[x] = tone_decode(from[x]);
        }
}

const ComposeKernels fs_compose_scalar = {forward, backward, decode};
