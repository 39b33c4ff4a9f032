// One path per sample: through the pane to what is behind it, and mirrored at the pane into the room. Ambient light is
// looked up, the flash is a point a hand's breadth above the lens.
#include "synth/trace.h"

#include <string.h>

#include "synth/glass.h"

#define SIDE 4 // strata of a pixel across and down
#define BASE 4 // samples every pixel gets; one with contrast gets all SIDE * SIDE

enum { UNKNOWN = -2, NOTHING = -1 };

typedef struct View {
    const Layout *layout;
    const Lighting *light;
    Vec eye, right, down, ahead; // of the camera
    float fx, fy, cx, cy;
    float spread; // width of a sample at distance 1
    Vec flash, mirrored_flash;
    const Optics *optics;
    Vec room_light, dirt_light; // on figures and on the pane; with optics only
    Vec pane_u, pane_v;         // directions in it
} View;

typedef struct Ray {
    Vec from, d; // d has unit length
} Ray;

// What a sample met: a primitive's number, NOTHING or UNKNOWN. Where the first samples of a pixel met the same, the
// others are tried on it first, which saves nearly all of the search.
typedef struct Met {
    int behind, room, shadow; // shadow: of the flash, 0 or 1
} Met;

typedef struct Sample {
    Vec layer[TRACE_LAYERS];
    Met met;
} Sample;

void fs_trace_free(Traced *traced)
{
    for (int i = 0; i < TRACE_LAYERS; i++) fs_image_free(&traced->layer[i]);
}

static View view_of(const Layout *layout, const Lighting *light, const Camera *camera)
{
    const double *m = camera->w2c;
    double c[3];
    fs_camera_centre(camera, c);
    View v = {.layout = layout, .light = light, .eye = vec((float)c[0], (float)c[1], (float)c[2])};
    v.right = vec((float)m[0], (float)m[1], (float)m[2]);
    v.down = vec((float)m[4], (float)m[5], (float)m[6]);
    v.ahead = vec((float)m[8], (float)m[9], (float)m[10]);
    v.fx = (float)camera->fx;
    v.fy = (float)camera->fy;
    v.cx = (float)camera->cx;
    v.cy = (float)camera->cy;
    v.spread = 0.8f / v.fx;
    v.flash = vec_mad(vec_mad(v.eye, v.down, -0.11f), v.right, 0.02f);
    vec_basis(layout->pane_normal, &v.pane_u, &v.pane_v);
    float side = vec_dot(vec_sub(v.flash, layout->pane_point), layout->pane_normal);
    v.mirrored_flash = vec_mad(v.flash, layout->pane_normal, -2 * side);
    return v;
}

Vec fs_trace_mirrored_flash(const Layout *layout, const Camera *camera)
{
    return view_of(layout, NULL, camera).mirrored_flash;
}

static GlassShare glass_along(const View *v, Vec d)
{
    return fs_glass_share(v->layout, v->light->refraction, vec_dot(d, v->layout->pane_normal));
}

static Vec pixel_ray(const View *v, float x, float y)
{
    float u = (x - v->cx) / v->fx, w = (y - v->cy) / v->fy;
    double ray[2], pixel[2] = {(double)x, (double)y};
    if (v->optics && v->optics->lens.width && fs_lens_unproject(&v->optics->lens, pixel, ray)) {
        u = (float)ray[0];
        w = (float)ray[1];
    }
    return vec_unit(vec_add(v->ahead, vec_add(vec_scale(v->right, u), vec_scale(v->down, w))));
}

// A ray of a lens with an opening: from some place in it to what the pinhole's ray meets where it is sharp.
static Ray pupil_ray(const View *v, Vec d, Rng *rng)
{
    if (!v->optics || v->optics->aperture <= 0) return (Ray){v->eye, d};
    float a = 6.2831853f * fs_rng_uniform(rng), r = v->optics->aperture * sqrtf(fs_rng_uniform(rng));
    Vec from = vec_mad(vec_mad(v->eye, v->right, r * cosf(a)), v->down, r * sinf(a));
    Vec sharp = vec_mad(v->eye, d, v->optics->focus / vec_dot(d, v->ahead));
    return (Ray){from, vec_unit(vec_sub(sharp, from))};
}

