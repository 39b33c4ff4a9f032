#include "model/settings.h"

#include <errno.h>
#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"

#define OPTION(type_, name_, member, stages_, initial_, help_, ...)                                                    \
    {                                                                                                                  \
        .name = name_, .type = FS_OPTION_##type_, .stages = stages_, .initial = initial_, .help = help_,               \
        .offset = offsetof(Settings, member), __VA_ARGS__                                                              \
    }
#define NUMBER(type_, name_, member, stages_, initial_, min_, max_, argument_, help_)                                  \
    OPTION(type_, name_, member, stages_, initial_, help_, .min = min_, .max = max_, .argument = argument_)
#define BOOL(name_, member, stages_, help_) OPTION(BOOL, name_, member, stages_, "false", help_, .argument = NULL)
#define ON(name_, member, stages_, help_) OPTION(BOOL, name_, member, stages_, "true", help_, .argument = NULL)
#define INT(...) NUMBER(INT, __VA_ARGS__)
#define FLOAT(...) NUMBER(FLOAT, __VA_ARGS__)
#define STRING(name_, member, stages_, initial_, argument_, help_)                                                     \
    OPTION(STRING, name_, member, stages_, initial_, help_, .argument = argument_)
// A list, comma-separated.
#define LIST(name_, member, stages_, initial_, choices_, help_)                                                        \
    OPTION(STRING, name_, member, stages_, initial_, help_, .choices = choices_, .argument = "LIST")
#define ENUM(name_, member, stages_, initial_, choices_, help_)                                                        \
    OPTION(ENUM, name_, member, stages_, initial_, help_, .choices = choices_, .argument = choices_)

#define ALL FS_STAGE_ALL
#define INGEST FS_STAGE_INGEST
#define POSES FS_STAGE_POSES
#define INITIALISE FS_STAGE_INITIALISE
#define TRAIN FS_STAGE_TRAIN
#define RENDER FS_STAGE_RENDER
#define EVALUATE FS_STAGE_EVALUATE
#define EXPORT FS_STAGE_EXPORT
#define SYNTH FS_STAGE_SYNTH
#define PAIR FS_STAGE_PAIR
#define BENCH FS_STAGE_BENCH
#define CHECK FS_STAGE_CHECK
#define VIEW FS_STAGE_VIEW

