#include "model/findings_parts.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/order.h"
#include "model/alike.h"

enum {
    FEWEST = FS_PHOTOS_FOR_COLMAP,
    ADVISED = 10,   // photos of each lighting
    NEIGHBOURS = 6, // that a photo is compared with
    LEAST_TO_COMPARE = 3,
};
#define BLURRED 0.55    // of the neighbours' detail, in the worst direction
#define CLIPPED 0.05    // of a photo
#define WEAK_FLASH 0.12 // light that it adds
#define NO_FLASH 0.02
#define TOO_LITTLE 0.4 // of the usual step of brightness, in logarithms
#define FAR_STEPS 1.9  // of the path, to a photo of the other lighting
#define DARK 0.003     // mean light

void fs_findings_add(Findings *f, const char *kind, FindingWeight weight, const char *format, ...)
{
    if (fs_memory_grow(&f->finding, f->n, sizeof *f->finding, NULL) < 0) return; // counted there
    Finding *finding = &f->finding[f->n++];
    *finding = (Finding){.kind = kind, .weight = weight};
    va_list ap;
    va_start(ap, format);
    vsnprintf(finding->text, sizeof finding->text, format, ap);
    va_end(ap);
}

const char *fs_findings_names(const Photos *photos, const bool *marked, char text[200])
{
    size_t used = 0;
    int left = 0;
    text[0] = 0;
    for (int i = 0; i < photos->n; i++) {
        if (!marked[i]) continue;
        if (used + strlen(photos->photo[i].file) + 16 > 200)
            left++;
        else
            used += (size_t)snprintf(text + used, 200 - used, "%s%s", used ? ", " : "", photos->photo[i].file);
    }
    if (left) snprintf(text + used, 200 - used, "%s%d more", used ? " and " : "", left);
    return text;
}

int fs_findings_count(const bool *marked, int n)
{
    int sum = 0;
    for (int i = 0; i < n; i++) sum += marked[i];
    return sum;
}

// The photos nearest in order, of one lighting (-1: any), without i itself.
static int neighbours(const Photos *photos, int i, int flash, int at[NEIGHBOURS])
{
    int n = 0;
    for (int step = 1; step < photos->n && n < NEIGHBOURS; step++)
        for (int side = -1; side <= 1 && n < NEIGHBOURS; side += 2) {
            int k = i + side * step;
            if (k >= 0 && k < photos->n && (flash < 0 || photos->photo[k].flash == flash)) at[n++] = k;
        }
    return n;
}

// ---- sharpness ----

static void find_blur(Findings *f, Photos *photos, bool *marked)
{
    double worst = 1;
    char text[200];
    for (int i = 0; i < photos->n; i++) {
        PhotoFile *photo = &photos->photo[i];
        int at[NEIGHBOURS], n = neighbours(photos, i, photo->flash, at);
        if (n < LEAST_TO_COMPARE) n = neighbours(photos, i, -1, at);
        photo->sharpness = n < LEAST_TO_COMPARE ? 1 : INFINITY;
        for (int k = 0; k < LOOK_DIRECTIONS && n >= LEAST_TO_COMPARE; k++) {
            double usual[NEIGHBOURS];
            for (int j = 0; j < n; j++) usual[j] = photos->photo[at[j]].look.detail[k];
            double m = fs_order_median(usual, (size_t)n);
            photo->sharpness = fmin(photo->sharpness, m > 0 ? photo->look.detail[k] / m : 1);
        }
        marked[i] = photo->sharpness < BLURRED && !photo->stranger;
        worst = fmin(worst, photo->sharpness);
    }
    if (fs_findings_count(marked, photos->n))
        fs_findings_add(f, "blur", FINDING_DOUBT,
                        "blurred: %s (%.0f %% of their neighbours' detail at worst): retake them, or leave "
                        "them out",
                        fs_findings_names(photos, marked, text), 100 * worst);
}

// ---- flash ----

// Light beside that of the nearest photos of a lighting, in logarithms; NAN: nothing to compare with.
static double brighter_than(const Photos *photos, const double *light, int i, int flash)
{
    int at[NEIGHBOURS], n = neighbours(photos, i, flash, at);
    double usual[NEIGHBOURS];
    for (int k = 0; k < n; k++) usual[k] = light[at[k]];
    double m = fs_order_median(usual, (size_t)n);
    return n >= 2 && m > 0 && light[i] > 0 ? log(light[i] / m) : NAN;
}

static double usual_step(const Photos *photos, const double *light, double *scratch)
{
    int n = 0;
    for (int i = 0; i < photos->n; i++) {
        double step = photos->photo[i].flash == 1 ? brighter_than(photos, light, i, 0) : NAN;
        if (isfinite(step)) scratch[n++] = step;
    }
    return n ? fs_order_median(scratch, (size_t)n) : NAN;
}

