// Gradients of the splat path by finite differences, in double: Gaussian -> projection -> alpha blending -> sum of
// weighted features and transmittance, for every parameter of every Gaussian.
#define REAL double
#define fs_project_scalar project_double
#include "kernels/projection.c"
#undef fs_project_scalar
#undef forward
#define fs_raster_scalar raster_double
#define forward raster_forward
#define backward raster_backward
#include "kernels/raster.c"
#undef forward
#undef backward

#include "kernels/check.h"

#define N 5
#define T_CUT (-40.0f) // far below 1/255, so that the cut-off does not disturb the differences

typedef struct Scene {
    float means[3 * N], scales[3 * N], quats[4 * N], opacities[N], colors[3 * N];
} Scene;

static const ProjectCamera camera = {.rotation = {0.96f, 0.02f, -0.28f, 0, 1, 0.05f, 0.28f, -0.05f, 0.96f},
                                     .translation = {0.1f, -0.05f, 0.2f},
                                     .fx = 20,
                                     .fy = 22,
                                     .cx = 8.2f,
                                     .cy = 7.6f,
                                     .near = 0.1f,
                                     .width = 16,
                                     .height = 16,
                                     .limit_x = 1.0f,
                                     .limit_y = 1.0f,
                                     .dilation_x = 0.3f,
                                     .dilation_y = 0.1f};
static float weight[5 * FS_TILE_PIXELS]; // of three colours, depth, transmittance

static ProjectParams params_of(Scene *s)
{
    return (ProjectParams){s->means, s->scales, s->quats, s->opacities};
}

static double evaluate(Scene *s, Scene *gradient)
{
    Splat splats[N];
    TileEntry entries[N];
    float feature[4 * FS_TILE_PIXELS], transmittance[FS_TILE_PIXELS], records[N * FS_RECORD];
    ProjectParams params = params_of(s);
    project_double.forward(&camera, &params, 0, N, T_CUT, splats);
    for (int i = 0; i < N; i++) {
        memcpy(splats[i].feature, s->colors + 3 * i, 3 * sizeof(float));
        splats[i].feature[3] = splats[i].depth;
        entries[i] = (TileEntry){(uint32_t)i, 0xffffffffu, (uint32_t)i}; // any order is a valid order
    }
    RasterTile tile = {
        .n = N, .entry = entries, .splats = splats, .features = 4, .t_min = T_CUT, .transmittance_min = 0};
    raster_double.forward(&tile, feature, transmittance);
    double sum = 0;
    for (int i = 0; i < 4 * FS_TILE_PIXELS; i++) sum += (double)weight[i] * (double)feature[i];
    for (int i = 0; i < FS_TILE_PIXELS; i++) sum += (double)weight[4 * FS_TILE_PIXELS + i] * (double)transmittance[i];
    if (gradient) {
        float d_depth[N];
        ProjectParams d = params_of(gradient);
        raster_double.backward(&tile, feature, transmittance, weight, weight + 4 * FS_TILE_PIXELS, records);
        for (int i = 0; i < N; i++) {
            memcpy(gradient->colors + 3 * i, records + i * FS_RECORD + 6, 3 * sizeof(float));
            d_depth[i] = records[i * FS_RECORD + 9];
        }
        project_double.backward(&camera, &params, 0, N, &(ProjectBack){splats, records, d_depth}, &d);
    }
    return sum;
}

int main(int argc, char **argv)
{
    check_begin(argc, argv);
    Rng rng = fs_rng_new(7);
    for (int trial = 0; trial < 4; trial++) {
        Scene s, gradient;
        for (int i = 0; i < N; i++) {
            for (int k = 0; k < 2; k++) s.means[3 * i + k] = 0.6f * (fs_rng_uniform(&rng) - 0.5f);
            s.means[3 * i + 2] = 1.5f + fs_rng_uniform(&rng);
            for (int k = 0; k < 3; k++) s.scales[3 * i + k] = -1.8f + 0.8f * fs_rng_uniform(&rng);
            for (int k = 0; k < 4; k++) s.quats[4 * i + k] = fs_rng_normal(&rng);
            s.opacities[i] = fs_rng_normal(&rng);
            for (int k = 0; k < 3; k++) s.colors[3 * i + k] = fs_rng_uniform(&rng);
        }
        if (trial == 3) s.means[0] = 3.0f; // outside the frame: the clamp of the projection's slope is at work
        for (int i = 0; i < 5 * FS_TILE_PIXELS; i++) weight[i] = fs_rng_normal(&rng);
        evaluate(&s, &gradient);
        const int count = (int)(sizeof s / sizeof(float));
        for (int i = 0; i < count; i++) {
            float *x = (float *)&s + i, keep = *x, h = 2e-3f;
            *x = keep + h;
            double up = evaluate(&s, NULL), x_up = *x;
            *x = keep - h;
            double down = evaluate(&s, NULL), x_down = *x;
            *x = keep;
            double numeric = (up - down) / (x_up - x_down), analytic = (double)((float *)&gradient)[i];
            CHECK(fabs(numeric - analytic) < 2e-3 * fabs(numeric) + 2e-2,
                  "trial %d, parameter %d: %g by differences, %g by backward", trial, i, numeric, analytic);
        }
    }
    return check_end();
}