static const FsOption table[] = {
    ENUM("preset", preset, INGEST | INITIALISE | TRAIN | RENDER, "standard", "preview|standard|best|paper|nerf|nerfren|flash-nerf",
         "named set of the settings below"),
    INT("threads", threads, ALL | SYNTH | BENCH | CHECK, "0", 0, 1024, "N", "threads to use; 0: one per core"),
    INT("seed", seed, INITIALISE | TRAIN | SYNTH, "1", 0, INT_MAX, "N", "seed of all random choices"),
    INT("long-edge", long_edge, INGEST | RENDER | PAIR, "1200", 0, 16384, "N",
        "longer side of the working images in pixels; 0: as shot"),
    BOOL("force", force, ALL, "redo what is already done"),
    ENUM("device", device, TRAIN | RENDER | EXPORT, "auto", "auto|cpu|reference",
         "what computes: the best at hand, the CPU's cores, or the plain definition (very slow, for tests)"),
    ENUM("cpu", cpu, TRAIN | RENDER | EXPORT | BENCH, "best", "best|scalar|avx2|avx512|neon",
         "highest instruction set to use"),

    STRING("flash-glob", flash_glob, INGEST | CHECK, "", "PATTERN",
           "file names that are flash photos, instead of EXIF"),
    STRING("flash-list", flash_list, INGEST | CHECK, "", "FILE",
           "text file with one flash photo's name per line, instead of EXIF; beside --flash-glob: these too"),

    STRING("masks", masks, INGEST, "", "DIR",
           "masks named as COLMAP's, PHOTO.png, but upright, black where the photo is not to be used (people, the photographer)"),

    FLOAT("npy-black", npy_black, INGEST | PAIR | CHECK, "2045", -1e12, 1e12, "X", "black level of .npy photos"),
    FLOAT("npy-white", npy_white, INGEST | PAIR | CHECK, "15092", -1e12, 1e12, "X", "white level of .npy photos"),
    STRING("npy-gains", npy_gains, INGEST | PAIR | CHECK, "2.156868,0.940327,1.286982", "R,G,B",
           "white balance of .npy photos, which do not tell it"),

    STRING("poses", poses, POSES, "", "MODEL",
           "known poses: COLMAP model folder, nerfstudio's transforms.json or LLFF's poses_bounds.npy"),
    STRING("colmap", colmap, POSES, "colmap", "PROGRAM", "the COLMAP program"),
    ENUM("align", align, POSES, "joint", "joint|separate",
         "pose all photos in one model, or flash and no-flash apart and align them (the paper's way)"),

    STRING("points", points, INITIALISE, "", "PLY",
           "start from this dense cloud, in the frame of the poses (COLMAP's fused.ply, say), instead of stereo"),
    ENUM("flash-cue", flash_cue, INITIALISE, "contrast", "contrast|intensity|depth|none",
         "what parts the two scenes' points before training: how much the flash raises each one's contrast; or for "
         "comparisons how much it raises its light, as the paper says; one depth, up to which photos with the flash "
         "find more points, as the paper's program does; or nothing, they are dealt to both by turns"),
    STRING("flash-points", flash_points, INITIALISE, "", "PLY",
           "with --flash-cue depth: a dense cloud of the flash photos alone, in the frame of the poses; with "
           "--noflash-points it is counted instead of the poses' points"),
    STRING("noflash-points", noflash_points, INITIALISE, "", "PLY",
           "that of the photos without flash"),
    FLOAT("brightness", brightness, INITIALISE | TRAIN, "0.62", 0, 1, "X",
          "mean of the photos' tone-mapped values to which darker ones are raised while clouds are fitted to them; 0: "
          "as they are"),
    FLOAT("least-sharpness", least_sharpness, INITIALISE | TRAIN, "0.35", 0, 1, "X",
          "photos with less of their neighbours' detail are blurred, and left out where they are few; 0: none is"),
    INT("init-count", init_count, INITIALISE, "24000", 100, 4000000, "N",
        "Gaussians per cloud at the start; those on T's rear come on top"),

    INT("steps", steps, TRAIN, "6800", 1, 1000000, "N", "training steps"),
    FLOAT("minutes", minutes, TRAIN, "0", 0, 1e6, "X",
          "fewer steps, as many as let run (or train, alone) take X minutes on this machine; 0: as many as --steps"),
    INT("levels", levels, TRAIN, "3", 1, FS_SETTINGS_LEVELS, "N",
        "sizes of the photos that training goes through, each half the next, up to the working size (--long-edge); 1: that "
        "only"),
    FLOAT("pixels-per-splat", pixels_per_splat, TRAIN, "0.65", 0, 1000, "X",
          "at the photos' full working size (--long-edge) a step looks at every second row, and column, if that leaves as "
          "many pixels for each Gaussian that a cloud may have; 0: all pixels"),
    INT("test-every", test_every, POSES, "0", 0, 1000, "N", "hold out every Nth photo; 0: none"),
    INT("checkpoint-every", checkpoint_every, TRAIN, "500", 0, 1000000, "N",
        "steps between checkpoints; 0: only at the end"),
    INT("progress-every", progress_every, TRAIN, "500", 0, 1000000, "N",
        "steps between contact sheets, the first after a fifth of them; 0: none"),
    INT("max-splats", max_splats, TRAIN, "0", 0, 10000000, "N",
        "most Gaussians per cloud; 0: as the size of the photos asks for, 160000 at 1200x800"),
    BOOL("resume", resume, TRAIN,
         "go on from the last checkpoint; refuses one made from other settings or inputs; with --force it does nothing"),
    ENUM("model", model, INITIALISE | TRAIN, "splats", "splats|field",
         "what scenes are made of: Gaussians, or for comparisons radiance fields: with --separation none NeRF, flashless "
         "NeRFReN, full Flash-NeRF"),
    ENUM("separation", separation, INGEST | POSES | INITIALISE | TRAIN, "full", "full|flashless|linear|none",
         "for comparisons: one T for all photos, without the flash's cues; T_F a constant times T_N; or one cloud, no "
         "R"),
    ENUM("lighting", lighting, INGEST | POSES | INITIALISE | TRAIN, "both", "both|flash|noflash",
         "train on photos of one lighting only, for comparisons"),
    ENUM("geometry", geometry, INITIALISE | TRAIN, "shared", "shared|separate",
         "one set of Gaussians for T_F and T_N, or two that begin as in the paper's program (where --separation leaves "
         "one T, one)"),
    ENUM("beta", beta, INITIALISE | TRAIN, "pane", "pane|cloud",
         "reflectance as Fresnel's law on a pane, or as a fourth cloud (the paper's way)"),
    ENUM("densify", densify, TRAIN, "relocate", "relocate|fsgs|none",
         "keep an exact budget by relocation, or clone, split and prune by thresholds (the paper's way)"),
    FLOAT("rgb-weight", rgb_weight, TRAIN, "1", 0, 1000, "X", "weight of the photo term"),
    FLOAT("dssim", dssim, TRAIN, "0", 0, 1, "X", "share of DSSIM in the photo term"),
    FLOAT("contrast", contrast, TRAIN, "0.1", 0, 1, "X",
          "share of the errors' local variance, as part of the photo's, in the photo term; the rest is L1"),
    FLOAT("linearity", linearity, TRAIN, "0", 0, 1000, "X",
          "weight of Pearson's correlation of T_N and T_F (with --geometry separate or --model field)"),
    FLOAT("beta-smooth", beta_smooth, TRAIN, "0", 0, 1000, "X", "weight of the smoothness of a beta cloud"),
    FLOAT("depth-smooth", depth_smooth, TRAIN, "0", 0, 1000, "X", "weight of the smoothness of depth"),
    FLOAT("gain-smooth", gain_smooth, TRAIN, "0.001", 0, 1000, "X",
          "weight of the smoothness of the flash gain over neighbours"),
    FLOAT("opacity-reg", opacity_reg, TRAIN, "0.001", 0, 1000, "X", "weight of the mean opacity"),
    FLOAT("scale-reg", scale_reg, TRAIN, "0.001", 0, 1000, "X", "weight of the mean scale"),
    FLOAT("gain-push", gain_push, TRAIN, "0.02", 0, 1000, "X",
          "weight against gains below the usual one: what the flash hardly brightens is rather mirrored (not where "
          "little is)"),
    FLOAT("mirrored-light", mirrored_light, TRAIN, "0.025", 0, 1000, "X",
          "weight of the mirrored scene's mean colour at first, where little is mirrored: what is ambiguous is "
          "transmitted"),
    FLOAT("opaque", opaque, TRAIN, "0.3", 0, 1000, "X",
          "weight of the light that passes all of a scene: it has no holes"),
    FLOAT("unseen", unseen, TRAIN, "0.05", 0, 1000, "X",
          "weight of how much the mirrored scene, where who takes the photos hides it, differs from what is around"),
    FLOAT("spread", spread, TRAIN, "0.01", 0, 1000, "X",
          "weight of how far what a ray of a radiance field shows is spread along it"),
    FLOAT("way-smooth", way_smooth, TRAIN, "0", 0, 1000, "X",
          "weight of the smoothness of T's disparity in radiance fields, but for edges of the photo (NeRFReN)"),
    FLOAT("way-both", way_both, TRAIN, "0", 0, 1000, "X",
          "weight of how much R's disparity in radiance fields differs as seen from its far end (NeRFReN)"),
    FLOAT("photo-reg", photo_reg, TRAIN, "0.1", 0, 1000, "X",
          "weight of how much the light of a photo differs from the others'"),
    FLOAT("response-smooth", response_smooth, TRAIN, "0.1", 0, 1000, "X",
          "weight of the bends of a response that is learned, but for those that cameras' curves have"),
    FLOAT("slope-floor", slope_floor, TRAIN, "0.005", 0, 10, "X",
          "least slope of the tone curve in gradients, so that a black layer can brighten"),
    FLOAT("darkest", darkest, TRAIN, "0.2", 0, 1, "X",
          "darkest tone-mapped colour of a Gaussian of R; of T half of it"),
    FLOAT("least-beta", least_beta, TRAIN, "0", 0, 0.5, "X",
          "least beta of a Gaussian of a beta cloud; 0.5 as in the paper's code, where it is the sigmoid of a colour"),
    FLOAT("rate-scale", rate_scale, TRAIN, "2", 0, 100, "X",
          "factor on 3DGS's learning rates of rotations and gains"),
    FLOAT("colors-rate", colors_rate, TRAIN, "0.005", 0, 1, "X",
          "learning rate of the colours; the paper's is that of coefficients of spherical harmonics, of which a colour is "
          "0.28 times as much"),
    FLOAT("scales-rate", scales_rate, TRAIN, "0.02", 0, 1, "X", "learning rate of the scales' logarithms"),
    FLOAT("settle", settle, TRAIN, "0.2", 0, 1, "X",
          "share of the steps, at the end, in which those rates fall to a tenth"),
    ON("photo-light", photo_light, TRAIN,
       "learn by how much each photo's flash and the light of both scenes differ from the others'"),
    ON("vignetting", vignetting, TRAIN, "learn by how much photos darken towards their corners"),
    ON("photographer", photographer, TRAIN,
       "find the mirror image of who takes the photos and leave it out of the mirrored scene"),
    ON("passers-by", passers_by, TRAIN,
       "find who walks by, in what a photo shows and the others do not, and leave them out of it"),
    ON("bars", bars, TRAIN,
       "find the bars or the frame before the glass: they are seen as they are, and nothing is mirrored there"),
    ON("dirt", dirt, TRAIN,
       "find the dirt on the glass that shines in the flash's light, and keep its light out of both scenes"),
    ENUM("response", response, TRAIN, "auto", "auto|learned|as-is",
         "the camera's tone curve beyond what the files tell, and each photo's white balance: auto learns them of "
         "JPEGs"),
    FLOAT("means-rate", means_rate, TRAIN, "4e-3", 0, 1, "X", "first learning rate of positions, in scene extents"),

    STRING("cameras", cameras, RENDER, "", "MODEL",
           "views to render: COLMAP model folder, transforms.json or cameras.json"),
    STRING("output", output, RENDER | EVALUATE, "", "DIR",
           "folder of the renders (render's -o; elsewhere -o is OUT; default: OUT/renders; of a camera path OUT/path)"),
    ENUM("path", path, RENDER, "none", "none|spiral", "render a camera path instead of views"),
    LIST("layers", layers, RENDER, "all", "all|T_N|T_F|R|R_scene|beta|I_N|I_F|depth_T|depth_R",
         "layers to render, comma-separated: T_N,T_F,R,R_scene,beta,I_N,I_F,depth_T,depth_R (R is beta times "
         "R_scene)"),
    BOOL("linear", linear, RENDER | PAIR, "write 32-bit float TIFF in linear light too"),
    FLOAT("metres-per-unit", metres_per_unit, RENDER, "0", 0, 1e9, "X",
          "metres in one unit of the poses, so that depth is written in millimetres; 0: unknown"),
    BOOL("video", video, RENDER,
         "write MP4 of the views of --cameras, or of a camera path beside the photos' renders; --path spiral always does"),
    INT("path-views", path_views, RENDER, "120", 2, 9999, "N", "frames of the camera path"),

    LIST("formats", formats, EXPORT, "ply,spz", "ply|splat|spz|spz2|sog|compressed|glb|points|mesh",
         "files of each cloud, comma-separated: ply, splat, spz, spz2 (version 2), sog, compressed (PLY), glb, "
         "points, mesh (of T)"),
    LIST("clean", clean, EXPORT, "", "jpeg|tiff|dng",
         "the photos without the reflection, at their full size, in OUT/export/photos, comma-separated: jpeg, tiff "
         "(16 bits), dng (linear)"),
    STRING("originals", originals, EXPORT, "", "DIR", "where the photos are now, for --clean, if not where they were"),
    BOOL("unmirror", unmirror, EXPORT,
         "write the mirrored room too, as room.*, where it really is: reflected at the pane (with --beta pane)"),
    BOOL("dataset", dataset, EXPORT,
         "write the photos without the reflection, with a COLMAP model, for programs that train on posed photos"),
    ENUM("dataset-of", dataset_of, EXPORT, "transmitted", "transmitted|photos",
         "what --dataset writes: T at the photos' poses, or the photos as they are (8-bit sRGB) and pairs of them, for "
         "programs that separate"),
    FLOAT("pane-distance", pane_distance, EXPORT, "0", 0, 1e9, "X",
          "from the middle of the photos' places to the pane, in units of the poses, for --unmirror and the pane in GLB; "
          "0: to what is nearest behind it"),

    STRING("method", methods, EVALUATE, "", "NAME=DIR[,NAME=DIR...]",
           "other programs' output folders to compare; see docs/compare.md"),
    ENUM("method-encoding", method_encoding, EVALUATE, "gamma", "gamma|srgb|linear",
         "what the values of --method's pictures are: linear^0.22 as ours, sRGB, or linear light"),
    STRING("json", json, EVALUATE | BENCH | CHECK, "", "FILE", "write the figures as JSON too"),
    ENUM("views", views, EVALUATE, "held_out", "held_out|capture|all", "views to measure at"),
    STRING("lpips-weights", lpips_weights, EVALUATE, "", "FILE",
           "weights that make evaluate measure LPIPS too; see docs/lpips.md"),

    BOOL("serve", serve, VIEW, "serve the page over HTTP, on 127.0.0.1 only, until Ctrl-C"),
    INT("port", port, VIEW, "8017", 0, 65535, "N", "where --serve listens; 0: any free port"),
    STRING("cases", cases, BENCH, "", "WORD", "only the cases whose name contains this"),
    STRING("compare", compare, BENCH, "", "FILE,FILE", "compare two files of --json instead of measuring"),

    INT("photos", synth_photos, SYNTH, "30", 2, 1000, "N", "photos, half of them with flash"),
    INT("held-out", synth_held_out, SYNTH, "6", 0, 1000, "N", "extra poses with ground truth and no photo"),
    INT("width", synth_width, SYNTH, "600", 32, 8192, "N", "photo width in pixels"),
    INT("height", synth_height, SYNTH, "400", 32, 8192, "N", "photo height in pixels"),
    FLOAT("alpha", synth_alpha, SYNTH, "1.5", 0, 100, "X", "mean gain of the flash on the transmitted scene"),
    FLOAT("reflection", synth_reflection, SYNTH, "0.45", 0, 0.95, "X",
          "the mirrored layer's share of a no-flash photo's light"),
    STRING("hard", synth_hard, SYNTH, "", "LIST",
           "difficulties, comma-separated: weak-flash, strong-reflection, few-photos, low-texture, depth-overlap, "
           "frame, flash-return, bright-near-room, dark, wide-path, pose-noise, picture, straight-on, lit"),
    STRING(
        "field", synth_field, SYNTH, "", "LIST",
        "faults of a real capture, comma-separated, NAME or NAME=STRENGTH; all: every one of flash-jitter, drift, "
        "shutter, vignetting, jpeg, white-balance, under, distortion, shake, defocus, photographer, pedestrian, dirt, "
        "double-glazing, tint; and by itself mirrored-flash"),
};
#define N_OPTIONS (sizeof table / sizeof *table)