// The photos' light as if all had one exposure; those that do not tell theirs count as having the usual one.
static void undo_exposure(const Photos *photos, double *light)
{
    fs_photos_exposures(photos, light);
    double usual = fs_photos_median(light, photos->n);
    for (int i = 0; i < photos->n; i++) {
        const PhotoFile *photo = &photos->photo[i];
        double exposure = light[i] > 0 ? light[i] : usual > 0 ? usual : 1;
        light[i] = photo->look.mean / photo->look_gain / exposure;
    }
}

static void find_wrong_flash(Findings *f, Photos *photos, double *light, bool *marked)
{
    char text[200];
    double *scratch = light + photos->n;
    undo_exposure(photos, light);
    double usual = usual_step(photos, light, scratch);
    f->flash_adds = exp(usual) - 1;
    if (!isfinite(usual)) return;
    if (f->flash_adds < WEAK_FLASH)
        fs_findings_add(f, "weak-flash", f->flash_adds < NO_FLASH ? FINDING_UNUSABLE : FINDING_DOUBT,
                        "the flash adds %.0f %% of light: %s", 100 * f->flash_adds,
                        f->flash_adds < NO_FLASH ? "is the flash state right, and does the flash reach the scene?"
                                                 : "go closer, set it stronger, or darken the room");
    for (int flash = 0; flash < 2 && f->flash_adds >= WEAK_FLASH; flash++) {
        for (int i = 0; i < photos->n; i++) {
            double other = (flash ? 1 : -1) * brighter_than(photos, light, i, !flash);
            double own = brighter_than(photos, light, i, flash);
            marked[i] = photos->photo[i].flash == flash && !photos->photo[i].stranger &&
                        photos->photo[i].look.clipped < CLIPPED && other < TOO_LITTLE * usual &&
                        fabs(other) < fabs(own);
            if (marked[i]) photos->photo[i].odd_light = true;
        }
        if (fs_findings_count(marked, photos->n))
            fs_findings_add(f, "wrong-flash", FINDING_DOUBT, "%s: %s: %s",
                            flash ? "counts as a flash photo, but no brighter than "
                                    "those without"
                                  : "counts as without flash, but as bright as those with it",
                            fs_findings_names(photos, marked, text),
                            flash ? "the flash did not reach it; retake it or correct its state"
                                  : "correct its state (--flash-list) or retake it");
    }
}

// The flash was on (EXIF: fire always) and did not go off.
static void find_misfires(Findings *f, const Photos *photos, bool *marked)
{
    char text[200];
    int flash = 0;
    for (int i = 0; i < photos->n; i++) {
        int field = photos->photo[i].exif.flash;
        marked[i] = field >= 0 && (field & 0x19) == 8 && photos->photo[i].flash == 0;
        flash += photos->photo[i].flash == 1;
    }
    int n = fs_findings_count(marked, photos->n);
    if (n)
        fs_findings_add(f, "misfire", FINDING_DOUBT,
                        "the flash did not fire in %d of %d photos, though it was on: %s: let it charge", n, n + flash,
                        fs_findings_names(photos, marked, text));
}

// Twins count once.
static void find_few(Findings *f, const Photos *photos)
{
    int n[2] = {0, 0}, twins[2] = {0, 0};
    for (int i = 0; i < photos->n; i++) {
        const PhotoFile *photo = &photos->photo[i];
        n[photo->flash == 1] += photo->twin_of < 0 && !photo->stranger;
        twins[photo->flash == 1] += photo->twin_of >= 0;
    }
    for (int flash = 0; flash < 2; flash++)
        if (n[flash] < ADVISED)
            fs_findings_add(f, "few", n[flash] < FEWEST ? FINDING_UNUSABLE : FINDING_DOUBT,
                            "only %d photos %s flash%s: %s; take 10 to 15 of each kind", n[flash],
                            flash ? "with" : "without", twins[flash] ? " from different places" : "",
                            n[flash] < FEWEST ? "COLMAP needs 5 of each to find their poses"
                                              : "what few photos see is left to chance");
}

// ---- photos that show the same, or something else ----

static void find_copies(Findings *f, const Photos *photos)
{
    if (photos->copies)
        fs_findings_add(f, "copy", FINDING_HINT, "%d photos are others under another name and are left out: %s",
                        photos->copies, photos->copies_names);
    for (int i = 0; i < photos->n; i++)
        for (int k = 0; k < i; k++) {
            const PhotoFile *a = &photos->photo[k], *b = &photos->photo[i];
            if (!a->look.hash || a->look.hash != b->look.hash || a->flash == b->flash) continue;
            fs_findings_add(
                f, "both", FINDING_DOUBT,
                "%s and %s are one picture that counts as with flash and as without: take the wrong one away", a->file,
                b->file);
        }
}

