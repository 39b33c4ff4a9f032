// LPIPS: the two networks as tables, their weights, and the walk of both pictures through the layers side by side.
#include "evaluate/lpips.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "evaluate/conv.h"

#define MAX_CONVS 13
#define TAPS 5

typedef struct LayerShape {
    ConvShape conv;
    int pool; // size of the max pooling before the convolution, 0: none
    bool tap; // features are compared after it
} LayerShape;

static const struct {
    const char name[8];
    int n;
    LayerShape layer[MAX_CONVS];
} nets[LPIPS_NETS] = {
    [LPIPS_ALEX] = {"alex",
                    5,
                    {{{3, 64, 11, 4, 2}, 0, true},
                     {{64, 192, 5, 1, 2}, 3, true},
                     {{192, 384, 3, 1, 1}, 3, true},
                     {{384, 256, 3, 1, 1}, 0, true},
                     {{256, 256, 3, 1, 1}, 0, true}}},
    [LPIPS_VGG] = {"vgg",
                   13,
                   {{{3, 64, 3, 1, 1}, 0, false},
                    {{64, 64, 3, 1, 1}, 0, true},
                    {{64, 128, 3, 1, 1}, 2, false},
                    {{128, 128, 3, 1, 1}, 0, true},
                    {{128, 256, 3, 1, 1}, 2, false},
                    {{256, 256, 3, 1, 1}, 0, false},
                    {{256, 256, 3, 1, 1}, 0, true},
                    {{256, 512, 3, 1, 1}, 2, false},
                    {{512, 512, 3, 1, 1}, 0, false},
                    {{512, 512, 3, 1, 1}, 0, true},
                    {{512, 512, 3, 1, 1}, 2, false},
                    {{512, 512, 3, 1, 1}, 0, false},
                    {{512, 512, 3, 1, 1}, 0, true}}},
};

typedef struct NetWeights {
    const float *weight[MAX_CONVS], *bias[MAX_CONVS], *lin[TAPS];
    bool there;
} NetWeights;

struct Lpips {
    char *data; // the file
    NetWeights net[LPIPS_NETS];
};

// ---- the weight file ----

typedef struct Cursor {
    const char *path, *data;
    size_t size, at;
    FsError *err;
} Cursor;

// The next bytes; NULL, and the error, past the end.
static const char *take(Cursor *c, size_t bytes)
{
    if (c->size - c->at < bytes) {
        fs_error_input(c->err, "%s: cut off: make it again with tools/lpips_convert.py", c->path);
        return NULL;
    }
    c->at += bytes;
    return c->data + c->at - bytes;
}

static int take_floats(Cursor *c, size_t n, const float **values)
{
    *values = (const float *)(const void *)take(c, 4 * n); // the format keeps all at multiples of 4
    if (!*values) return FS_ERR_INPUT;
    for (size_t i = 0; i < n; i++)
        if (!isfinite((*values)[i])) return fs_error_input(c->err, "%s: a weight is not a finite number", c->path);
    return 0;
}

static int expect_numbers(Cursor *c, const int *expected, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        const char *from = take(c, 4);
        uint32_t number;
        if (!from) return FS_ERR_INPUT;
        memcpy(&number, from, 4);
        if (number != (uint32_t)expected[i])
            return fs_error_input(c->err, "%s: a layer of other shape than the network's (%u, expected %d)", c->path,
                                  number, expected[i]);
    }
    return 0;
}

static int take_layers(Cursor *c, int which, NetWeights *net)
{
    for (int i = 0; i < nets[which].n; i++) {
        const ConvShape *s = &nets[which].layer[i].conv;
        MUST(expect_numbers(c, (const int[]){s->out, s->in, s->kernel, s->kernel}, 4));
        MUST(take_floats(c, (size_t)s->out * (size_t)s->in * (size_t)(s->kernel * s->kernel), &net->weight[i]));
        MUST(take_floats(c, (size_t)s->out, &net->bias[i]));
    }
    for (int i = 0, tap = 0; i < nets[which].n; i++) {
        if (!nets[which].layer[i].tap) continue;
        MUST(expect_numbers(c, &nets[which].layer[i].conv.out, 1));
        MUST(take_floats(c, (size_t)nets[which].layer[i].conv.out, &net->lin[tap++]));
    }
    net->there = true;
    return 0;
}

static int take_net(Cursor *c, Lpips *lpips)
{
    const char *name = take(c, 8);
    if (!name) return FS_ERR_INPUT;
    for (int n = 0; n < LPIPS_NETS; n++)
        if (memcmp(name, nets[n].name, 8) == 0 && !lpips->net[n].there) return take_layers(c, n, &lpips->net[n]);
    return fs_error_input(c->err, "%s: expected the networks alex and vgg, each once", c->path);
}