static const struct {
    const char *name, *help;
} presets[] = {
    {"preview", "a first look, a minute on two cores"},
    {"standard", "the best within about ten minutes on two cores"},
    {"best", "three times the steps: better where photos have more pixels than the working images"},
    {"paper", "the paper's four clouds, losses, weights and schedules, from its program's start"},
    {"nerf", "a radiance field, for comparisons; nothing is told apart"},
    {"nerfren", "NeRFReN's two radiance fields, for comparisons: without the flash's cues"},
    {"flash-nerf", "the same with T_F and T_N, and the paper's linearity term"},
};

static const struct {
    const char *preset, *name, *value;
} preset_values[] = {
    {"preview", "steps", "2700"},    {"preview", "long-edge", "300"},    {"preview", "init-count", "12000"},
    {"best", "steps", "20400"},
    {"paper", "pixels-per-splat", "0"},
    {"paper", "steps", "5000"},      {"paper", "levels", "1"},           {"paper", "geometry", "separate"},
    {"paper", "beta", "cloud"},      {"paper", "init-count", "350000"},  {"paper", "max-splats", "500000"},
    {"paper", "densify", "fsgs"},    {"paper", "rgb-weight", "2"},       {"paper", "linearity", "0.001"},
    {"paper", "beta-smooth", "0.1"}, {"paper", "depth-smooth", "0.01"},  {"paper", "opacity-reg", "0"},
    {"paper", "dssim", "0.2"},       {"paper", "means-rate", "1.6e-4"},  {"paper", "rate-scale", "1"},
    {"paper", "scales-rate", "0.005"}, {"paper", "colors-rate", "0.000705"},
    {"paper", "slope-floor", "0"},   {"paper", "darkest", "0"},          {"paper", "scale-reg", "0"},
    {"paper", "gain-smooth", "0"},   {"paper", "gain-push", "0"},        {"paper", "opaque", "0"},
    {"paper", "settle", "0"},        {"paper", "photo-light", "false"},  {"paper", "vignetting", "false"},
    {"paper", "response", "as-is"},  {"paper", "photographer", "false"}, {"paper", "contrast", "0"},
    {"paper", "bars", "false"},     {"paper", "passers-by", "false"},     {"paper", "dirt", "false"},
    {"paper", "brightness", "0"},    {"paper", "flash-cue", "depth"},     {"paper", "least-sharpness", "0"},
    {"paper", "mirrored-light", "0"},
    {"nerf", "model", "field"},             {"nerf", "separation", "none"},       {"nerf", "long-edge", "300"},
    {"nerf", "steps", "16000"},             {"nerf", "levels", "1"},              {"nerfren", "model", "field"},
    {"nerfren", "separation", "flashless"}, {"nerfren", "long-edge", "300"},      {"nerfren", "steps", "12000"},
    {"nerfren", "levels", "1"},             {"nerfren", "slope-floor", "0.3"},    {"nerfren", "opaque", "0"},
    {"nerfren", "way-smooth", "0.1"},       {"nerfren", "way-both", "0.05"},      {"nerfren", "beta-smooth", "0.001"},
    {"flash-nerf", "model", "field"},       {"flash-nerf", "long-edge", "300"},   {"flash-nerf", "steps", "12000"},
    {"flash-nerf", "levels", "1"},          {"flash-nerf", "slope-floor", "0.3"}, {"flash-nerf", "opaque", "0"},
    {"flash-nerf", "way-smooth", "0.1"},    {"flash-nerf", "way-both", "0.05"},   {"flash-nerf", "beta-smooth", "0.001"},
    {"flash-nerf", "linearity", "0.01"},
};

