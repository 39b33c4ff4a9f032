// The setting "hard": a table of words and what each changes.
#include "synth/spec.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/rng.h"

static void weak_flash(Spec *s)
{
    s->alpha = 0.3f;
}

static void strong_reflection(Spec *s)
{
    s->reflection = 0.6f;
    s->f0 = 0.3f;
}

static void few_photos(Spec *s)
{
    s->photos = s->photos < 12 ? s->photos : 12;
}

static void low_texture(Spec *s)
{
    s->texture_keep = 0.25f;
}

static void depth_overlap(Spec *s)
{
    s->depth_stretch = 2.2f;
    s->room_size = 0.6f;
}

static void frame(Spec *s)
{
    s->frame = true;
}

static void flash_return(Spec *s)
{
    s->flash_return = 0.05f + 0.05f * (float)(s->seed * 2654435761u >> 8 & 255) / 255.0f;
}

static void bright_near_room(Spec *s)
{
    s->reflection = fmaxf(s->reflection, 0.55f);
    s->f0 = 0.1f;
    s->room_size = 0.55f;
    s->texture_keep = 0.35f;
}

static void dark(Spec *s)
{
    s->shade = 1.0f;
    s->black = 0.5f;
}

static void wide_path(Spec *s)
{
    s->path_scale = 1.5f;
    s->follow = 1.0f; // the outer parts of the scene are seen by few photos
}

static void pose_noise(Spec *s)
{
    s->pose_noise = true;
}

static const struct {
    const char *word;
    void (*apply)(Spec *spec);
} difficulties[] = {
    {"weak-flash", weak_flash},
    {"strong-reflection", strong_reflection},
    {"few-photos", few_photos},
    {"low-texture", low_texture},
    {"depth-overlap", depth_overlap},
    {"frame", frame},
    {"flash-return", flash_return},
    {"bright-near-room", bright_near_room},
    {"dark", dark},
    {"wide-path", wide_path},
    {"pose-noise", pose_noise},
};
#define N_DIFFICULTIES (sizeof difficulties / sizeof *difficulties)

static int apply_word(Spec *spec, const char *word, size_t length, FsError *err)
{
    char known[300] = "";
    for (size_t i = 0; i < N_DIFFICULTIES; i++) {
        if (strlen(difficulties[i].word) == length && strncmp(difficulties[i].word, word, length) == 0) {
            difficulties[i].apply(spec);
            return 0;
        }
        snprintf(known + strlen(known), sizeof known - strlen(known), "%s%s", i ? ", " : "", difficulties[i].word);
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
                   .follow = 0.35f};
    spec->f0 = fminf(fmaxf(0.5f * spec->reflection, 0.04f), 0.4f);
    if (settings->synth_width * (int64_t)settings->synth_height > 64 << 20)
        return fs_error_set(err, FS_ERR_USAGE, "--width, --height: %dx%d is more than 64 megapixels; choose less",
                            settings->synth_width, settings->synth_height);
    for (const char *p = settings->synth_hard; p && *p;) {
        size_t length = strcspn(p, ",");
        int rc = length ? apply_word(spec, p, length, err) : 0;
        if (rc < 0) return rc;
        p += length + (p[length] == ',');
    }
    return 0;
}
