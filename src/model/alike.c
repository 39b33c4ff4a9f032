// Twins: photo a is fitted by photo b in the small picture, times a factor for the exposure, and moved by a little (its
// gradients), as a hand moves between two shots. What is left, measured in gradients, is how far the parts of the
// picture have moved against one another: parallax, which is what a photo is taken for.
//
// Strangers: blocks of one photo are looked for in another, up to a quarter of the frame away; half of them may be
// hidden, or show the layer that moved otherwise. Photos that find each other are joined, nearest in order first; who
// is not among the many in the end has nothing in common with them.
#include "model/alike.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/groups.h"
#include "image/blur.h"

#define TWIN_SIGMA 1.0f   // pixels of the small picture
#define TWIN_PARALLAX 0.4 // the same; pairs of made and rendered captures have 0.9 and more
#define TWIN_SHIFT 3.0
#define TWIN_FACTOR 3.0    // of square roots of light; what is black is fitted by anything, times nothing
enum { TWIN_REACH = 200 }; // photos apart in order: a burst, or one brought along twice

enum {
    PLACE_EDGE = 64,
    BLOCK = 24,
    ACROSS = 4, // blocks
    DOWN = 3,
    MOST_PAIRS = 6000 // that are compared; of captures that need more, nothing is said
};
#define PLACE_COARSE 3.0f // sigmas of what counts as structure
#define PLACE_FINE 0.7f
#define PLACE_LEVEL 5.0f // and is brought to one contrast over so much
#define PLACE_FLOOR 0.3f // of the picture's usual contrast
#define PLACE_REACH 0.25 // of the width that a block may move
#define PLACE_ALIKE 0.48 // correlation; strangers reach 0.46, photos of one capture 0.53 (with every fault) and more
#define PLACE_SHARE 0.75 // of the photos that hang together, else nobody is called a stranger

// ---- twins ----

typedef struct Slopes {
    int n;
    float *v, *x, *y; // (n) each: what a pixel is, and its gradient
} Slopes;

static int make_slopes(const Image *small, Slopes *s, float *scratch, FsError *err)
{
    int w = small->width, h = small->height;
    float *blurred = scratch + fs_image_pixels(small);
    *s = (Slopes){0};
    if (!small->px) return 0;
    s->v = malloc(3 * fs_image_pixels(small) * sizeof *s->v);
    if (!s->v) return fs_error_memory(err);
    s->x = s->v + fs_image_pixels(small);
    s->y = s->x + fs_image_pixels(small);
    fs_blur_image(small, scratch, blurred, TWIN_SIGMA);
    for (int y = 1; y < h - 1; y++)
        for (int x = 1; x < w - 1; x++) {
            const float *p = blurred + (size_t)y * (size_t)w + x;
            s->v[s->n] = *p;
            s->x[s->n] = 0.5f * (p[1] - p[-1]);
            s->y[s->n++] = 0.5f * (p[w] - p[-w]);
        }
    return 0;
}

enum { FIT = 4 }; // factor, offset, shift across and down

// Solves m x = r in place (positive definite, or nearly not). False where it is not.
static bool solve(double m[FIT][FIT + 1], double x[FIT])
{
    for (int k = 0; k < FIT; k++) {
        if (!(m[k][k] > 1e-12)) return false;
        for (int i = k + 1; i < FIT; i++) {
            double f = m[i][k] / m[k][k];
            for (int j = k; j <= FIT; j++) m[i][j] -= f * m[k][j];
        }
    }
    for (int k = FIT - 1; k >= 0; k--) {
        x[k] = m[k][FIT];
        for (int j = k + 1; j < FIT; j++) x[k] -= m[k][j] * x[j];
        x[k] /= m[k][k];
    }
    return true;
}

static bool are_twins(const Slopes *a, const Slopes *b)
{
    double m[FIT][FIT + 1] = {{0}}, x[FIT], left = 0, slope;
    if (a->n != b->n || a->n == 0) return false;
    for (int i = 0; i < a->n; i++) {
        double row[FIT + 1] = {b->v[i], 1, 0.5 * (a->x[i] + b->x[i]), 0.5 * (a->y[i] + b->y[i]), a->v[i]};
        for (int k = 0; k < FIT; k++)
            for (int j = k; j <= FIT; j++) m[k][j] += row[k] * row[j];
        left += row[FIT] * row[FIT];
    }
    double r[FIT];
    for (int k = 0; k < FIT; k++) {
        r[k] = m[k][FIT];
        for (int j = 0; j < k; j++) m[k][j] = m[j][k];
    }
    slope = 0.5 * (m[2][2] + m[3][3]);
    if (!solve(m, x) || !(x[0] > 1 / TWIN_FACTOR && x[0] < TWIN_FACTOR)) return false;
    for (int k = 0; k < FIT; k++) left -= x[k] * r[k];
    return left < TWIN_PARALLAX * TWIN_PARALLAX * slope && hypot(x[2], x[3]) < TWIN_SHIFT;
}