// "A and B", "A, B and C": who shows the same, each group by itself.
static void find_twins(Findings *f, const Photos *photos, bool *marked)
{
    char text[200];
    for (int first = 0; first < photos->n; first++) {
        for (int i = 0; i < photos->n; i++) marked[i] = i == first || photos->photo[i].twin_of == first;
        if (fs_findings_count(marked, photos->n) > 1)
            fs_findings_add(
                f, "twin", FINDING_HINT,
                "taken from one place: %s: what shows the same again adds nothing; step 5 to 10 cm between photos",
                fs_findings_names(photos, marked, text));
    }
}

// Another zoom is said as such, and a blurred photo is hardly like any other.
static void find_strangers(Findings *f, const Photos *photos, double *focal, bool *marked)
{
    char text[200];
    int n = photos->n;
    fs_findings_camera_zoomed(photos, focal, marked);
    for (int i = 0; i < n; i++) marked[i] = photos->photo[i].stranger && !marked[i];
    if (fs_findings_count(marked, n))
        fs_findings_add(
            f, "stranger", FINDING_DOUBT,
            "nothing in common with the other photos: %s: of another place, or too far from them; leave them out, or "
            "take more between",
            fs_findings_names(photos, marked, text));
}

static void find_unreadable(Findings *f, const Photos *photos)
{
    if (photos->left_out)
        fs_findings_add(f, "unreadable", FINDING_DOUBT, "left out: %s (%s)", photos->left_out_names,
                        photos->left_out_why.message);
}

// Where a photo stands on the path, in usual steps: by the numbers of the names, which tell of photos that were taken
// away, or by their order.
static void find_places(const Photos *photos, double *place, double *scratch)
{
    int n = photos->n;
    bool numbered = n > 1;
    for (int i = 0; i < n; i++) {
        const char *name = photos->photo[i].name, *first = photos->photo[0].name;
        size_t prefix = strlen(name);
        while (prefix > 0 && strchr("0123456789", name[prefix - 1])) prefix--;
        size_t digits = strlen(name + prefix); // more are a time's
        numbered = numbered && digits > 0 && digits < 6 && strncmp(name, first, prefix) == 0;
        place[i] = numbered ? strtod(name + prefix, NULL) : i;
    }
    for (int i = 0; i + 1 < n && numbered; i++) {
        scratch[i] = place[i + 1] - place[i];
        numbered = scratch[i] > 0;
    }
    double step = numbered ? fs_order_median(scratch, (size_t)n - 1) : 1;
    for (int i = 0; i < n; i++) place[i] = numbered ? place[i] / step : i;
}

// As bright as it is; else as it counts.
static int lighting(const PhotoFile *photo)
{
    return photo->odd_light ? !photo->flash : photo->flash;
}

static double find_nearest(Photos *photos, const double *place, int i)
{
    double nearest = 0;
    photos->photo[i].beside = -1;
    for (int k = 0; k < photos->n; k++) {
        double distance = fabs(place[k] - place[i]);
        if (lighting(&photos->photo[k]) == lighting(&photos->photo[i])) continue;
        if (photos->photo[i].beside >= 0 && distance >= nearest) continue;
        nearest = distance;
        photos->photo[i].beside = k;
    }
    return nearest;
}

// Photos from which the nearest one of the other lighting is two or more steps away, together with another such one, or
// three alone. Nothing is said of captures that were taken one lighting after the other.
static void find_gaps(Findings *f, Photos *photos, double *place, bool *marked)
{
    int n = photos->n, changes = 0;
    double *nearest = place + n + 1;
    find_places(photos, place, nearest);
    for (int i = 0; i < n; i++) nearest[i] = find_nearest(photos, place, i);
    for (int i = 0; i < n; i++) {
        bool before = i > 0 && lighting(&photos->photo[i - 1]) == lighting(&photos->photo[i]);
        bool after = i + 1 < n && lighting(&photos->photo[i + 1]) == lighting(&photos->photo[i]);
        changes += i > 0 && !before;
        marked[i] = nearest[i] > FAR_STEPS + 1 || (nearest[i] > FAR_STEPS && before && nearest[i - 1] > FAR_STEPS) ||
                    (nearest[i] > FAR_STEPS && after && nearest[i + 1] > FAR_STEPS);
    }
    for (int i = 0; i < n && changes >= n / 6 && changes > 2; i++) {
        if (!marked[i]) continue;
        int last = i;
        while (last + 1 < n && marked[last + 1] && lighting(&photos->photo[last + 1]) == lighting(&photos->photo[i]))
            last++;
        const PhotoFile *a = &photos->photo[i], *b = &photos->photo[last];
        fs_findings_add(f, "gap", FINDING_DOUBT, "no photo %s flash near %s%s%s: take some there",
                        lighting(a) ? "without" : "with", a->file, last > i ? " to " : "", last > i ? b->file : "");
        i = last;
    }
}