// How far along the ray the pane is; huge when the ray does not meet it.
static float pane_distance(const View *v, Ray ray)
{
    const Layout *l = v->layout;
    float away = vec_dot(ray.d, l->pane_normal);
    return away < -1e-4f ? vec_dot(vec_sub(l->pane_point, ray.from), l->pane_normal) / away : 1e9f;
}

// Light that a flash at the end of `to` (from the point) sends to it: cosine, distance and beam; 0 from behind.
static float flash_gain(Vec axis, Vec normal, Vec to)
{
    float d2 = vec_dot(to, to), d = sqrtf(d2);
    return fmaxf(vec_dot(to, normal), 0.0f) / (d * d2) * fmaxf(-vec_dot(to, axis) / d, 0.0f);
}

static bool search(const World *world, Vec o, Vec d, int guess, Hit *hit)
{
    *hit = (Hit){.t = 1e9f, .prim = NOTHING};
    if (guess >= 0 && fs_bvh_hit_shape(&world->shape[guess], o, d, hit)) return true;
    return fs_bvh_hit(&world->bvh, o, d, hit);
}

// By the albedo: the light without the flash.
static Vec own_light(const World *w, const Hit *hit, const Surface *surface)
{
    float glow = surface->glow;
    return glow > 0 ? vec(glow, glow, glow) : fs_world_ambient(w, hit);
}

// jitter: of the flash, NULL without flash.
static void shade_behind(const View *v, Ray ray, const Hit *hit, const Vec *jitter, float through, int shadow,
                         Sample *s)
{
    const World *w = &v->layout->behind;
    const Surface *surface = fs_world_surface_of(w, hit);
    Vec d = ray.d, at = vec_mad(ray.from, d, hit->t), normal = fs_world_normal(w, hit);
    if (vec_dot(normal, d) > 0) normal = vec_scale(normal, -1);
    Vec albedo = fs_world_albedo(w, hit, v->spread * hit->t), tint = surface->in_front ? vec(1, 1, 1) : v->layout->tint;
    albedo = vec_mul(albedo, tint);
    Vec plain = vec_scale(vec_mul(albedo, own_light(w, hit, surface)), v->light->behind * through);
    s->layer[TRACE_T_N] = plain;
    s->layer[TRACE_T_F] = plain;
    if (!jitter || surface->glow > 0) return;
    s->layer[TRACE_T_F] = plain = vec_scale(plain, 1 + v->light->even);
    Vec to = vec_sub(vec_add(v->flash, *jitter), at);
    float factor = flash_gain(v->ahead, normal, to) * v->light->flash;
    if (factor <= 0) return;
    s->met.shadow = shadow >= 0 ? shadow : fs_bvh_blocked(&w->bvh, vec_mad(at, normal, 1e-3f), to, 1e-3f, 0.98f, 0);
    if (s->met.shadow) return;
    to = vec_unit(to);
    if (!surface->in_front) factor *= glass_along(v, to).through;
    Vec sum = vec_mad(plain, vec_mul(albedo, tint), factor * through); // tinted on its way there too
    if (surface->gloss > 0) {                                          // a soft highlight
        float h = vec_dot(vec_unit(vec_sub(to, d)), normal), h2 = h * h, h8 = h2 * h2 * h2 * h2;
        sum = vec_mad(sum, vec_mul(tint, tint), surface->gloss * h8 * h8 * h8 * h8 * factor * through);
    }
    s->layer[TRACE_T_F] = sum;
}

// What a ray in the mirrored room meets.
typedef struct Mirrored {
    float t;
    Vec normal, albedo, light;
    bool flash; // the flash reaches it
    int prim;   // NOTHING for a figure
} Mirrored;

