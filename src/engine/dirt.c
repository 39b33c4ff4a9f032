// Dirt on the pane: the flash, which is near, makes it shine. That light is neither transmitted nor mirrored; what
// photos show of it moves against both scenes as the pane does, and photos without the flash hardly show any.
//
// So what flash photos hold beyond their renders, after the first steps of training, is carried onto planes before the
// cameras. On the pane's plane they agree about it (covariance of two photos, of their variance), on others they do
// not. Where the scenes themselves are not yet found all photos agree, those without the flash about light that is less
// by a few times; about dirt they hardly do. The plane that is best by both is the pane's, and has an even veil
// (model/pane_veil.h), which training fills.
#include "engine/dirt.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "base/order.h"
#include "engine/as_shot.h"
#include "engine/view_plan.h"
#include "image/blur.h"

// Chosen by:
#define AGREES 0.015    // experiment  agreement about where the pane is,
#define FOUND 0.035     // experiment  and once its place is found, by AGAIN searches at least
#define SAME 0.25       // -           which differ by so much, of the plane's normal over its distance, at most
#define OVERLAP 0.5     // -           share of a plane that so many photos see
#define OTHERS_COUNT 15 // experiment  times what the others agree about, of their light squared, is taken off
#define NEAREST 0.2     // -           distance of the first plane, of the middle depth,
#define FURTHEST 0.8    // -           and of the last one
#define FURTHER 1.12    // experiment  each of the one before
#define TILT 0.22       // experiment  between directions to search in
#define TURN 0.25       // experiment  first turns and shifts of a plane
#define ROUGHLY 0.07    // experiment  no smaller ones in each search,
#define FINELY 0.01     // experiment  and from the best one on
#define OUTLIER 3.0f    // -           residuals, in standard deviations, that count half
#define DARK 0.1f       // -           of the photo's mean, beside what noise is told by
#define FINE 1.0f       // -           sigma of what tells that, pixels
#define BROAD 5.0f      // experiment  and of what is too broad to tell a plane by
#define WIDE 3          // -           distances of the pane, that a veil reaches to the sides
#define EDGES 2.0f      // experiment  pixels that scenes are off
#define AMBIENT 0.1     // -           of a veil at first
#define START 1.5       // experiment  light of one, in its units
#define DEVIATION 1.48f // standard deviation of a normal distribution, by its middle deviation
enum {
    FEWEST = 3,  // -           photos that must see a place
    SIDE = 256,  // -           cells a side of the planes, of two pixels
    CELLS = 512, // -           of a veil's longer side, at most, and a border
    GRID = SIDE * SIDE,
    ACROSS = 4, // -           of the directions: along the way that the pane is turned, of three to its sides
    SEARCHES = 3 * ACROSS,
    AGAIN = 3,
    MOVES = 6,
    MOST = 32,
};

typedef struct Sheet { // of a photo
    bool flash;
    Camera camera;
    Planes px; // 3 planes: what it holds beyond its render times the weight; the weight; nothing
} Sheet;

typedef struct Cells { // of a plane, of all photos
    float *one[2];     // of one: the weighed sum, the weight
    float *sum, *weight, *squares, *seen;
} Cells;

typedef struct Agreement { // of the photos of one lighting, on a plane
    double share;          // covariance of two photos, of their variance
    double light2;         // and itself, squared light
} Agreement;

typedef struct Search {
    const DirtArgs *args;
    Sheet *sheet; // (n)
    int n;
    Cells *cells;                      // one per thread
    double middle[3], ahead[3], depth; // of the photos' places; where they look; the middle depth of T
    double focal;                      // pixels
    // what is asked
    const double (*plane)[3];
    bool flash;
    Agreement *agreement;
} Search;

// ---- what photos hold beyond their renders ----

