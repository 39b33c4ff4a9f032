// A list of names, each with a strength where it has one.
#include "synth/field.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name;
    float usual, most; // strength; most 0: it has none
} faults[FIELD_FAULTS] = {
    [FIELD_FLASH_JITTER] = {"flash-jitter", 0.08f, 0.3f}, // of the flash's power, one sigma
    [FIELD_DRIFT] = {"drift", 0.06f, 0.3f},               // of the room's light, one sigma; behind the pane half of it
    [FIELD_SHUTTER] = {"shutter", 0.4f, 1},               // share of the photos with another shutter
    [FIELD_VIGNETTING] = {"vignetting", 0.35f, 0.9f},     // light lost in the corner
    [FIELD_JPEG] = {"jpeg", 1, 2},                        // how far the camera's picture is from plain sRGB
    [FIELD_WHITE_BALANCE] = {"white-balance", 0.06f, 0.3f}, // of red and of blue, one sigma
    [FIELD_UNDER] = {"under", 1.5f, 6},                     // stops
    [FIELD_DISTORTION] = {"distortion", 1, 2},              // 1: about 3 % in the corner
    [FIELD_SHAKE] = {"shake", 2.5f, 20},                    // longest smear, pixels of a photo 600 wide
    [FIELD_PHOTOGRAPHER] = {"photographer", 1, 0},
    [FIELD_PEDESTRIAN] = {"pedestrian", 1, 0},
    [FIELD_DIRT] = {"dirt", 0.01f, 0.3f}, // share of the pane that it covers
    [FIELD_DOUBLE_GLAZING] = {"double-glazing", 1, 0},
    [FIELD_TINT] = {"tint", 0.25f, 0.9f},                  // light lost in the colour that loses most
    [FIELD_MIRRORED_FLASH] = {"mirrored-flash", 0.05f, 1}, // glare around it, of white; not among "all"
    [FIELD_DEFOCUS] = {"defocus", 1.5f, 20},               // diameter at infinity, pixels of a photo 600 wide
};

const char *fs_field_name(FieldFault fault)
{
    return faults[fault].name;
}

static int unknown(const char *word, int length, FsError *err)
{
    char known[300] = "all";
    for (int i = 0; i < FIELD_FAULTS; i++)
        snprintf(known + strlen(known), sizeof known - strlen(known), ", %s", faults[i].name);
    return fs_error_set(err, FS_ERR_USAGE, "--field: no fault '%.*s'; known are %s", length < 60 ? length : 60, word,
                        known);
}

static int read_strength(Field *field, int fault, const char *text, size_t length, FsError *err)
{
    char number[64], *end = number;
    const bool there_or_not = faults[fault].most <= 0;
    snprintf(number, sizeof number, "%.*s", (int)(length < sizeof number ? length : sizeof number - 1), text);
    double value = strtod(number, &end);
    bool is = there_or_not ? value == 0 || value == 1 : value >= 0 && (float)value <= faults[fault].most;
    if (is && end > number && !*end && length < sizeof number) {
        field->strength[fault] = (float)value;
        return 0;
    }
    if (there_or_not)
        return fs_error_set(err, FS_ERR_USAGE, "--field: %s takes 0 or 1, not '%s'", faults[fault].name, number);
    return fs_error_set(err, FS_ERR_USAGE, "--field: %s takes a strength of 0 to %g, not '%s'", faults[fault].name,
                        (double)faults[fault].most, number);
}

static int read_word(Field *field, const char *word, size_t length, FsError *err)
{
    const char *equals = memchr(word, '=', length);
    size_t name = equals ? (size_t)(equals - word) : length;
    bool all = name == 3 && strncmp(word, "all", 3) == 0, found = all;
    if (all && equals) return fs_error_set(err, FS_ERR_USAGE, "--field: all takes no strength; name faults that do");
    for (int i = 0; i < FIELD_FAULTS; i++) {
        bool named = strlen(faults[i].name) == name && strncmp(faults[i].name, word, name) == 0;
        if (named || (all && i != FIELD_MIRRORED_FLASH)) field->strength[i] = faults[i].usual;
        if (named && equals) MUST(read_strength(field, i, equals + 1, length - name - 1, err));
        found = found || named;
    }
    return found ? 0 : unknown(word, (int)name, err);
}

int fs_field_read(Field *field, const char *list, FsError *err)
{
    *field = (Field){0};
    for (const char *p = list; p && *p;) {
        size_t length = strcspn(p, ",");
        if (length) MUST(read_word(field, p, length, err));
        p += length + (p[length] == ',');
    }
    for (int i = 0; i < FIELD_FAULTS; i++) field->any = field->any || field->strength[i] > 0;
    return 0;
}