const FsOption *fs_settings_options(size_t *n)
{
    *n = N_OPTIONS;
    return table;
}

const char *fs_settings_preset(size_t i, const char **help)
{
    if (i >= sizeof presets / sizeof *presets) return NULL;
    if (help) *help = presets[i].help;
    return presets[i].name;
}

static void *member(const Settings *settings, const FsOption *option)
{
    return (char *)settings + option->offset;
}

static bool has_word(const char *words, char between, const char *word, size_t n)
{
    for (const char *p = words; p; p = strchr(p, between) ? strchr(p, between) + 1 : NULL)
        if (strncmp(p, word, n) == 0 && (p[n] == between || p[n] == 0)) return n > 0;
    return false;
}

static int set_number(Settings *settings, const FsOption *option, const char *value, FsError *err)
{
    char *end;
    errno = 0;
    double v = strtod(value, &end);
    bool whole = option->type == FS_OPTION_FLOAT || v == floor(v);
    if (end == value || *end || errno || !isfinite(v) || !whole || v < option->min || v > option->max)
        return fs_error_set(err, FS_ERR_USAGE, "--%s: '%s' is not %s from %.10g to %.10g", option->name, value,
                            option->type == FS_OPTION_INT ? "a whole number" : "a number", option->min, option->max);
    if (option->type == FS_OPTION_INT)
        *(int *)member(settings, option) = (int)v;
    else
        *(double *)member(settings, option) = v;
    return 0;
}