static bool look_into_room(const View *v, Ray ray, float distance, int guess, Mirrored *m)
{
    const World *w = &v->layout->room;
    Hit hit;
    bool found = search(w, ray.from, ray.d, guess, &hit);
    if (v->optics && v->optics->n_figures) {
        FigureHit person = {.t = hit.t};
        fs_figure_hit(v->optics->figure, v->optics->n_figures, ray.from, ray.d, &person);
        if (person.figure) {
            Vec light = vec_scale(v->room_light, 0.7f + 0.3f * person.normal.z);
            *m = (Mirrored){person.t, person.normal, person.albedo, light, person.figure->lit, NOTHING};
            return true;
        }
    }
    if (!found) return false;
    const Surface *surface = fs_world_surface_of(w, &hit);
    *m = (Mirrored){.t = hit.t, .prim = hit.prim, .flash = surface->glow <= 0};
    m->albedo = fs_world_albedo(w, &hit, v->spread * (distance + hit.t));
    m->light = own_light(w, &hit, surface);
    m->normal = fs_world_normal(w, &hit);
    return true;
}

// A sheet of glass, where the ray meets it.
typedef struct Sheen {
    float distance, beta;
    Vec normal;
} Sheen;

static void shade_room(const View *v, Ray ray, Sheen sheen, bool flash, int guess, Sample *s)
{
    Vec from = vec_mad(ray.from, ray.d, sheen.distance), back = vec_reflect(ray.d, sheen.normal);
    Mirrored m;
    if (!look_into_room(v, (Ray){from, back}, sheen.distance, guess, &m)) return;
    s->met.room = m.prim;
    Vec plain = vec_scale(vec_mul(m.albedo, m.light), v->light->room * sheen.beta), lit = plain;
    if (flash && m.flash) {
        Vec at = vec_mad(from, back, m.t), to = vec_sub(v->mirrored_flash, at);
        if (vec_dot(m.normal, back) > 0) m.normal = vec_scale(m.normal, -1);
        Vec axis = vec_reflect(v->ahead, v->layout->pane_normal);
        float factor = flash_gain(axis, m.normal, to) * v->light->flash_back;
        GlassShare share = glass_along(v, vec_unit(to));
        factor *= share.front + share.rear;
        lit = vec_mad(vec_scale(plain, 1 + v->light->even_back), m.albedo, factor * sheen.beta);
    }
    s->layer[TRACE_R_N] = vec_add(s->layer[TRACE_R_N], plain);
    s->layer[TRACE_R_F] = vec_add(s->layer[TRACE_R_F], lit);
}

// Both mirror images where there are two panes; they are never quite parallel.
static void shade_mirrored(const View *v, Ray ray, float pane, GlassShare share, bool flash, int guess, Sample *s)
{
    const Layout *l = v->layout;
    shade_room(v, ray, (Sheen){pane, share.front, l->pane_normal}, flash, guess, s);
    if (share.rear <= 0) return;
    int met = s->met.room;
    float rear = pane - l->gap / vec_dot(ray.d, l->pane_normal);
    Vec normal = vec_unit(vec_mad(l->pane_normal, v->pane_u, 0.002f));
    shade_room(v, ray, (Sheen){rear, share.rear, normal}, flash, NOTHING, s);
    s->met.room = met;
}

// Dirt hides a little of everything and shines in the light that falls on it, most in the near flash's.
static void add_dirt(const View *v, Ray ray, float pane, Sample *s)
{
    const Layout *l = v->layout;
    const float albedo = 0.7f;
    Vec at = vec_mad(ray.from, ray.d, pane), in_pane = vec_sub(at, l->pane_point), to = vec_sub(v->flash, at);
    float cover =
        v->optics->dirt * fs_glass_dirt(v->optics->dirt_seed, vec_dot(in_pane, v->pane_u), vec_dot(in_pane, v->pane_v));
    cover = fminf(cover, 0.9f);
    for (int k = 0; k < TRACE_LAYERS; k++) s->layer[k] = vec_scale(s->layer[k], 1 - cover);
    float flash = flash_gain(v->ahead, l->pane_normal, to) * v->light->flash;
    Vec plain = vec_scale(v->dirt_light, albedo * cover);
    s->layer[TRACE_T_N] = vec_add(s->layer[TRACE_T_N], plain);
    s->layer[TRACE_T_F] = vec_add(s->layer[TRACE_T_F], vec_mad(plain, vec(1, 1, 1), albedo * cover * flash));
}