// Standard deviation of what is trusted, for a weight of 1. Room for a picture.
static float deviation(const float *residual, const float *weight, size_t n, float *room)
{
    size_t trusted = 0;
    for (size_t i = 0; i < n; i++)
        if (weight[i] > 0) room[trusted++] = fabsf(residual[i]) * sqrtf(weight[i]);
    fs_order_floats(room, trusted);
    return DEVIATION * (trusted ? room[trusted / 2] : 0) + 1e-12f;
}

// residual, weight: of the photo's pixels; x: as much room, y: twice as much.
static void weigh(float *residual, float *weight, const Image *bright, const Image *mask, float *x, float *y)
{
    const size_t n = fs_image_pixels(bright);
    Image one = {bright->width, bright->height, 1, x};
    double mean = 0;
    for (size_t i = 0; i < n; i++) mean += fmax((double)bright->px[i], 0) / (double)n;
    fs_blur_image(bright, x, weight, FINE);
    for (size_t i = 0; i < n; i++) weight[i] = mask->px[i] / (fmaxf(weight[i], 0) + DARK * (float)mean + 1e-9f);
    float *scratch = y + n, *blurred = y;
    for (size_t i = 0; i < n; i++) x[i] = residual[i] * weight[i];
    fs_blur_image(&one, scratch, blurred, BROAD);
    memcpy(x, weight, sizeof *x * n);
    for (size_t i = 0; i < n; i++) weight[i] = blurred[i]; // for now
    fs_blur_image(&one, scratch, blurred, BROAD);
    for (size_t i = 0; i < n; i++) residual[i] -= blurred[i] > 0 ? weight[i] / blurred[i] : 0;
    memcpy(weight, x, sizeof *x * n);
    const float usual = OUTLIER * deviation(residual, weight, n, x);
    for (size_t i = 0; i < n; i++) {
        float off = residual[i] * sqrtf(weight[i]) / usual;
        weight[i] /= 1 + off * off;
    }
}

// At edges of what is rendered a scene that is a little off leaves most. Room for three pictures.
static void weigh_edges(const float *residual, float *weight, const Image *whole, float *room)
{
    const int w = whole->width, h = whole->height;
    const size_t n = fs_image_pixels(whole), line = (size_t)w;
    float *bright = room, *steep = room + n;
    const float usual = deviation(residual, weight, n, room);
    for (size_t i = 0; i < n; i++) bright[i] = (whole->px[3 * i] + whole->px[3 * i + 1] + whole->px[3 * i + 2]) / 3;
    for (size_t i = 0; i < n; i++) {
        int x = (int)(i % line), y = (int)(i / line);
        float across = bright[i + (x + 1 < w)] - bright[i - (x > 0)];
        float down = bright[i + (y + 1 < h ? line : 0)] - bright[i - (y > 0 ? line : 0)];
        steep[i] = (across * across + down * down) / 4;
    }
    fs_blur_image(&(Image){w, h, 1, steep}, room + 2 * n, bright, FINE);
    for (size_t i = 0; i < n; i++) weight[i] /= 1 + EDGES * EDGES * bright[i] * weight[i] / (usual * usual);
}

static int fill_sheet(Sheet *sheet, const Image *photo, const Image *mask, const Image *whole, FsError *err)
{
    const int w = photo->width, h = photo->height;
    const size_t n = fs_image_pixels(photo);
    Image bright = {0};
    float *room = malloc(sizeof *room * 5 * n), *residual = room, *weight = room + n;
    int rc;
    if (!room) TRY(fs_error_memory(err));
    TRY(fs_image_new(&bright, w, h, 1, err));
    sheet->px = fs_planes_over(aligned_alloc(64, fs_planes_floats(w, h, 3) * sizeof(float)), w, h, 3);
    if (!sheet->px.px) TRY(fs_error_memory(err));
    for (size_t i = 0; i < n; i++) {
        residual[i] = 0;
        for (int c = 0; c < 3; c++) {
            bright.px[i] += photo->px[3 * i + (size_t)c] / 3;
            residual[i] += (photo->px[3 * i + (size_t)c] - whole->px[3 * i + (size_t)c]) / 3;
        }
    }
    weigh(residual, weight, &bright, mask, room + 2 * n, room + 3 * n);
    weigh_edges(residual, weight, whole, room + 2 * n);
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            size_t i = (size_t)y * (size_t)w + (size_t)x;
            fs_planes_row(&sheet->px, 0, y)[x] = residual[i] * weight[i];
            fs_planes_row(&sheet->px, 1, y)[x] = weight[i];
            fs_planes_row(&sheet->px, 2, y)[x] = 0;
        }
