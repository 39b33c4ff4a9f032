#include "image/profile.h"

#include <errno.h>
#include <lcms2.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/tone.h"

// XYZ under D50, as profiles have it.
static const double known_colors[][9] = {
    [COLORS_ADOBE] = {0.6097559, 0.2052401, 0.1492240, 0.3111242, 0.6256560, 0.0632197, 0.0194811, 0.0608902,
                      0.7448387},
    [COLORS_P3] = {0.5151187, 0.2919778, 0.1571035, 0.2411892, 0.6922441, 0.0665668, -0.0010505, 0.0418791, 0.7840713},
    [COLORS_2020] = {0.6734241, 0.1656411, 0.1251286, 0.2790177, 0.6753402, 0.0456377, -0.0019300, 0.0299784,
                     0.7973330},
};
static const double srgb_from_xyz_d50[9] = {3.1338561, -1.6168667, -0.4906146, -0.9787684, 1.9161415,
                                            0.0334540, 0.0719453,  -0.2289914, 1.4052427};
const double fs_profile_srgb_from_xyz[9] = {3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108,
                                            0.0415560, 0.0556434,  -0.2040259, 1.0572252};
#define ADOBE_GAMMA 2.19921875
#define WILDEST 4.0       // entry of the matrix; the widest profiles in use have 2
#define SAME_COLORS 0.004 // of an entry of the matrix
#define SAME_CURVE 0.002  // of light

void fs_profile_tag_free(LightTag *tag)
{
    free(tag->icc);
    *tag = (LightTag){0};
}

static void set_srgb(Profile *p)
{
    memset(p, 0, sizeof *p);
    p->srgb_curve = p->srgb_colors = true;
}

// False where white is not white.
static bool set_colors(Profile *p, const double xyz_from_rgb[9])
{
    double worst = 0;
    for (int r = 0; r < 3; r++) {
        double row[3], sum = 0;
        for (int c = 0; c < 3; c++) {
            row[c] = 0;
            for (int k = 0; k < 3; k++) row[c] += srgb_from_xyz_d50[3 * r + k] * xyz_from_rgb[3 * k + c];
            sum += row[c];
        }
        if (!(fabs(sum - 1) < 0.05)) return false;
        for (int c = 0; c < 3; c++) {
            if (!(fabs(row[c]) < WILDEST)) return false;
            p->srgb_from_linear[3 * r + c] = (float)(row[c] / sum);
            worst = fmax(worst, fabs(row[c] / sum - (r == c)));
        }
    }
    p->srgb_colors = worst < SAME_COLORS;
    return true;
}

// After the curves are there: are they the usual ones?
static void look_at_curves(Profile *p)
{
    double from_linear = 0, from_srgb = 0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i <= PROFILE_STEPS; i++) {
            float v = (float)i / PROFILE_STEPS, light = p->curve[c][i];
            from_linear = fmax(from_linear, fabs((double)light - (double)v));
            from_srgb = fmax(from_srgb, fabs((double)light - (double)fs_tone_srgb_decode(v)));
        }
    p->linear = from_linear < SAME_CURVE;
    p->srgb_curve = from_srgb < SAME_CURVE;
}

static void set_gamma(Profile *p, double gamma)
{
    for (int c = 0; c < 3; c++)
        for (int i = 0; i <= PROFILE_STEPS; i++) p->curve[c][i] = (float)pow((double)i / PROFILE_STEPS, gamma);
    look_at_curves(p);
}

static bool set_curve(float curve[PROFILE_STEPS + 1], const cmsToneCurve *from)
{
    if (!from) return false;
    for (int i = 0; i <= PROFILE_STEPS; i++) {
        curve[i] = cmsEvalToneCurveFloat(from, (float)i / PROFILE_STEPS);
        if (!isfinite(curve[i]) || curve[i] < -0.01f || curve[i] > 1.01f) return false;
        if (i > 0 && curve[i] < curve[i - 1] - 1e-3f) return false;
    }
    return curve[PROFILE_STEPS] > 0.5f;
}

static bool read_rgb(Profile *p, cmsHPROFILE icc)
{
    static const cmsTagSignature curves[3] = {cmsSigRedTRCTag, cmsSigGreenTRCTag, cmsSigBlueTRCTag};
    static const cmsTagSignature colors[3] = {cmsSigRedColorantTag, cmsSigGreenColorantTag, cmsSigBlueColorantTag};
    double xyz[9];
    for (int c = 0; c < 3; c++) {
        const cmsCIEXYZ *color = cmsReadTag(icc, colors[c]);
        if (!color || !set_curve(p->curve[c], cmsReadTag(icc, curves[c]))) return false;
        xyz[c] = color->X, xyz[3 + c] = color->Y, xyz[6 + c] = color->Z;
    }
    return set_colors(p, xyz);
}

static bool read_grey(Profile *p, cmsHPROFILE icc)
{
    p->srgb_colors = true;
    if (!set_curve(p->curve[0], cmsReadTag(icc, cmsSigGrayTRCTag))) return false;
    for (int c = 1; c < 3; c++) memcpy(p->curve[c], p->curve[0], sizeof p->curve[0]);
    return true;
}

bool fs_profile_read(Profile *profile, const void *icc, size_t size)
{
    set_srgb(profile);
    errno = 0;
    cmsContext context = cmsCreateContext(NULL, NULL); // says nothing of its own
    cmsHPROFILE h =
        context && size <= UINT32_MAX ? cmsOpenProfileFromMemTHR(context, icc, (cmsUInt32Number)size) : NULL;
    bool good = false;
    if (h)
        good = cmsGetColorSpace(h) == cmsSigGrayData  ? read_grey(profile, h)
               : cmsGetColorSpace(h) == cmsSigRgbData ? read_rgb(profile, h)
                                                      : false;
    if (h) cmsCloseProfile(h);
    if (context) cmsDeleteContext(context);
    if (errno == ENOMEM) fs_error_memory(NULL); // not a profile that cannot be read
    if (good)
        look_at_curves(profile);
    else
        set_srgb(profile);
    return good;
}

