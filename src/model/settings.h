// All settings as one struct; settings.c has the one table that describes them.
#pragma once

#include "flashsplat.h"

enum { FS_SETTINGS_LEVELS = 8 }; // most sizes of the photos in training

typedef struct FsSettings {
    // general
    char *preset;
    int threads, seed, long_edge;
    bool force;
    char *device, *cpu; // what computes; highest instruction set level to use
    // ingest
    char *flash_glob, *flash_list, *masks, *npy_gains;
    double npy_black, npy_white;
    // poses
    char *poses, *colmap, *align;
    // initialise
    char *points, *flash_points, *noflash_points, *flash_cue;
    int init_count;
    // train
    int steps, levels, test_every, checkpoint_every, progress_every, max_splats;
    double minutes, pixels_per_splat;
    bool resume;
    char *model, *separation, *lighting, *geometry, *beta, *densify;
    double rgb_weight, dssim, contrast, linearity, beta_smooth, depth_smooth, gain_smooth, opacity_reg, scale_reg,
        means_rate, scales_rate, colors_rate, slope_floor, brightness, least_sharpness, darkest, least_beta, rate_scale,
        gain_push, mirrored_light, opaque, unseen, spread, way_smooth, way_both, photo_reg, response_smooth, settle;
    bool photo_light, vignetting, photographer, passers_by, bars, dirt; // learned
    char *response;
    // render
    char *cameras, *output, *path, *layers;
    bool linear, video;
    double metres_per_unit;
    int path_views;
    // export
    char *formats;
    char *clean, *originals;
    bool unmirror, dataset;
    char *dataset_of;
    double pane_distance;
    // evaluate
    char *methods, *method_encoding, *json, *views, *lpips_weights;
    // view
    bool serve;
    int port;
    // bench
    char *cases, *compare;
    // synth
    int synth_photos, synth_held_out, synth_width, synth_height;
    double synth_alpha, synth_reflection;
    char *synth_hard, *synth_field;
    unsigned char was_set[128]; // per row of the table: set by the user, not by default or preset
} Settings;

int fs_settings_copy(Settings *to, const Settings *from, FsError *err); // deep; to clear even after a failure
void fs_settings_clear(Settings *settings);                             // frees its texts
// Whether the values go together; a usage error else.
int fs_settings_check(const Settings *settings, FsError *err);
bool fs_settings_was_set(const Settings *settings, const char *name);  // by the user, not by default or preset
bool fs_settings_has_word(const char *list, const char *word);         // of what a list was set to
double fs_settings_number(const Settings *settings, const char *name); // of an option of type FLOAT
double fs_settings_brightness(const Settings *settings); // 0 where it could not be undone: of radiance fields
// The settings of the given stages as a JSON object text (caller frees), NULL when out of memory.
char *fs_settings_json(const Settings *settings, unsigned stages);