fail:
    fs_image_free(&bright);
    free(room);
    return rc;
}

// depth: (8, 8) of T, from all over the picture; 0 where there is none.
static void sample_depths(const Image *image, float depth[64])
{
    for (int i = 0; i < 64; i++)
        depth[i] = *fs_image_at(image, image->width * (2 * (i % 8) + 1) / 16, image->height * (2 * (i / 8) + 1) / 16);
}

static int fill_sheets(Search *s, FsError *err)
{
    const DirtArgs *a = s->args;
    Image layers[2] = {{0}};
    Renders renders = {{{0}}};
    float *depth = malloc(sizeof *depth * 64 * (size_t)a->n);
    int rc = 0;
    size_t n = 0;
    if (!depth) TRY(fs_error_memory(err));
    for (int i = 0; i < a->n; i++) {
        const DirtPhoto *p = &a->photo[i];
        Sheet *sheet = &s->sheet[s->n++];
        sheet->flash = p->view->flash;
        sheet->camera = p->camera;
        TRY(fs_engine_render(a->engine, &p->camera, &renders, err));
        TRY(fs_as_shot_layers_of(a->scene, &p->state, p->view, &p->camera, &renders, layers, err));
        TRY(fill_sheet(sheet, &p->photo, &p->mask, &layers[1], err));
        sample_depths(&renders.layer[RENDER_DEPTH_T], depth + (size_t)64 * (size_t)i);
        for (int k = 0; k < 2; k++) fs_image_free(&layers[k]);
    }
    for (size_t i = 0; i < (size_t)64 * (size_t)a->n; i++)
        if (depth[i] > 0) depth[n++] = depth[i];
    fs_order_floats(depth, n);
    s->depth = n ? (double)depth[n / 2] : 0;
fail:
    free(depth);
    for (int i = 0; i < 2; i++) fs_image_free(&layers[i]);
    fs_engine_renders_free(&renders);
    return rc;
}

// ---- what they agree about on a plane ----

// plane: its normal, over its distance from the middle. A veil of so many cells around what lies before the middle.
static Veil veil_on(const Search *s, const double plane[3], double cell, int width, int height)
{
    Veil v = {.cell = cell, .light = {.width = width, .height = height, .channels = 1}};
    double n[3] = {plane[0], plane[1], plane[2]}, up[3] = {0};
    v.distance = 1 / v3_normalise(n);
    for (int i = 0; i < s->n; i++)
        for (int k = 0; k < 3; k++) up[k] += s->sheet[i].camera.w2c[4 + k];
    double along = v3_dot(up, n);
    for (int k = 0; k < 3; k++) v.down[k] = up[k] - along * n[k];
    v3_normalise(v.down);
    v3_cross(v.down, n, v.right);
    for (int k = 0; k < 3; k++)
        v.origin[k] =
            s->middle[k] + v.distance * n[k] - cell / 2 * ((width - 1) * v.right[k] + (height - 1) * v.down[k]);
    return v;
}

