// The start may have taken bars for mirrored, most of all where the mirrored room is as near as they are (bars.c). So
// T is lent what is that near of R, for another look, and keeps what is covered then, beside what was covered before.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "base/order.h"
#include "train/train_constants.h"
#include "train/trainer.h"

// How far from the middle of the photos' places, along their mean direction.
static void distances(const Trainer *trainer, const Cloud *cloud, double *distance)
{
    const double *normal = trainer->scene.pane.normal;
    double centre[3];
    fs_dataset_extent(&trainer->dataset, centre);
    for (int i = 0; i < cloud->n; i++) {
        const float *p = cloud->field[CLOUD_MEANS] + 3 * (size_t)i;
        distance[i] = v3_dot((const double[3]){p[0], p[1], p[2]}, normal) - v3_dot(centre, normal);
    }
}

// loan->far (n, of R): 0 where it is hardly farther than what is nearest of T. Returns how many;
// 0 where these are too few to be bars, or all of R.
static int find_near(const Trainer *trainer, BarsLoan *loan, FsError *err)
{
    const Cloud *T = &trainer->scene.cloud[LAYER_T_N], *R = &trainer->scene.cloud[LAYER_R];
    double *distance = malloc(sizeof *distance * (size_t)(T->n + R->n));
    int near = 0;
    if (!distance) return fs_error_memory(err);
    distances(trainer, T, distance);
    distances(trainer, R, distance + T->n);
    fs_order_doubles(distance, (size_t)T->n);
    for (int i = 0; i < R->n; i++) {
        loan->far[i] = distance[T->n + i] > BARS_NEAR * distance[(int)(BARS_NEAREST * T->n)];
        near += !loan->far[i];
    }
    free(distance);
    return near < BARS_LENT * T->n || near == R->n ? 0 : near;
}

// To the end of T, with the gain that is usual there.
static int lend(Cloud *T, const BarsLoan *loan, int near, FsError *err)
{
    int n = loan->n;
    double *gain = malloc(sizeof *gain * (size_t)n);
    if (!gain) return fs_error_memory(err);
    for (int i = 0; i < n; i++) gain[i] = (double)T->field[CLOUD_GAINS][i];
    double usual = fs_order_median(gain, (size_t)n);
    free(gain);
    MUST(fs_cloud_resize(T, n + near, err));
    for (int i = 0; i < loan->R.n; i++) {
        if (loan->far[i]) continue;
        for (int f = 0; f < CLOUD_GAINS; f++) {
            size_t w = (size_t)T->width[f];
            memcpy(T->field[f] + (size_t)n * w, loan->R.field[f] + (size_t)i * w, sizeof(float) * w);
        }
        T->field[CLOUD_GAINS][n++] = (float)usual;
    }
    return 0;
}

int fs_bars_loan_make(Trainer *trainer, BarsLoan *loan, FsError *err)
{
    Cloud *T = &trainer->scene.cloud[LAYER_T_N], *R = &trainer->scene.cloud[LAYER_R];
    int near;
    loan->n = T->n;
    loan->far = malloc((size_t)R->n);
    if (!loan->far) return fs_error_memory(err);
    MUST(near = find_near(trainer, loan, err));
    if (!near) return 0;
    MUST(fs_cloud_copy(&loan->R, R, err));
    if (T->width[CLOUD_COVERS]) {
        loan->covers = malloc(sizeof(float) * (size_t)T->n);
        if (!loan->covers) return fs_error_memory(err);
        memcpy(loan->covers, T->field[CLOUD_COVERS], sizeof(float) * (size_t)T->n);
    }
    MUST(lend(T, loan, near, err));
    fs_cloud_compact(R, loan->far);
    return near;
}

int fs_bars_loan_settle(Trainer *trainer, BarsLoan *loan, FsError *err)
{
    Cloud *T = &trainer->scene.cloud[LAYER_T_N], *R = &trainer->scene.cloud[LAYER_R];
    int next = loan->n;
    if (loan->covers) MUST(fs_cloud_covers(T, true, err));
    for (int i = 0; loan->covers && i < loan->n; i++)
        T->field[CLOUD_COVERS][i] = fmaxf(T->field[CLOUD_COVERS][i], loan->covers[i]);
    unsigned char *keep = malloc((size_t)T->n);
    if (!keep) return fs_error_memory(err);
    for (int i = 0; i < T->n; i++) keep[i] = i < loan->n || (T->width[CLOUD_COVERS] && T->field[CLOUD_COVERS][i] > 0);
    for (int i = 0; i < loan->R.n; i++)
        if (!loan->far[i]) loan->far[i] = !keep[next++];
    fs_cloud_compact(T, keep);
    free(keep);
    fs_cloud_compact(&loan->R, loan->far);
    fs_cloud_free(R);
    *R = loan->R;
    loan->R = (Cloud){0};
    return 0;
}

void fs_bars_loan_free(BarsLoan *loan)
{
    fs_cloud_free(&loan->R);
    free(loan->far);
    free(loan->covers);
    *loan = (BarsLoan){0};
}
