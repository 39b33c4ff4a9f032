// The setting "hard": its words, and what each changes.
#include "synth/spec.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/rng.h"

enum {
    WEAK_FLASH,
    STRONG_REFLECTION,
    FEW_PHOTOS,
    LOW_TEXTURE,
    DEPTH_OVERLAP,
    FRAME,
    FLASH_RETURN,
    BRIGHT_NEAR_ROOM,
    DARK,
    WIDE_PATH,
    POSE_NOISE,
    PICTURE,
    STRAIGHT_ON,
    LIT,
    DIFFICULTIES
};

static const char *const words[DIFFICULTIES] = {
    "weak-flash", "strong-reflection", "few-photos",       "low-texture", "depth-overlap",
    "frame",      "flash-return",      "bright-near-room", "dark",        "wide-path",
    "pose-noise", "picture",           "straight-on",      "lit",
};

static void apply(Spec *s, int difficulty)
{
    switch (difficulty) {
    case WEAK_FLASH: s->alpha = 0.3f; break;
    case STRONG_REFLECTION:
        s->reflection = 0.6f;
        s->f0 = 0.3f;
        break;
    case FEW_PHOTOS: s->photos = s->photos < 12 ? s->photos : 12; break;
    case LOW_TEXTURE: s->texture_keep = 0.25f; break;
    case DEPTH_OVERLAP:
        s->depth_stretch = 2.2f;
        s->room_size = 0.6f;
        break;
    case FRAME: s->frame = true; break;
    case FLASH_RETURN: s->flash_return = 0.05f + 0.05f * (float)(s->seed * 2654435761u >> 8 & 255) / 255.0f; break;
    case BRIGHT_NEAR_ROOM:
        s->reflection = fmaxf(s->reflection, 0.55f);
        s->f0 = 0.1f;
        s->room_size = 0.55f;
        s->texture_keep = 0.35f;
        break;
    case DARK:
        s->shade = 1.0f;
        s->black = 0.5f;
        break;
    case WIDE_PATH:
        s->path_scale = 1.5f;
        s->follow = 1.0f; // the outer parts of the scene are seen by few photos
        break;
    case POSE_NOISE: s->pose_noise = true; break;
    case STRAIGHT_ON: s->turn = 0.15f; break;
    case LIT: s->lit = true; break;
    case PICTURE:
        s->picture = true;
        s->alpha = s->flash_return = 0;
        s->room_size = 1.6f;
        break;
    }
}

static int apply_word(Spec *spec, const char *word, size_t length, FsError *err)
{
    char known[300] = "";
    for (int i = 0; i < DIFFICULTIES; i++) {
        if (strlen(words[i]) == length && strncmp(words[i], word, length) == 0) {
            apply(spec, i);
            return 0;
        }
        snprintf(known + strlen(known), sizeof known - strlen(known), "%s%s", i ? ", " : "", words[i]);
    }
    return fs_error_set(err, FS_ERR_USAGE, "--hard: no difficulty '%.*s'; known are %s",
                        (int)(length < 60 ? length : 60), word, known);
}

// 0..1 from the seed, for what differs from scene to scene.
static float from_seed(unsigned seed, unsigned salt)
{
    Rng rng = fs_rng_new(seed * 7919ull + salt);
    return fs_rng_uniform(&rng);
}

int fs_spec_read(Spec *spec, const FsSettings *settings, FsError *err)
{
    *spec = (Spec){.seed = (unsigned)settings->seed,
                   .photos = settings->synth_photos,
                   .held_out = settings->synth_held_out,
                   .width = settings->synth_width,
                   .height = settings->synth_height,
                   .alpha = (float)settings->synth_alpha,
                   .reflection = (float)settings->synth_reflection,
                   .flash_return = 0.03f,
                   .texture_keep = 1.0f,
                   .depth_stretch = 1.0f,
                   .room_size = 1.0f,
                   .shade = from_seed((unsigned)settings->seed, 1),
                   .black = 0.05f + 0.2f * from_seed((unsigned)settings->seed, 2),
                   .path_scale = 1.0f,
                   .turn = 1.0f,
                   .follow = 0.35f};
    spec->f0 = fminf(fmaxf(0.5f * spec->reflection, 0.04f), 0.4f);
    if (settings->synth_width * (int64_t)settings->synth_height > 64 << 20)
        return fs_error_set(err, FS_ERR_USAGE, "--width, --height: %dx%d is more than 64 megapixels; choose less",
                            settings->synth_width, settings->synth_height);
    for (const char *p = settings->synth_hard; p && *p;) {
        size_t length = strcspn(p, ",");
        if (length) MUST(apply_word(spec, p, length, err));
        p += length + (p[length] == ',');
    }
    return fs_field_read(&spec->field, settings->synth_field, err);
}