static void carry(const Search *s, const double plane[3], Cells *c)
{
    double n[3] = {plane[0], plane[1], plane[2]};
    Veil veil = veil_on(s, plane, 2 / (v3_normalise(n) * s->focal), SIDE, SIDE);
    memset(c->sum, 0, sizeof(float) * 4 * GRID);
    for (int i = 0; i < s->n; i++) {
        const Sheet *sheet = &s->sheet[i];
        if (sheet->flash != s->flash) continue;
        memset(c->one[0], 0, sizeof(float) * 2 * GRID);
        for (int k = 0; k < 2; k++) {
            VeilView view = fs_view_plan_veil(&veil, &sheet->camera, (const float[3]){k == 0, k == 1, 0});
            fs_veil_scalar.backward(&view, NULL, &sheet->px, c->one[k], NULL, 0, sheet->px.height);
        }
        for (int k = 0; k < GRID; k++) {
            float sum = c->one[0][k], weight = c->one[1][k];
            c->sum[k] += sum;
            c->weight[k] += weight;
            c->squares[k] += sum * sum;
            c->seen[k] += weight > 0;
        }
    }
}

static void agree_job(void *context, int job, int worker)
{
    Search *s = context;
    Cells *c = &s->cells[worker];
    double both = 0, own = 0, pairs = 0, cells = 0, weights = 0, all = 0;
    carry(s, s->plane[job], c);
    for (int k = 0; k < GRID; k++) {
        all += c->seen[k] > 0;
        if (c->seen[k] < FEWEST || !(c->weight[k] > 0)) continue;
        double sum = (double)c->sum[k], squares = (double)c->squares[k], weight = (double)c->weight[k];
        both += (sum * sum - squares) / weight;
        own += squares / weight;
        weights += weight;
        pairs += (double)c->seen[k] - 1;
        cells++;
    }
    s->agreement[job] = (Agreement){0, INFINITY}; // a plane so near that photos hardly share any of it: chance
    if (!(cells > OVERLAP * all)) return;
    s->agreement[job] = (Agreement){own > 0 ? both / own * cells / pairs : 0, weights > 0 ? both / weights : 0};
}

// agreement (n): of photos with the flash or without, on each of the planes.
static void agree(Search *s, const double plane[][3], int n, bool flash, Agreement *agreement)
{
    s->plane = plane;
    s->flash = flash;
    s->agreement = agreement;
    fs_threads_for(s->args->threads, n, agree_job, s);
}

// ---- the search ----

typedef struct Found {
    double plane[3], agreement;
    double light; // that flash photos agree about
} Found;

// How much flash photos agree on planes, less what the others do too: those agree about little but where the scenes
// are. 0: not more than `least`.
static void agree_beyond(Search *s, const double plane[][3], int n, double least, Found *found)
{
    Agreement with[MOST], without[MOST];
    double asked[MOST][3];
    int of[MOST], m = 0;
    agree(s, plane, n, true, with);
    for (int i = 0; i < n; i++) {
        memcpy(found[i].plane, plane[i], sizeof found[i].plane);
        found[i].agreement = 0;
        found[i].light = sqrt(fmax(with[i].light2, 0));
        if (!(with[i].share > least && with[i].light2 > 0)) continue;
        memcpy(asked[m], plane[i], sizeof asked[m]);
        of[m++] = i;
    }
    agree(s, (const double(*)[3])asked, m, false, without);
    for (int i = 0; i < m; i++) {
        double others = fmax(without[i].light2, 0) / with[of[i]].light2;
        double agreement = with[of[i]].share * (1 - OTHERS_COUNT * others);
        if (agreement > least) found[of[i]].agreement = agreement;
    }
}

// The plane at right angles to `ahead` where that is most; agreement 0: none.
static Found sweep(Search *s, const double ahead[3])
{
    double plane[MOST][3];
    Found found[MOST], best = {{0}, 0};
    int n = 0;
    for (double d = NEAREST; d <= FURTHEST && n < MOST; d *= FURTHER, n++)
        for (int k = 0; k < 3; k++) plane[n][k] = ahead[k] / (d * s->depth);
    agree_beyond(s, (const double(*)[3])plane, n, AGREES, found);
    for (int i = 0; i < n; i++)
        if (found[i].agreement > best.agreement) best = found[i];
    return best;
}

