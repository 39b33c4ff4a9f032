// Scalar definition.
#include "kernels/occlusion.h"

#include "kernels/occlusion_body.h"

const OcclusionKernels fs_occlusion_scalar = {forward, backward, open_cells, apart, differ};

// ---- what is around (no twins: cells are few) ----

typedef struct Level {
    int width, height;
    float rgb[3 * OCCLUSION_CELLS], weight[OCCLUSION_CELLS]; // averages, and 0..1
} Level;

static void push(const Level *fine, Level *coarse)
{
    *coarse = (Level){.width = (fine->width + 1) / 2, .height = (fine->height + 1) / 2};
    for (int y = 0; y < fine->height; y++)
        for (int x = 0; x < fine->width; x++) {
            int from = y * fine->width + x, to = y / 2 * coarse->width + x / 2;
            coarse->weight[to] += fine->weight[from];
            for (int c = 0; c < 3; c++) coarse->rgb[3 * to + c] += fine->weight[from] * fine->rgb[3 * from + c];
        }
    for (int i = 0; i < coarse->width * coarse->height; i++) {
        for (int c = 0; c < 3 && coarse->weight[i] > 0; c++) coarse->rgb[3 * i + c] /= coarse->weight[i];
        coarse->weight[i] = fminf(coarse->weight[i], 1);
    }
}

static void pull(const Level *coarse, Level *fine)
{
    for (int y = 0; y < fine->height; y++)
        for (int x = 0; x < fine->width; x++) {
            int to = y * fine->width + x;
            Place px = place(x, fine->width, coarse->width), py = place(y, fine->height, coarse->height);
            const float *a = coarse->rgb + 3 * py.at * coarse->width, *b = coarse->rgb + 3 * py.next * coarse->width;
            for (int c = 0; c < 3; c++) {
                float above = a[3 * px.at + c] + px.share * (a[3 * px.next + c] - a[3 * px.at + c]);
                float below = b[3 * px.at + c] + px.share * (b[3 * px.next + c] - b[3 * px.at + c]);
                float around = above + py.share * (below - above);
                fine->rgb[3 * to + c] = around + fine->weight[to] * (fine->rgb[3 * to + c] - around);
            }
        }
}

void fs_occlusion_around(const OcclusionSums *sums, float *around)
{
    enum { LEVELS = 7 }; // to a single cell
    Level level[LEVELS];
    level[0].width = OCCLUSION_WIDTH;
    level[0].height = OCCLUSION_HEIGHT;
    for (int i = 0; i < OCCLUSION_CELLS; i++) {
        for (int c = 0; c < 3; c++) level[0].rgb[3 * i + c] = sums->n[i] > 0 ? sums->rgb[3 * i + c] / sums->n[i] : 0;
        level[0].weight[i] = sums->all[i] > 0 ? sums->n[i] / sums->all[i] : 0;
    }
    for (int l = 1; l < LEVELS; l++) push(&level[l - 1], &level[l]);
    for (int l = LEVELS - 2; l >= 0; l--) pull(&level[l + 1], &level[l]);
    memcpy(around, level[0].rgb, sizeof level[0].rgb);
}