// The words of a list, or the one of an enumeration.
static int check_choices(const FsOption *option, const char *value, FsError *err)
{
    bool list = option->type == FS_OPTION_STRING;
    if (option->choices && !*value && *option->initial)
        return fs_error_set(err, FS_ERR_USAGE, "--%s: empty, expected some of %s", option->name, option->choices);
    for (const char *p = value; option->choices && (*p || !list);) {
        size_t n = list ? strcspn(p, ",") : strlen(p);
        if (!has_word(option->choices, '|', p, n))
            return fs_error_set(err, FS_ERR_USAGE, "--%s: '%.*s' is not one of %s", option->name, (int)n, p,
                                option->choices);
        p += n;
        if (!*p) break;
        p++;
    }
    return 0;
}

// A comma too many is a slip, or a variable that is not set.
static int check_items(const FsOption *option, const char *value, FsError *err)
{
    bool list = strcmp(option->argument, "LIST") == 0 || strstr(option->argument, "...");
    size_t n = strlen(value);
    if (!list || !n || (*value != ',' && value[n - 1] != ',' && !strstr(value, ",,"))) return 0;
    return fs_error_set(err, FS_ERR_USAGE, "--%s: '%s' has an empty item: one comma too many", option->name, value);
}

static int set_text(Settings *settings, const FsOption *option, const char *value, FsError *err)
{
    MUST(check_choices(option, value, err));
    MUST(check_items(option, value, err));
    json_t *as_json = json_string(value); // what stages ran with is kept as JSON
    char *copy = as_json ? strdup(value) : NULL;
    json_decref(as_json);
    if (!as_json && errno != ENOMEM)
        return fs_error_set(err, FS_ERR_USAGE, "--%s: '%s' is not UTF-8", option->name, value);
    if (!copy) return fs_error_memory(err);
    char **text = member(settings, option);
    free(*text);
    *text = copy;
    return 0;
}