// Turned and shifted, by less and less.
static void refine(Search *s, Found *found, double move, double least)
{
    double across[3][3];
    memcpy(across[2], found->plane, sizeof across[2]);
    double size = sqrt(v3_dot(across[2], across[2]));
    v3_cross(found->plane, fabs(found->plane[2]) < 0.5 * size ? (double[]){0, 0, 1} : (double[]){1, 0, 0}, across[0]);
    v3_normalise(across[0]);
    v3_cross(found->plane, across[0], across[1]);
    v3_normalise(across[1]);
    for (int a = 0; a < 2; a++)
        for (int k = 0; k < 3; k++) across[a][k] *= size;
    while (move > least) {
        double plane[MOVES][3];
        Found moved[MOVES], *best = moved;
        for (int i = 0; i < MOVES; i++)
            for (int k = 0; k < 3; k++) plane[i][k] = found->plane[k] + (i & 1 ? -1 : 1) * move * across[i / 2][k];
        agree_beyond(s, (const double(*)[3])plane, MOVES, found->agreement, moved);
        for (int i = 1; i < MOVES; i++)
            if (moved[i].agreement > best->agreement) best = &moved[i];
        if (best->agreement > found->agreement) {
            *found = *best;
        } else {
            move /= 2;
        }
    }
}

// Directions between where photos look and where the pane is thought to be, beyond that (training finds the way to turn
// it before it finds how far), and beside them.
static void starts(const Search *s, const double normal[3], double ahead[SEARCHES][3])
{
    double across[3], over[3], along = v3_dot(normal, s->ahead), sign = along < 0 ? -1 : 1;
    double squared = v3_dot(normal, normal);
    for (int k = 0; k < 3; k++) across[k] = sign * (normal[k] - along * s->ahead[k]);
    if (!(v3_dot(across, across) > 1e-12 * squared)) v3_cross(s->ahead, s->sheet[0].camera.w2c, across);
    v3_normalise(across);
    v3_cross(s->ahead, across, over);
    for (int i = 0; i < SEARCHES; i++) {
        double far = TILT * (i % ACROSS), wide = TILT * (i / ACROSS - 1);
        for (int k = 0; k < 3; k++) ahead[i][k] = s->ahead[k] + far * across[k] + wide * over[k];
        v3_normalise(ahead[i]);
    }
}

static Found search(Search *s, const double normal[3])
{
    Found found[SEARCHES], best = {{0}, 0};
    double ahead[SEARCHES][3];
    int same = 0;
    starts(s, normal, ahead);
    for (int i = 0; i < SEARCHES; i++) {
        found[i] = sweep(s, ahead[i]);
        if (found[i].agreement > 0) refine(s, &found[i], TURN, ROUGHLY);
        if (found[i].agreement > best.agreement) best = found[i];
    }
    for (int i = 0; i < SEARCHES; i++)
        same += found[i].agreement > 0 &&
                v3_distance2(found[i].plane, best.plane) < SAME * SAME * v3_dot(best.plane, best.plane);
    if (same < AGAIN) best.agreement = 0;
    if (best.agreement > 0) refine(s, &best, ROUGHLY, FINELY);
    if (best.agreement < FOUND) best.agreement = 0;
    return best;
}

// ---- from the plane to a veil ----