ProfileSource fs_profile_of_tag(Profile *profile, const LightTag *tag)
{
    set_srgb(profile);
    if (tag->icc && fs_profile_read(profile, tag->icc, tag->icc_size)) return PROFILE_TOLD;
    bool silent = !tag->icc && !tag->srgb && tag->gamma <= 0 && !tag->linear && tag->colors == COLORS_SRGB;
    if (tag->colors != COLORS_SRGB) set_colors(profile, known_colors[tag->colors]);
    if (tag->linear || (silent && tag->deep)) {
        profile->linear = true;
    } else if (tag->colors == COLORS_ADOBE) {
        set_gamma(profile, ADOBE_GAMMA);
    } else if (!tag->icc && !tag->srgb && tag->gamma > 0.2 && tag->gamma < 5 && fabs(tag->gamma - 2.2) > 0.05) {
        set_gamma(profile, tag->gamma);
    }
    return tag->icc ? PROFILE_UNREAD : silent && tag->deep ? PROFILE_UNTOLD : PROFILE_TOLD;
}

static float look_up(const float *curve, float v)
{
    float at = (v > 0 ? v < 1 ? v : 1 : 0) * PROFILE_STEPS; // NaN becomes 0
    int i = (int)at < PROFILE_STEPS ? (int)at : PROFILE_STEPS - 1;
    return curve[i] + (at - (float)i) * (curve[i + 1] - curve[i]);
}

void fs_profile_linearise(const Profile *profile, float *rgb, size_t n)
{
    const float *m = profile->srgb_from_linear;
    for (size_t i = 0; i < 3 * n && !profile->linear; i++)
        rgb[i] = profile->srgb_curve ? fs_tone_srgb_decode(rgb[i]) : look_up(profile->curve[i % 3], rgb[i]);
    for (size_t i = 0; i < n && !profile->srgb_colors; i++) {
        float r = rgb[3 * i], g = rgb[3 * i + 1], b = rgb[3 * i + 2];
        for (int c = 0; c < 3; c++) rgb[3 * i + (size_t)c] = m[3 * c] * r + m[3 * c + 1] * g + m[3 * c + 2] * b;
    }
}

// ---- for what is written ----

static cmsHPROFILE make_profile(cmsContext context, ProfileSpace space, const char *name)
{
    static const cmsCIExyYTRIPLE primaries[] = {
        [PROFILE_SRGB] = {{0.64, 0.33, 1}, {0.30, 0.60, 1}, {0.15, 0.06, 1}},
        [PROFILE_P3] = {{0.680, 0.320, 1}, {0.265, 0.690, 1}, {0.150, 0.060, 1}},
    };
    const cmsCIExyY d65 = {0.3127, 0.3290, 1};
    const double curve[5] = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
    cmsToneCurve *one = cmsBuildParametricToneCurve(context, 4, curve), *three[3] = {one, one, one};
    cmsHPROFILE h = one ? cmsCreateRGBProfileTHR(context, &d65, &primaries[space], three) : NULL;
    cmsMLU *text[2] = {cmsMLUalloc(context, 1), cmsMLUalloc(context, 1)};
    bool good = h && text[0] && text[1] && cmsMLUsetASCII(text[0], "en", "US", name) &&
                cmsMLUsetASCII(text[1], "en", "US", "No copyright, use freely") &&
                cmsWriteTag(h, cmsSigProfileDescriptionTag, text[0]) && cmsWriteTag(h, cmsSigCopyrightTag, text[1]);
    for (int i = 0; i < 2; i++) cmsMLUfree(text[i]);
    if (one) cmsFreeToneCurve(one);
    if (good) return h;
    if (h) cmsCloseProfile(h);
    return NULL;
}

int fs_profile_make(ProfileSpace space, void **icc, size_t *size, FsError *err)
{
    static const unsigned char date[12] = {0x07, 0xe8, 0, 1, 0, 1}; // instead of now
    cmsUInt32Number n = 0;
    cmsContext context = cmsCreateContext(NULL, NULL);
    cmsHPROFILE h = context ? make_profile(context, space, space == PROFILE_P3 ? "Display P3" : "sRGB") : NULL;
    *icc = h && cmsSaveProfileToMem(h, NULL, &n) ? malloc(n) : NULL;
    bool good = *icc && cmsSaveProfileToMem(h, *icc, &n) && n > 128;
    if (h) cmsCloseProfile(h);
    if (context) cmsDeleteContext(context);
    *size = n;
    if (good) memcpy((char *)*icc + 24, date, sizeof date);
    if (good) return 0;
    free(*icc);
    *icc = NULL;
    return fs_error_memory(err);
}

void fs_profile_to_space(ProfileSpace space, float *rgb, size_t n)
{
    static const float p3[9] = {0.8224620f, 0.1775380f, 0,          0.0331942f, 0.9668058f,
                                0,          0.0170826f, 0.0723974f, 0.9105199f};
    for (size_t i = 0; i < n && space == PROFILE_P3; i++) {
        float r = rgb[3 * i], g = rgb[3 * i + 1], b = rgb[3 * i + 2];
        for (int c = 0; c < 3; c++) rgb[3 * i + (size_t)c] = p3[3 * c] * r + p3[3 * c + 1] * g + p3[3 * c + 2] * b;
    }
}