static int set_option(Settings *settings, const FsOption *option, const char *value, FsError *err)
{
    switch (option->type) {
    case FS_OPTION_BOOL:
        if (strcmp(value, "true") != 0 && strcmp(value, "false") != 0)
            return fs_error_set(err, FS_ERR_USAGE, "--%s: '%s' is not true or false", option->name, value);
        *(bool *)member(settings, option) = value[0] == 't';
        return 0;
    case FS_OPTION_INT:
    case FS_OPTION_FLOAT: return set_number(settings, option, value, err);
    default: return set_text(settings, option, value, err);
    }
}

static const FsOption *find(const char *name)
{
    for (size_t i = 0; i < N_OPTIONS; i++)
        if (strcmp(table[i].name, name) == 0) return &table[i];
    return NULL;
}

static int apply_preset(Settings *settings, FsError *err)
{
    int rc = 0;
    for (size_t i = 0; i < N_OPTIONS && rc == 0; i++)
        if (!settings->was_set[i]) rc = set_option(settings, &table[i], table[i].initial, err);
    for (size_t i = 0; i < sizeof preset_values / sizeof *preset_values && rc == 0; i++) {
        const FsOption *option = find(preset_values[i].name);
        if (strcmp(preset_values[i].preset, settings->preset) == 0 && !settings->was_set[option - table])
            rc = set_option(settings, option, preset_values[i].value, err);
    }
    return rc;
}