// An even one, over what flash photos see of the plane.
static int make_veil(const Search *s, const Found *found, Veil *veil, FsError *err)
{
    double n[3] = {found->plane[0], found->plane[1], found->plane[2]}, low[2] = {0, 0}, high[2] = {0, 0};
    double distance = 1 / v3_normalise(n), wide = WIDE * distance;
    Veil v = veil_on(s, found->plane, 1, 1, 1); // its origin is before the middle
    for (int i = 0; i < 4 * s->n; i++) {
        if (!s->sheet[i / 4].flash) continue;
        const Camera *c = &s->sheet[i / 4].camera;
        VeilView view = fs_view_plan_veil(&v, c, (const float[3]){1, 1, 1});
        double ray[3];
        for (int a = 0; a < 3; a++)
            ray[a] = (double)view.base[a] + (i & 1 ? c->width : 0) * (double)view.dx[a] +
                     (i & 2 ? c->height : 0) * (double)view.dy[a];
        for (int a = 0; a < 2 && view.width; a++) {
            double at = ray[2] > 0   ? (double)view.at[a] + (double)view.per * ray[a] / ray[2]
                        : ray[a] < 0 ? -wide
                                     : wide;
            low[a] = fmin(low[a], fmax(at, -wide));
            high[a] = fmax(high[a], fmin(at, wide));
        }
    }
    double sides[2] = {high[0] - low[0], high[1] - low[1]};
    double fine = 2 * distance / s->args->photo[0].view->camera.fx; // two pixels of the photos as they are
    v.cell = fmax(fine, fmax(sides[0], sides[1]) / CELLS);
    for (int k = 0; k < 3; k++) v.origin[k] += (low[0] - v.cell) * v.right[k] + (low[1] - v.cell) * v.down[k];
    v.unit = found->light;
    for (int k = 0; k < 3; k++) v.ambient[k] = AMBIENT;
    *veil = v;
    MUST(fs_image_new(&veil->light, (int)(sides[0] / v.cell) + 4, (int)(sides[1] / v.cell) + 4, 1, err));
    for (size_t i = 0; i < fs_image_values(&veil->light); i++) veil->light.px[i] = (float)(START * v.unit);
    return 0;
}

static int open_search(Search *s, FsError *err)
{
    const DirtArgs *a = s->args;
    int threads = fs_threads_count(a->threads);
    s->sheet = calloc((size_t)a->n, sizeof *s->sheet);
    s->cells = calloc((size_t)threads, sizeof *s->cells);
    if (!s->sheet || !s->cells) return fs_error_memory(err);
    for (int i = 0; i < threads; i++) {
        float *room = malloc(sizeof *room * 6 * GRID);
        if (!room) return fs_error_memory(err);
        s->cells[i] = (Cells){{room, room + GRID}, room + 2 * GRID, room + 3 * GRID, room + 4 * GRID, room + 5 * GRID};
    }
    double centre[3];
    for (int i = 0; i < a->n; i++) {
        fs_camera_centre(&a->photo[i].camera, centre);
        for (int k = 0; k < 3; k++) {
            s->middle[k] += centre[k] / a->n;
            s->ahead[k] += a->photo[i].camera.w2c[8 + k];
        }
    }
    v3_normalise(s->ahead);
    s->focal = a->photo[0].camera.fx;
    return 0;
}

static void close_search(Search *s)
{
    for (int i = 0; s->cells && i < fs_threads_count(s->args->threads); i++) free(s->cells[i].one[0]);
    for (int i = 0; i < s->n; i++) free(s->sheet[i].px.px);
    free(s->cells);
    free(s->sheet);
}

int fs_dirt_find(const DirtArgs *args, Veil *veil, FsError *err)
{
    Search s = {.args = args};
    Found found = {{0}, 0};
    int rc = 0, lit = 0;
    for (int i = 0; i < args->n; i++) lit += args->photo[i].view->flash;
    fs_image_free(&veil->light);
    *veil = (Veil){.cell = 0};
    if (lit < DIRT_FEWEST || args->n - lit < DIRT_FEWEST) return 0;
    TRY(open_search(&s, err));
    TRY(fill_sheets(&s, err));
    if (s.depth > 0) found = search(&s, args->scene->pane.normal);
    if (found.agreement > 0) {
        TRY(make_veil(&s, &found, veil, err));
        rc = fs_pane_veil_check(veil, "veil", NULL) == 0; // not where photos are turned on their sides from it
    }
    if (rc == 0) {
        fs_image_free(&veil->light);
        *veil = (Veil){.cell = 0};
    }
fail:
    close_search(&s);
    return rc;
}