int fs_lpips_read(Lpips **lpips, const char *path, FsError *err)
{
    *lpips = NULL;
    Lpips *l = calloc(1, sizeof *l);
    if (!l) return fs_error_memory(err);
    Cursor c = {.path = path, .err = err};
    uint32_t count = 0;
    int rc;
    TRY(fs_file_read(path, (size_t)256 << 20, &l->data, &c.size, err));
    c.data = l->data;
    if (c.size < 12 || memcmp(l->data, "FSLPIPS1", 8) != 0)
        TRY(fs_error_input(err, "%s: not a file of LPIPS weights: make one with tools/lpips_convert.py", path));
    memcpy(&count, l->data + 8, 4);
    c.at = 12;
    for (uint32_t i = 0; i < count && i <= LPIPS_NETS; i++) TRY(take_net(&c, l));
    if (c.at != c.size || count == 0)
        TRY(fs_error_input(err, "%s: %u networks and %zu bytes too many", path, count, c.size - c.at));
    *lpips = l;
    return 0;
fail:
    fs_lpips_free(l);
    return rc;
}

void fs_lpips_free(Lpips *lpips)
{
    if (lpips) free(lpips->data);
    free(lpips);
}

bool fs_lpips_has(const Lpips *lpips, LpipsNet net)
{
    return lpips && lpips->net[net].there;
}

// ---- the distance ----

static int input_maps(const Image *image, Maps *maps, FsError *err)
{
    static const float shift[3] = {-0.030f, -0.088f, -0.188f}, scale[3] = {0.458f, 0.448f, 0.450f};
    MUST(fs_conv_maps_new(maps, 3, image->height, image->width, err));
    size_t n = fs_image_pixels(image);
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < 3; c++) maps->px[c * n + i] = (2 * image->px[3 * i + c] - 1 - shift[c]) / scale[c];
    return 0;
}

// Mean over positions of the weighted squared difference of the features, each of unit length over the channels.
static double compare_features(const Maps *a, const Maps *b, const float *lin)
{
    enum { RUN = 64 }; // positions at a time
    size_t n = (size_t)a->width * (size_t)a->height, channels = (size_t)a->channels;
    double total = 0;
    for (size_t i0 = 0; i0 < n; i0 += RUN) {
        size_t run = n - i0 < RUN ? n - i0 : RUN;
        double la[RUN] = {0}, lb[RUN] = {0}, sum[RUN] = {0};
        for (size_t c = 0; c < channels; c++)
            for (size_t i = 0; i < run; i++) {
                double x = a->px[c * n + i0 + i], y = b->px[c * n + i0 + i];
                la[i] += x * x;
                lb[i] += y * y;
            }
        for (size_t i = 0; i < run; i++) la[i] = 1 / (sqrt(la[i]) + 1e-10), lb[i] = 1 / (sqrt(lb[i]) + 1e-10);
        for (size_t c = 0; c < channels; c++)
            for (size_t i = 0; i < run; i++) {
                double d = a->px[c * n + i0 + i] * la[i] - b->px[c * n + i0 + i] * lb[i];
                sum[i] += (double)lin[c] * d * d;
            }
        for (size_t i = 0; i < run; i++) total += sum[i];
    }
    return total / (double)n;
}

// Replaces maps by what comes out of the layer. *small: nothing does.
static int one_layer(const NetWeights *net, int i, const LayerShape *shape, Maps *maps, bool *small, Threads *threads,
                     FsError *err)
{
    Maps next;
    if (shape->pool) {
        *small = maps->height < shape->pool || maps->width < shape->pool;
        if (*small) return 0;
        MUST(fs_conv_max_pool(maps, shape->pool, &next, err));
        fs_conv_maps_free(maps);
        *maps = next;
    }
    *small = fs_conv_side(&shape->conv, maps->height) <= 0 || fs_conv_side(&shape->conv, maps->width) <= 0;
    if (*small) return 0;
    MUST(fs_conv_relu(&shape->conv, net->weight[i], net->bias[i], maps, &next, threads, err));
    fs_conv_maps_free(maps);
    *maps = next;
    return 0;
}

int fs_lpips_distance(const Lpips *lpips, LpipsNet which, const Image *a, const Image *b, Threads *threads,
                      double *value, FsError *err)
{
    const NetWeights *net = &lpips->net[which];
    Maps ma = {0}, mb = {0};
    double sum = 0;
    bool small = false;
    int rc;
    TRY(input_maps(a, &ma, err));
    TRY(input_maps(b, &mb, err));
    for (int i = 0, tap = 0; i < nets[which].n && !small; i++) {
        const LayerShape *shape = &nets[which].layer[i];
        TRY(one_layer(net, i, shape, &ma, &small, threads, err));
        if (!small) TRY(one_layer(net, i, shape, &mb, &small, threads, err));
        if (!small && shape->tap) sum += compare_features(&ma, &mb, net->lin[tap++]);
    }
    *value = small ? NAN : sum;
fail:
    fs_conv_maps_free(&ma);
    fs_conv_maps_free(&mb);
    return rc;
}