int fs_settings_check(const Settings *settings, FsError *err)
{
    if (settings->minutes > 0 && fs_settings_was_set(settings, "steps"))
        return fs_error_set(err, FS_ERR_USAGE, "--minutes and --steps: give one of them, the other follows");
    if (*settings->cameras && strcmp(settings->path, "spiral") == 0)
        return fs_error_set(err, FS_ERR_USAGE,
                            "--path spiral and --cameras: give one of them, both say which views");
    if (settings->test_every == 1)
        return fs_error_set(err, FS_ERR_USAGE,
                            "--test-every: 1 would hold out every photo; give 0 for none, or 2 to 1000");
    return 0;
}

int fs_settings_set(FsSettings *settings, const char *name, const char *value, FsError *err)
{
    const FsOption *option = find(name);
    if (!option) return fs_error_set(err, FS_ERR_USAGE, "--%s: no such option", name);
    int rc = set_option(settings, option, value, err);
    if (rc < 0) return rc;
    settings->was_set[option - table] = 1;
    return strcmp(name, "preset") == 0 ? apply_preset(settings, err) : 0;
}

int fs_settings_get(const FsSettings *settings, const char *name, char *buf, size_t n)
{
    const FsOption *option = find(name);
    if (!option) return FS_ERR_USAGE;
    const void *p = member(settings, option);
    switch (option->type) {
    case FS_OPTION_BOOL: snprintf(buf, n, "%s", *(const bool *)p ? "true" : "false"); break;
    case FS_OPTION_INT: snprintf(buf, n, "%d", *(const int *)p); break;
    case FS_OPTION_FLOAT: snprintf(buf, n, "%g", *(const double *)p); break;
    default: snprintf(buf, n, "%s", *(char *const *)p); break;
    }
    return 0;
}