static Sample take_sample(const View *v, float x, float y, unsigned want, Met guess, Rng *rng)
{
    Sample s = {.met = {NOTHING, NOTHING, UNKNOWN}};
    float a = 6.2831853f * fs_rng_uniform(rng), r = 0.012f * sqrtf(fs_rng_uniform(rng)); // the flash is 24 mm wide
    Vec jitter = vec_mad(vec_scale(v->right, r * cosf(a)), v->down, r * sinf(a));
    Ray ray = pupil_ray(v, pixel_ray(v, x, y), rng);
    float pane = pane_distance(v, ray);
    Hit hit;
    bool found = search(&v->layout->behind, ray.from, ray.d, guess.behind, &hit);
    s.met.behind = hit.prim;
    bool bare = pane > 1e8f || (found && fs_world_surface_of(&v->layout->behind, &hit)->in_front);
    GlassShare share = bare ? (GlassShare){0, 0, 1} : glass_along(v, ray.d);
    if (found && want & (1 << TRACE_T_N | 1 << TRACE_T_F))
        shade_behind(v, ray, &hit, want & 1 << TRACE_T_F ? &jitter : NULL, share.through, guess.shadow, &s);
    if (!bare && want & (1 << TRACE_R_N | 1 << TRACE_R_F))
        shade_mirrored(v, ray, pane, share, want & 1 << TRACE_R_F, guess.room, &s);
    if (!bare && v->optics && v->optics->dirt > 0) add_dirt(v, ray, pane, &s);
    return s;
}

static float brightness(const Sample *s, unsigned want)
{
    float sum = 0;
    for (int l = 0; l < TRACE_LAYERS; l++)
        if (want & 1u << l) sum += s->layer[l].x + 2 * s->layer[l].y + s->layer[l].z;
    return sum;
}

static void agree(int *a, int b)
{
    if (*a != b) *a = UNKNOWN;
}

// The mean over a pixel: four samples where they agree, sixteen where they do not.
static Sample take_pixel(const View *v, int x, int y, unsigned want, Rng *rng)
{
    // Strata in the order of use: the first four have a row and a column each.
    static const unsigned char order[SIDE * SIDE] = {1, 7, 8, 14, 0, 2, 3, 4, 5, 6, 9, 10, 11, 12, 13, 15};
    Sample sum = {0};
    Met met = {0}, guess = {UNKNOWN, UNKNOWN, UNKNOWN};
    float low = 1e30f, high = 0;
    int n = 0;
    for (; n < SIDE * SIDE; n++) {
        if (n == BASE) {
            if (high - low < 0.06f * high + 1e-3f) break;
            guess = met;
            if (guess.behind < 0) guess.shadow = UNKNOWN;
        }
        float px = (float)x + ((float)(order[n] % SIDE) + fs_rng_uniform(rng)) / SIDE;
        float py = (float)y + ((float)(order[n] / SIDE) + fs_rng_uniform(rng)) / SIDE;
        Sample s = take_sample(v, px, py, want, guess, rng);
        if (n == 0) met = s.met;
        agree(&met.behind, s.met.behind);
        agree(&met.room, s.met.room);
        agree(&met.shadow, s.met.shadow);
        float b = brightness(&s, want);
        low = fminf(low, b);
        high = fmaxf(high, b);
        for (int l = 0; l < TRACE_LAYERS; l++) sum.layer[l] = vec_add(sum.layer[l], s.layer[l]);
    }
    for (int l = 0; l < TRACE_LAYERS; l++) sum.layer[l] = vec_scale(sum.layer[l], 1.0f / (float)n);
    return sum;
}