static int find_twins(Photos *photos, FsError *err)
{
    int n = photos->n, rc = 0;
    Slopes *slopes = calloc((size_t)n + 1, sizeof *slopes);
    float *scratch = malloc(2 * FS_LOOK_SMALL * FS_LOOK_SMALL * sizeof *scratch);
    if (!slopes || !scratch) TRY(fs_error_memory(err));
    for (int i = 0; i < n; i++) TRY(make_slopes(&photos->photo[i].look.small, &slopes[i], scratch, err));
    for (int i = 0; i < n; i++) {
        PhotoFile *photo = &photos->photo[i];
        photo->twin_of = -1;
        for (int k = i - 1; k >= 0 && k >= i - TWIN_REACH && photo->twin_of < 0; k--) {
            const PhotoFile *other = &photos->photo[k];
            bool comparable = other->flash == photo->flash && other->look.small.width == photo->look.small.width;
            if (comparable && are_twins(&slopes[i], &slopes[k]))
                photo->twin_of = other->twin_of < 0 ? k : other->twin_of;
        }
    }
fail:
    for (int i = 0; i < n && slopes; i++) free(slopes[i].v);
    free(slopes);
    free(scratch);
    return rc;
}

// ---- strangers ----

typedef struct Structure {
    Image at;    // 1 channel, evened out
    double *sum; // (height + 1, width + 1, 2) of the values and their squares, above and to the left
} Structure;

static void free_structure(Structure *s)
{
    fs_image_free(&s->at);
    free(s->sum);
    *s = (Structure){0};
}

// What is neither light and shade nor noise, everywhere of one contrast: flash and no flash look alike then.
static void even_out(Image *image, float *scratch)
{
    size_t n = fs_image_pixels(image);
    float *a = scratch + n, *b = a + n;
    double usual = 0;
    fs_blur_image(image, scratch, a, PLACE_COARSE);
    for (size_t i = 0; i < n; i++) image->px[i] -= a[i];
    fs_blur_image(image, scratch, a, PLACE_FINE);
    for (size_t i = 0; i < n; i++) {
        image->px[i] = a[i] * a[i];
        usual += (double)image->px[i] / (double)n;
    }
    fs_blur_image(image, scratch, b, PLACE_LEVEL);
    float floor = PLACE_FLOOR * (float)sqrt(usual) + 1e-6f;
    for (size_t i = 0; i < n; i++) image->px[i] = a[i] / (sqrtf(b[i]) + floor);
}

static int make_structure(const Image *small, Structure *s, FsError *err)
{
    int w = small->width, h = small->height, rc = 0;
    float *scratch = NULL;
    if (small->px) fs_image_limit(PLACE_EDGE, &w, &h);
    if (w < BLOCK + 2 || h < BLOCK + 2) return 0; // too narrow
    TRY(fs_image_resize_area(small, w, h, &s->at, err));
    scratch = malloc(3 * fs_image_pixels(&s->at) * sizeof *scratch);
    s->sum = calloc(2 * (size_t)(w + 1) * (size_t)(h + 1), sizeof *s->sum);
    if (!scratch || !s->sum) TRY(fs_error_memory(err));
    even_out(&s->at, scratch);
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            double v = *fs_image_at(&s->at, x, y),
                   *to = s->sum + 2 * ((size_t)(y + 1) * (size_t)(w + 1) + (size_t)x + 1);
            const double *up = to - 2 * (w + 1);
            to[0] = v + to[-2] + up[0] - up[-2];
            to[1] = v * v + to[-1] + up[1] - up[-1];
        }
fail:
    free(scratch);
    return rc;
}

// Of the block there: its mean, and the length of what is left without it.
static double block_length(const Structure *s, int x, int y, double *mean)
{
    const size_t row = 2 * (size_t)(s->at.width + 1);
    const double *a = s->sum + (size_t)y * row + 2 * (size_t)x, *b = a + BLOCK * row;
    double sum = b[2 * BLOCK] - b[0] - a[2 * BLOCK] + a[0], squares = b[2 * BLOCK + 1] - b[1] - a[2 * BLOCK + 1] + a[1];
    *mean = sum / (BLOCK * BLOCK);
    return sqrt(fmax(squares - sum * *mean, 0));
}

static double correlate(const Structure *a, int ax, int ay, const Structure *b, int bx, int by)
{
    double mean[2], length = block_length(a, ax, ay, &mean[0]) * block_length(b, bx, by, &mean[1]), dot = 0;
    for (int y = 0; y < BLOCK; y++) {
        const float *p = fs_image_at(&a->at, ax, ay + y), *q = fs_image_at(&b->at, bx, by + y);
        float sum[8] = {0};
        for (int x = 0; x < BLOCK; x += 8)
            for (int k = 0; k < 8; k++) sum[k] += p[x + k] * q[x + k];
        for (int k = 0; k < 8; k++) dot += (double)sum[k];
    }
    return length > 1e-6 ? (dot - BLOCK * BLOCK * mean[0] * mean[1]) / length : 0;
}