bool fs_settings_was_set(const Settings *settings, const char *name)
{
    const FsOption *option = find(name);
    return option && settings->was_set[option - table];
}

bool fs_settings_has_word(const char *list, const char *word)
{
    return has_word(list, ',', word, strlen(word));
}

double fs_settings_number(const Settings *settings, const char *name)
{
    const FsOption *option = find(name);
    return option && option->type == FS_OPTION_FLOAT ? *(const double *)member(settings, option) : 0;
}

double fs_settings_brightness(const Settings *settings)
{
    return strcmp(settings->model, "field") == 0 ? 0 : settings->brightness;
}

FsSettings *fs_settings_new(void)
{
    _Static_assert(N_OPTIONS <= sizeof((Settings *)0)->was_set, "was_set is too small");
    Settings *settings = calloc(1, sizeof *settings);
    if (!settings) return NULL;
    if (apply_preset(settings, NULL) == 0) return settings;
    fs_settings_free(settings);
    return NULL;
}

void fs_settings_clear(Settings *settings)
{
    for (size_t i = 0; i < N_OPTIONS; i++)
        if (table[i].type == FS_OPTION_STRING || table[i].type == FS_OPTION_ENUM)
            free(*(char **)member(settings, &table[i]));
    memset(settings, 0, sizeof *settings);
}

void fs_settings_free(FsSettings *settings)
{
    if (!settings) return;
    fs_settings_clear(settings);
    free(settings);
}

int fs_settings_copy(Settings *to, const Settings *from, FsError *err)
{
    int rc = 0;
    *to = *from;
    for (size_t i = 0; i < N_OPTIONS; i++)
        if (table[i].type == FS_OPTION_STRING || table[i].type == FS_OPTION_ENUM) {
            const char *text = *(char *const *)member(from, &table[i]);
            char *copy = *(char **)member(to, &table[i]) = strdup(text ? text : "");
            if (!copy) rc = fs_error_memory(err);
        }
    return rc;
}

char *fs_settings_json(const Settings *settings, unsigned stages)
{
    json_t *root = json_object();
    for (size_t i = 0; i < N_OPTIONS; i++) {
        if (!(table[i].stages & stages)) continue;
        const void *p = member(settings, &table[i]);
        json_t *value = NULL;
        switch (table[i].type) {
        case FS_OPTION_BOOL: value = json_boolean(*(const bool *)p); break;
        case FS_OPTION_INT: value = json_integer(*(const int *)p); break;
        case FS_OPTION_FLOAT: value = json_real(*(const double *)p); break;
        default: value = json_string(*(char *const *)p); break;
        }
        json_object_set_new(root, table[i].name, value);
    }
    char *text = json_dumps(root, JSON_INDENT(1));
    json_decref(root);
    return text;
}