typedef struct Job {
    const View *view;
    unsigned want;
    uint64_t seed;
    Traced *traced;
    Image *mask;
    Geometry *geometry;
    int width;
} Job;

static void row_job(void *context, int y, int worker)
{
    const Job *job = context;
    (void)worker;
    for (int x = 0; x < job->width; x++) {
        Rng rng = fs_rng_new(job->seed + (uint64_t)y * 65536u + (uint64_t)x);
        Sample s = take_pixel(job->view, x, y, job->want, &rng);
        for (int l = 0; l < TRACE_LAYERS; l++)
            if (job->want & 1u << l) memcpy(fs_image_at(&job->traced->layer[l], x, y), &s.layer[l], sizeof s.layer[l]);
    }
}

static void see_through(View *view, const Optics *optics)
{
    const Layout *l = view->layout;
    view->optics = optics;
    view->room_light = fs_world_mean_light(&l->room);
    view->dirt_light = vec_scale(fs_world_mean_light(&l->behind), 0.5f * view->light->behind);
    view->dirt_light = vec_mad(view->dirt_light, view->room_light, 0.5f * view->light->room); // from both sides
}

int fs_trace_view(const Layout *layout, const Spec *spec, const Lighting *lighting, TraceRequest request,
                  Threads *threads, Traced *traced, FsError *err)
{
    const Camera *camera = request.camera;
    unsigned want = request.want;
    int rc = 0;
    *traced = (Traced){0};
    for (int l = 0; l < TRACE_LAYERS; l++)
        if (want & 1u << l) TRY(fs_image_new(&traced->layer[l], camera->width, camera->height, 3, err));
    View view = view_of(layout, lighting, camera);
    if (request.optics) see_through(&view, request.optics);
    Job job = {.view = &view, .want = want, .traced = traced, .width = camera->width};
    job.seed = ((uint64_t)spec->seed << 48) ^ ((uint64_t)(unsigned)request.number << 32);
    fs_threads_for(threads, camera->height, row_job, &job);
    return 0;
fail:
    fs_trace_free(traced);
    return rc;
}

static void geometry_job(void *context, int y, int worker)
{
    const Job *job = context;
    const View *v = job->view;
    (void)worker;
    for (int x = 0; x < job->width; x++) {
        Ray ray = {v->eye, pixel_ray(v, (float)x + 0.5f, (float)y + 0.5f)};
        Hit hit = {.t = 1e9f};
        bool found = fs_bvh_hit(&v->layout->behind.bvh, ray.from, ray.d, &hit);
        bool bare = found && fs_world_surface_of(&v->layout->behind, &hit)->in_front;
        float along = vec_dot(ray.d, v->ahead), pane = pane_distance(v, ray);
        *fs_image_at(&job->geometry->depth_T, x, y) = found ? hit.t * along : 0.0f;
        GlassShare share = bare ? (GlassShare){0, 0, 1} : glass_along(v, ray.d);
        *fs_image_at(&job->geometry->beta, x, y) = share.front + share.rear;
        Ray back = {vec_mad(ray.from, ray.d, pane), vec_reflect(ray.d, v->layout->pane_normal)};
        bool mirrored = !bare && pane < 1e8f && search(&v->layout->room, back.from, back.d, NOTHING, &hit);
        *fs_image_at(&job->geometry->depth_R, x, y) = mirrored ? (pane + hit.t) * along : 0.0f;
    }
}

int fs_trace_geometry(const Layout *layout, const Lighting *lighting, const Camera *camera, Threads *threads,
                      Geometry *geometry, FsError *err)
{
    *geometry = (Geometry){0};
    MUST(fs_image_new(&geometry->depth_T, camera->width, camera->height, 1, err));
    MUST(fs_image_new(&geometry->depth_R, camera->width, camera->height, 1, err));
    MUST(fs_image_new(&geometry->beta, camera->width, camera->height, 1, err));
    View view = view_of(layout, lighting, camera);
    Job job = {.view = &view, .geometry = geometry, .width = camera->width};
    fs_threads_for(threads, camera->height, geometry_job, &job);
    return 0;
}

