// What a photo's values mean: as its file says, and as numbers that make linear light of them.
#pragma once

#include "image/image.h"

struct LightTag {
    void *icc; // colour profile, to be freed (fs_profile_tag_free); NULL: none
    size_t icc_size;
    double gamma;                                                      // light = value^gamma; 0: the file does not say
    bool srgb, linear;                                                 // so it says
    enum { COLORS_SRGB, COLORS_ADOBE, COLORS_P3, COLORS_2020 } colors; // primaries, where there is no profile
    bool deep;                                                         // integers of more than 8 bits
};
void fs_profile_tag_free(LightTag *tag);

enum { PROFILE_STEPS = 4096 };
typedef struct Profile {
    bool linear;                       // values are proportional to light
    bool srgb_curve, srgb_colors;      // to the precision of 8 bits: then the next two are not used
    float curve[3][PROFILE_STEPS + 1]; // light of values from 0 to 1
    float srgb_from_linear[9];         // (3, 3) of the profile's linear light; grey stays grey
} Profile;
// An RGB or grey ICC profile of curves and primaries. False for anything else, damaged ones included.
bool fs_profile_read(Profile *profile, const void *icc, size_t size);
typedef enum ProfileSource {
    PROFILE_TOLD,   // or not told, and sRGB as display values are
    PROFILE_UNTOLD, // nothing says so, yet deep values are taken for linear light, as RAW converters write them
    PROFILE_UNREAD, // there is an ICC profile that cannot be read: what else the file says, or sRGB
} ProfileSource;
// The profile of the values of such a file, and how it is known.
ProfileSource fs_profile_of_tag(Profile *profile, const LightTag *tag);
// A row of n pixels in place; values outside 0..1 are taken for the nearest.
void fs_profile_linearise(const Profile *profile, float *rgb, size_t n);

// ---- for what is written ----

extern const double fs_profile_srgb_from_xyz[9]; // (3, 3) linear light in sRGB's primaries of XYZ under D65

typedef enum ProfileSpace { PROFILE_SRGB, PROFILE_P3 } ProfileSpace; // Display P3; both with sRGB's curve
// The ICC profile of a space, the same bytes each time. Free it.
int fs_profile_make(ProfileSpace space, void **icc, size_t *size, FsError *err);
// A row of n pixels from linear light in sRGB's primaries to linear light in those of the space, in place.
void fs_profile_to_space(ProfileSpace space, float *rgb, size_t n);