static double find_block(const Structure *a, int ax, int ay, const Structure *b)
{
    int across = (int)(PLACE_REACH * a->at.width), down = (int)(PLACE_REACH * a->at.height);
    double best = 0;
    for (int y = ay - down < 0 ? 0 : ay - down; y <= ay + down && y + BLOCK <= b->at.height; y++)
        for (int x = ax - across < 0 ? 0 : ax - across; x <= ax + across && x + BLOCK <= b->at.width; x++)
            best = fmax(best, correlate(a, ax, ay, b, x, y));
    return best;
}

static int falling(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x < y) - (x > y);
}

// The mean correlation of the better half of the blocks.
static double alikeness(const Structure *a, const Structure *b)
{
    double found[ACROSS * DOWN], sum = 0;
    int n = 0;
    for (int y = 0; y < DOWN; y++)
        for (int x = 0; x < ACROSS; x++)
            found[n++] = find_block(a, 1 + x * (a->at.width - BLOCK - 2) / (ACROSS - 1),
                                    1 + y * (a->at.height - BLOCK - 2) / (DOWN - 1), b);
    qsort(found, (size_t)n, sizeof *found, falling);
    for (int i = 0; i < n / 2; i++) sum += found[i];
    return sum / (n / 2);
}

typedef struct Places {
    Structure *at; // (n) of each photo
    int *group;    // (n) groups.h
    int n, most;   // the largest group
    int pairs_left;
} Places;

static bool are_alike(Places *p, const Structure *a, const Structure *b)
{
    if (p->pairs_left-- <= 0) return true; // so that nothing is said
    return alikeness(a, b) >= PLACE_ALIKE || alikeness(b, a) >= PLACE_ALIKE;
}

static void join(Places *p)
{
    int n = p->n, groups = 0;
    for (int i = 0; i < n; i++) {
        p->group[i] = i;
        groups += p->at[i].sum != NULL; // of the others nothing can be told
    }
    for (int step = 1; step < n && groups > 1; step++)
        for (int i = 0; i + step < n && groups > 1; i++) {
            int a = fs_group_of(p->group, i), b = fs_group_of(p->group, i + step);
            if (a == b || !p->at[i].sum || !p->at[i + step].sum || !are_alike(p, &p->at[i], &p->at[i + step])) continue;
            fs_group_join(p->group, a, b);
            groups--;
        }
}

// Looking down, cameras guess which way is up: the photo lies on its side, or on its head.
static int is_turned(Places *p, const Image *small, bool *found, FsError *err)
{
    static const int turns[] = {3, 6, 8}; // EXIF's numbers
    int rc = 0;
    Image turned = {0};
    Structure t = {0};
    *found = false;
    for (int k = 0; k < 3 && !*found; k++) {
        free_structure(&t);
        fs_image_free(&turned);
        TRY(fs_image_copy(&turned, small, err));
        TRY(fs_image_orient(&turned, turns[k], err));
        TRY(make_structure(&turned, &t, err)); // one on its side is no narrower
        for (int i = 0; i < p->n && !*found; i++)
            *found = fs_group_of(p->group, i) == p->most && are_alike(p, &t, &p->at[i]);
    }
fail:
    free_structure(&t);
    fs_image_free(&turned);
    return rc;
}

static int find_strangers(Photos *photos, FsError *err)
{
    int n = photos->n, rc = 0;
    Places p = {calloc((size_t)n + 1, sizeof *p.at), calloc(2 * (size_t)n + 1, sizeof *p.group), n, 0, MOST_PAIRS};
    if (!p.at || !p.group) TRY(fs_error_memory(err));
    for (int i = 0; i < n; i++) TRY(make_structure(&photos->photo[i].look.small, &p.at[i], err));
    int *size = p.group + n;
    join(&p);
    for (int i = 0; i < n; i++) size[fs_group_of(p.group, i)]++;
    for (int i = 0; i < n; i++)
        if (size[i] > size[p.most]) p.most = i;
    for (int i = 0; i < n; i++) {
        PhotoFile *photo = &photos->photo[i];
        bool turned = false;
        photo->stranger = p.at[i].sum && size[p.most] >= PLACE_SHARE * n && fs_group_of(p.group, i) != p.most;
        if (photo->stranger) TRY(is_turned(&p, &photo->look.small, &turned, err));
        photo->stranger &= !turned;
    }
fail:
    for (int i = 0; i < n && p.at; i++) free_structure(&p.at[i]);
    free(p.at);
    free(p.group);
    return rc;
}

int fs_alike_compare(Photos *photos, FsError *err)
{
    MUST(find_twins(photos, err));
    return find_strangers(photos, err);
}
