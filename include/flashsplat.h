// flashsplat: separate what is behind glass from what is mirrored in it.
//
// The only public header. A project is a folder (OUT) that the stages fill one after the other;
// every stage reads what the stages before it left there, so each can be rerun alone.
// No call prints, exits or throws: a fallible call returns 0 (fs_check: or FS_DOUBTS) or a negative FsStatus and fills
// FsError. callbacks and err may be NULL, and what is freed or closed; nothing else but where it says so. Texts that
// are given are copied or not needed after the call; those of options and presets live as long as the program. One call
// at a time in a process, but for fs_view: jansson's allocator and FFmpeg's log callback are set for all of it. Numbers
// are read and written as the locale has them (LC_NUMERIC): it must have a decimal point, as "C" has.
#ifndef FLASHSPLAT_H
#define FLASHSPLAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum FsStatus {
    FS_OK = 0,
    FS_DOUBTS = 3,         // of fs_check: usable with doubts
    FS_ERR_INPUT = -1,     // a file or folder is missing or wrong; the message names it and says what to do
    FS_ERR_USAGE = -2,     // an option or argument is wrong
    FS_ERR_MEMORY = -3,    // out of memory
    FS_ERR_IO = -4,        // writing failed (disk full, no permission)
    FS_ERR_CANCELLED = -5, // the cancelled() callback said so; what was computed is on disk
    FS_ERR_NUMERIC = -6,   // training diverged or collapsed; the last good checkpoint is on disk
} FsStatus;

typedef struct FsError {
    int code;           // FsStatus
    char message[1000]; // one line: the file, what was expected, what to do
} FsError;

typedef enum FsLogLevel { FS_LOG_DEBUG, FS_LOG_INFO, FS_LOG_WARN } FsLogLevel;

typedef struct FsProgress {
    const char *stage;   // "ingest", "train", ...
    int64_t done, total; // units of work; total 0 where unknown
    const char *text;    // what is being done now, or the loss terms
} FsProgress;

// All callbacks may be NULL. They are called from the thread that called the stage.
typedef struct FsCallbacks {
    void (*log)(void *user, FsLogLevel level, const char *message);
    void (*progress)(void *user, const FsProgress *progress);
    bool (*cancelled)(void *user); // polled; true makes the stage save and return FS_ERR_CANCELLED
    void *user;
} FsCallbacks;

// ---- settings: one table drives flags, JSON, help and the manual ----

typedef enum FsOptionType {
    FS_OPTION_BOOL,
    FS_OPTION_INT,
    FS_OPTION_FLOAT,
    FS_OPTION_STRING,
    FS_OPTION_ENUM
} FsOptionType;

// Stages an option belongs to (bit mask).
enum {
    FS_STAGE_INGEST = 1 << 0,
    FS_STAGE_POSES = 1 << 1,
    FS_STAGE_INITIALISE = 1 << 2,
    FS_STAGE_TRAIN = 1 << 3,
    FS_STAGE_RENDER = 1 << 4,
    FS_STAGE_EVALUATE = 1 << 5,
    FS_STAGE_EXPORT = 1 << 6,
    FS_STAGE_SYNTH = 1 << 7,
    FS_STAGE_PAIR = 1 << 8,
    FS_STAGE_BENCH = 1 << 9,
    FS_STAGE_CHECK = 1 << 10,
    FS_STAGE_VIEW = 1 << 11,
    FS_STAGE_ALL = (1 << 7) - 1, // all of them; `run` leaves evaluate out
};

typedef struct FsOption {
    const char *name; // as on the command line without "--", e.g. "long-edge"
    FsOptionType type;
    unsigned stages;      // FS_STAGE_* mask
    const char *initial;  // default value as text
    const char *choices;  // "a|b|c" for FS_OPTION_ENUM and for lists of such words, else NULL
    double min, max;      // inclusive range of FS_OPTION_INT and FS_OPTION_FLOAT
    const char *argument; // placeholder in the help, e.g. "N"; NULL for FS_OPTION_BOOL
    const char *help;     // one line
    size_t offset;        // private
} FsOption;

typedef struct FsSettings FsSettings;

// Defaults; NULL when out of memory, or where numbers of the locale have no decimal point; free with fs_settings_free.
FsSettings *fs_settings_new(void);
void fs_settings_free(FsSettings *settings);
const FsOption *fs_settings_options(size_t *n);
// Sets one option from text. "preset" sets all the options of that preset that were not set before.
int fs_settings_set(FsSettings *settings, const char *name, const char *value, FsError *err);
// Text of an option's present value into buf (cut to n bytes); negative when there is no such option.
int fs_settings_get(const FsSettings *settings, const char *name, char *buf, size_t n);
// The presets, for help: name and one line (help may be NULL); NULL past the end.
const char *fs_settings_preset(size_t i, const char **help);

// ---- project ----

typedef struct FsProject FsProject;

// Opens the folder `out` (made when missing; fs_project_close takes one that was made away again where it is empty).
// Settings and callbacks are copied. FS_ERR_USAGE where two settings exclude one another.
int fs_project_open(FsProject **project, const char *out, const FsSettings *settings, const FsCallbacks *callbacks,
                    FsError *err);
void fs_project_close(FsProject *project);

// The stages. Each skips what is done already (and says so through the log) unless the setting "force" is on. What
// writes into the folder keeps it until the project is closed; meanwhile others that would are refused.
int fs_ingest(FsProject *project, const char *photos, FsError *err); // photos: folder of RAW/JPEG/HEIF/PNG/TIFF/.npy
int fs_poses(FsProject *project, FsError *err);                      // setting "poses": known poses, else COLMAP
int fs_initialise(FsProject *project, FsError *err);
int fs_train(FsProject *project, FsError *err);
int fs_render(FsProject *project, FsError *err); // settings "cameras", "output", "path"
int fs_evaluate(FsProject *project, const char *truth, FsError *err);
int fs_export(FsProject *project, FsError *err);
int fs_run(FsProject *project, const char *photos, FsError *err); // all but evaluate, in order; then the page

// ---- programs beside the stages ----

int fs_synth(const char *out, const FsSettings *settings, const FsCallbacks *callbacks, FsError *err);
int fs_pair(const char *flash, const char *noflash, const char *out, const FsSettings *settings,
            const FsCallbacks *callbacks, FsError *err);
// Whether photos will do, in seconds: a line for each and then what to do, through the log callback at FS_LOG_INFO.
// 0: good, FS_DOUBTS, or FS_ERR_INPUT: not usable. Setting "json": the same as a file.
int fs_check(const char *photos, const FsSettings *settings, const FsCallbacks *callbacks, FsError *err);
// One-file or one-project description, lines through the log callback at FS_LOG_INFO. settings: not read yet.
int fs_info(const char *path, const FsSettings *settings, const FsCallbacks *callbacks, FsError *err);
// Opens the project's page in the browser, or says where it is; setting "serve": over HTTP until the callback
// cancelled says so.
int fs_view(const char *out, const FsSettings *settings, const FsCallbacks *callbacks, FsError *err);
int fs_bench(const FsSettings *settings, const FsCallbacks *callbacks, FsError *err);

const char *fs_version(void);

#ifdef __cplusplus
}
#endif
#endif
