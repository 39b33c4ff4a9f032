// Dirt on the pane: the flash, which is near, makes it shine. That light is neither transmitted nor mirrored; what
// photos show of it moves against both scenes as the pane does, and photos without the flash hardly show any.
//
// So what flash photos hold beyond their renders, after the first steps of training, less what of it lies where the
// scenes are (engine/residue.h), is carried onto planes before the cameras. On the pane's plane they agree about it
// (covariance of two photos, of their variance), on others they do not; photos without the flash, which agree about
// bars and where the scenes are still wrong, hardly do. None of T lies before it. The plane that is best by all that is
// the pane's, and has an even veil (model/pane_veil.h), which training fills.
#include "engine/dirt.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linalg.h"
#include "base/order.h"
#include "engine/as_shot.h"
#include "engine/residue.h"
#include "engine/view_plan.h"

// Chosen by:
#define AGREES 0.015   // experiment  agreement about where the pane is,
#define FOUND 0.04     // experiment  and once its place is found, of ENOUGH photos; fewer agree by chance
#define SURELY 0.07    // -           agreement that ends the search
#define OVERLAP 0.5    // -           share of a plane that so many photos see
#define OTHERS_COUNT 5 // experiment  times what the others agree about, of their light squared, is taken off
#define BEFORE 0.1     // experiment  share of T before a plane, that makes it none
#define NEARER 0.95    // -           of the pane's distance, that what is before it has at most
#define NEAREST 0.2    // -           distance of the first plane, of the middle depth,
#define FURTHEST 0.8   // -           and of the last one
#define FURTHER 1.08   // experiment  each of the one before
#define TILT 0.22      // experiment  between directions to search in
#define TURN 0.25      // experiment  first turns and shifts of a plane
#define ROUGHLY 0.03   // experiment  no smaller ones in each search,
#define FINELY 0.01    // experiment  and from the best one on
#define WIDE 3         // -           distances of the pane, that a veil reaches to the sides
#define AMBIENT 0.1    // -           of a veil at first
#define START 2.0      // experiment  light of one, in its units
enum {
    ROW = 8, // -           of a photo, places of T across and down that are looked at
    SAMPLES = ROW * ROW,
    ENOUGH = 12, // -           with the flash
    FEWEST = 3,  // -           photos that must see a place
    SIDE = 256,  // -           cells a side of the planes, of two pixels
    CELLS = 512, // -           of a veil's longer side, at most, and a border
    GRID = SIDE * SIDE,
    ACROSS = 6, // -           of the directions: along the way that the pane is turned, of three to its sides
    SEARCHES = 3 * ACROSS,
    AT_LEAST = 3, // -           of them are followed
    MOVES = 6,
    MOST = 32,
};

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
    Residue *residue;                  // (n)
    int n, lit;                        // of those: with the flash
    Cells *cells;                      // one per thread
    double middle[3], ahead[3], depth; // of the photos' places; where they look; the middle depth of T
    double focal;                      // pixels
    double (*place)[3];                // (n_places) of T
    int n_places;
    // what is asked
    const double (*plane)[3];
    bool flash;
    Agreement *agreement;
} Search;

// ---- what photos hold beyond their renders ----

// T's places, all over each photo's picture, and their middle depth.
static int sample_places(Search *s, FsError *err)
{
    float *depth = malloc(sizeof *depth * SAMPLES * (size_t)s->n);
    s->place = malloc(sizeof *s->place * SAMPLES * (size_t)s->n);
    if (!s->place || !depth) {
        free(depth);
        return fs_error_memory(err);
    }
    for (int i = 0; i < SAMPLES * s->n; i++) {
        const Residue *residue = &s->residue[i / SAMPLES];
        const Camera *c = &residue->camera;
        int k = i % SAMPLES, x = c->width * (2 * (k % ROW) + 1) / (2 * ROW),
            y = c->height * (2 * (k / ROW) + 1) / (2 * ROW);
        double d = (double)fs_planes_row(&residue->px, RESIDUE_DEPTH, y)[x], *place = s->place[s->n_places];
        if (!(d > 0)) continue;
        const double at[3] = {d * (x + 0.5 - c->cx) / c->fx, d * (y + 0.5 - c->cy) / c->fy, d};
        fs_camera_to_world(c, at, place);
        depth[s->n_places++] = (float)d;
    }
    fs_order_floats(depth, (size_t)s->n_places);
    s->depth = s->n_places ? (double)depth[s->n_places / 2] : 0;
    free(depth);
    return 0;
}