void fs_trace_geometry_free(Geometry *geometry)
{
    fs_image_free(&geometry->depth_T);
    fs_image_free(&geometry->depth_R);
    fs_image_free(&geometry->beta);
}

static void figures_job(void *context, int y, int worker)
{
    const Job *job = context;
    const View *v = job->view;
    (void)worker;
    for (int x = 0; x < job->width; x++) {
        Ray ray = {v->eye, pixel_ray(v, (float)x + 0.5f, (float)y + 0.5f)};
        float pane = pane_distance(v, ray);
        Mirrored m;
        Hit hit;
        bool found = search(&v->layout->behind, ray.from, ray.d, NOTHING, &hit);
        if (pane > 1e8f || (found && fs_world_surface_of(&v->layout->behind, &hit)->in_front)) continue;
        Ray back = {vec_mad(ray.from, ray.d, pane), vec_reflect(ray.d, v->layout->pane_normal)};
        bool seen = look_into_room(v, back, pane, NOTHING, &m) && m.prim == NOTHING;
        *fs_image_at(job->mask, x, y) = seen ? 1.0f : 0.0f;
    }
}

int fs_trace_figures(const Layout *layout, TraceRequest request, Threads *threads, Image *mask, FsError *err)
{
    const Lighting none = {0};
    const Camera *camera = request.camera;
    MUST(fs_image_new(mask, camera->width, camera->height, 1, err));
    View view = view_of(layout, &none, camera);
    view.optics = request.optics;
    Job job = {.view = &view, .mask = mask, .width = camera->width};
    fs_threads_for(threads, camera->height, figures_job, &job);
    return 0;
}

// ---- balance ----

enum { PROBE_WIDTH = 96, MEAN_VIEWS = 6 };

static double mean_of(const Image *image)
{
    size_t n = fs_image_values(image);
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += (double)image->px[i];
    return sum / (double)n;
}

int fs_trace_balance(const Layout *layout, const Spec *spec, const Shot *shot, Threads *threads, Lighting *lighting,
                     FsError *err)
{
    const float target = 0.11f; // mean linear value of a no-flash photo
    const float even = 0.06f;   // of the flash's light, comes after many bounces from everywhere
    Lighting unit = {
        .behind = 1, .room = 1, .flash = 1, .flash_back = 1, .refraction = fs_glass_refraction(layout, spec->f0)};
    double mean[TRACE_LAYERS] = {0};
    int n = spec->photos, views = n < MEAN_VIEWS ? n : MEAN_VIEWS;
    for (int i = 0; i < views; i++) { // means of all layers over a few of the photos, at a small size
        Camera small = fs_camera_limited(&shot[i * n / views].camera, PROBE_WIDTH);
        Traced traced;
        MUST(fs_trace_view(layout, spec, &unit, (TraceRequest){&small, NULL, (1 << TRACE_LAYERS) - 1, 100000 + i},
                           threads, &traced, err));
        for (int l = 0; l < TRACE_LAYERS; l++) mean[l] += mean_of(&traced.layer[l]) / views;
        fs_trace_free(&traced);
    }
    double t = fmax(mean[TRACE_T_N], 1e-9), flash = fmax(mean[TRACE_T_F] - mean[TRACE_T_N], 1e-9);
    double r = fmax(mean[TRACE_R_N], 1e-9), back = fmax(mean[TRACE_R_F] - mean[TRACE_R_N], 1e-9);
    *lighting = unit;
    lighting->behind = (float)(target * (1 - spec->reflection) / t);
    lighting->room = (float)(target * spec->reflection / r);
    lighting->flash = (float)(target * (1 - spec->reflection) * spec->alpha * (1 - even) / flash);
    // of what comes back, most comes from the flash's mirror image, the rest from everywhere
    lighting->flash_back = (float)(0.6 * spec->flash_return * target * spec->reflection / back);
    lighting->even_back = 0.4f * spec->flash_return;
    lighting->even = even * spec->alpha;
    return 0;
}