static void find_light(Findings *f, const Photos *photos, bool *marked)
{
    char text[200];
    double worst = 0;
    int encoded = 0, untold = 0, automatic = 0;
    const char *odd = NULL;
    for (int i = 0; i < photos->n; i++) {
        marked[i] = photos->photo[i].look.clipped > CLIPPED;
        worst = fmax(worst, photos->photo[i].look.clipped);
        encoded += photos->photo[i].encoded;
        automatic += photos->photo[i].encoded && photos->photo[i].exif.white == WHITE_AUTO;
        untold += photos->photo[i].untold;
        if (photos->photo[i].untold) odd = photos->photo[i].file;
    }
    if (fs_findings_count(marked, photos->n))
        fs_findings_add(f, "clipped", FINDING_DOUBT,
                        "clipped: %s (%.0f %% of the picture at worst): expose less, all photos alike",
                        fs_findings_names(photos, marked, text), 100 * worst);
    for (int i = 0; i < photos->n; i++) marked[i] = photos->photo[i].look.mean / photos->photo[i].look_gain < DARK;
    if (fs_findings_count(marked, photos->n))
        fs_findings_add(f, "dark", FINDING_DOUBT, "very dark: %s: expose more, all photos alike",
                        fs_findings_names(photos, marked, text));
    if (encoded)
        fs_findings_add(f, "jpeg", FINDING_HINT,
                        "%d of %d photos are not RAW: set the camera to RAW where it can, it separates better", encoded,
                        photos->n);
    if (automatic)
        fs_findings_add(
            f, "white", FINDING_HINT,
            "%d of %d photos have an automatic white balance, which may differ from photo to photo: set it by hand, "
            "where they are not RAW",
            automatic, photos->n);
    if (untold)
        fs_findings_add(
            f, "untold", FINDING_HINT,
            "%d photos have more than 8 bits and no colour profile (e.g. %s): taken for linear light, as RAW "
            "converters write it; save them with their profile if they are not",
            untold, odd);
}

static void find_colors(Findings *f, const Photos *photos, bool *marked)
{
    char text[200];
    int n = photos->n;
    for (int i = 0; i < n; i++) marked[i] = photos->photo[i].look.grey;
    if (2 * fs_findings_count(marked, n) < n && fs_findings_count(marked, n))
        fs_findings_add(f, "grey", FINDING_DOUBT,
                        "without colour, which the others have: %s: retake them, or leave them out",
                        fs_findings_names(photos, marked, text));
    for (int i = 0; i < n; i++) marked[i] = photos->photo[i].unread;
    if (fs_findings_count(marked, n))
        fs_findings_add(
            f, "profile", FINDING_DOUBT,
            "a colour profile that cannot be read (expected curves and primaries): %s: taken for sRGB; save them in "
            "sRGB, Display P3 or Adobe RGB",
            fs_findings_names(photos, marked, text));
}

static int compare_times(const void *a, const void *b)
{
    const PhotoFile *s = a, *t = b;
    int by_time = strcmp(s->exif.taken, t->exif.taken);
    return by_time ? by_time : strverscmp(s->name, t->name);
}

// In the order in which they were taken, where all tell it; else as they are, by name.
static void put_in_order(Photos *photos)
{
    for (int i = 0; i < photos->n; i++)
        if (!*photos->photo[i].exif.taken) return;
    qsort(photos->photo, (size_t)photos->n, sizeof *photos->photo, compare_times);
}

int fs_findings_make(Findings *findings, Photos *photos, FsError *err)
{
    put_in_order(photos);
    *findings = (Findings){.flash_adds = NAN};
    size_t n = (size_t)photos->n + 1;
    bool *marked = calloc(n, sizeof *marked);
    double *value = calloc(2 * n, sizeof *value);
    int rc = marked && value ? fs_alike_compare(photos, err) : fs_error_memory(err);
    if (rc == 0) {
        find_unreadable(findings, photos);
        find_copies(findings, photos);
        find_few(findings, photos);
        find_strangers(findings, photos, value, marked);
        find_twins(findings, photos, marked);
        find_misfires(findings, photos, marked);
        find_wrong_flash(findings, photos, value, marked);
        find_gaps(findings, photos, value, marked);
        find_blur(findings, photos, marked);
        fs_findings_camera(findings, photos, value, marked);
        find_light(findings, photos, marked);
        find_colors(findings, photos, marked);
    }
    free(marked);
    free(value);
    return rc;
}

FindingWeight fs_findings_worst(const Findings *findings)
{
    FindingWeight worst = FINDING_HINT;
    for (int i = 0; i < findings->n; i++)
        if (findings->finding[i].weight > worst) worst = findings->finding[i].weight;
    return worst;
}

void fs_findings_free(Findings *findings)
{
    free(findings->finding);
    *findings = (Findings){0};
}