static int fill_residues(Search *s, FsError *err)
{
    const DirtArgs *a = s->args;
    Image layers[2] = {{0}};
    Renders renders = {{{0}}};
    int rc = 0;
    for (int i = 0; i < a->n; i++) {
        const DirtPhoto *p = &a->photo[i];
        Residue *residue = &s->residue[s->n++];
        residue->flash = p->view->flash;
        residue->camera = p->camera;
        TRY(fs_engine_render(a->engine, &p->camera, &renders, err));
        TRY(fs_as_shot_layers_of(a->scene, &p->state, p->view, &p->camera, &renders, layers, err));
        const Image *depths[2] = {&renders.layer[RENDER_DEPTH_T], &renders.layer[RENDER_DEPTH_R]};
        TRY(fs_residue_fill(residue, &p->photo, &p->mask, &layers[1], depths, err));
        for (int k = 0; k < 2; k++) fs_image_free(&layers[k]);
    }
fail:
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
        for (int k = 0; k < 3; k++) up[k] += s->residue[i].camera.w2c[4 + k];
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
        const Residue *residue = &s->residue[i];
        if (residue->flash != s->flash) continue;
        memset(c->one[0], 0, sizeof(float) * 2 * GRID);
        for (int k = 0; k < 2; k++) {
            VeilView view = fs_view_plan_veil(&veil, &residue->camera, (const float[3]){k == 0, k == 1, 0});
            fs_veil_scalar.backward(&view, NULL, &residue->px, c->one[k], NULL, 0, residue->px.height);
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

// Share of T that lies before a plane.
static double share_before(const Search *s, const double plane[3])
{
    int n = 0;
    for (int i = 0; i < s->n_places; i++) {
        const double from[3] = {s->place[i][0] - s->middle[0], s->place[i][1] - s->middle[1],
                                s->place[i][2] - s->middle[2]};
        n += v3_dot(plane, from) < NEARER;
    }
    return (double)n / s->n_places;
}

// ---- the search ----

typedef struct Found {
    double plane[3], agreement;
    double light; // that flash photos agree about
} Found;

// How much flash photos agree on planes, less what the others do too: those agree about little but where the scenes
// are. 0: not more than `least`, or T is before the plane.
static void agree_beyond(Search *s, const double plane[][3], int n, double least, Found *found)
{
    Agreement with[MOST], without[MOST];
    double asked[2][MOST][3];
    int of[2][MOST], m[2] = {0, 0};
    for (int i = 0; i < n; i++) {
        memcpy(found[i].plane, plane[i], sizeof found[i].plane);
        found[i].agreement = 0;
        if (share_before(s, plane[i]) < BEFORE) of[0][m[0]++] = i;
    }
    for (int i = 0; i < m[0]; i++) memcpy(asked[0][i], plane[of[0][i]], sizeof asked[0][i]);
    agree(s, (const double(*)[3])asked[0], m[0], true, with);
    for (int i = 0; i < m[0]; i++)
        if (with[i].share > least && with[i].light2 > 0) of[1][m[1]++] = i;
    for (int i = 0; i < m[1]; i++) memcpy(asked[1][i], asked[0][of[1][i]], sizeof asked[1][i]);
    agree(s, (const double(*)[3])asked[1], m[1], false, without);
    for (int i = 0; i < m[1]; i++) {
        const Agreement *flash = &with[of[1][i]];
        Found *at = &found[of[0][of[1][i]]];
        double others = fmax(without[i].light2, 0) / flash->light2;
        double agreement = flash->share * (1 - OTHERS_COUNT * others) * (1 - share_before(s, at->plane) / BEFORE);
        at->light = sqrt(flash->light2);
        if (agreement > least) at->agreement = agreement;
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
    if (!(v3_dot(across, across) > 1e-12 * squared)) v3_cross(s->ahead, s->residue[0].camera.w2c, across);
    v3_normalise(across);
    v3_cross(s->ahead, across, over);
    for (int i = 0; i < SEARCHES; i++) {
        double far = TILT * (i % ACROSS), wide = TILT * (i / ACROSS - 1);
        for (int k = 0; k < 3; k++) ahead[i][k] = s->ahead[k] + far * across[k] + wide * over[k];
        v3_normalise(ahead[i]);
    }
}

// From the directions that begin best on, until they have led to what is surely the pane.
static Found search(Search *s, const double normal[3])
{
    Found first[SEARCHES], best = {{0}, 0};
    double ahead[SEARCHES][3];
    starts(s, normal, ahead);
    for (int i = 0; i < SEARCHES; i++) first[i] = sweep(s, ahead[i]);
    for (int n = 0; n < AT_LEAST || best.agreement < SURELY; n++) {
        Found *next = first;
        for (int i = 1; i < SEARCHES; i++)
            if (first[i].agreement > next->agreement) next = &first[i];
        if (!(next->agreement > 0)) break;
        Found found = *next;
        next->agreement = 0;
        refine(s, &found, TURN, ROUGHLY);
        if (found.agreement > best.agreement) best = found;
    }
    if (best.agreement > 0) refine(s, &best, ROUGHLY, FINELY);
    if (best.agreement < FOUND * fmax(1, (double)ENOUGH / s->lit)) best.agreement = 0;
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
        if (!s->residue[i / 4].flash) continue;
        const Camera *c = &s->residue[i / 4].camera;
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
    s->residue = calloc((size_t)a->n, sizeof *s->residue);
    s->cells = calloc((size_t)threads, sizeof *s->cells);
    if (!s->residue || !s->cells) return fs_error_memory(err);
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
    for (int i = 0; i < s->n; i++) fs_residue_free(&s->residue[i]);
    free(s->cells);
    free(s->place);
    free(s->residue);
}

int fs_dirt_find(const DirtArgs *args, Veil *veil, FsError *err)
{
    Search s = {.args = args};
    Found found = {{0}, 0};
    int rc = 0;
    for (int i = 0; i < args->n; i++) s.lit += args->photo[i].view->flash;
    fs_image_free(&veil->light);
    *veil = (Veil){.cell = 0};
    if (s.lit < DIRT_FEWEST || args->n - s.lit < DIRT_FEWEST) return 0;
    TRY(open_search(&s, err));
    TRY(fill_residues(&s, err));
    TRY(sample_places(&s, err));
    TRY(fs_residue_clear_scenes(s.residue, s.n, args->threads, err));
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
