// The commands of the program, one row each, and what they call.
#include <string.h>
#include <sys/stat.h>

#include "cli.h"

#define RUN_STAGES (FS_STAGE_ALL & ~(unsigned)FS_STAGE_EVALUATE)

static bool is_folder(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

// Opens the project, runs one stage on it, closes it.
static int on_project(const Invocation *in, const FsCallbacks *callbacks, FsError *err,
                      int (*stage)(FsProject *, FsError *), int (*stage_arg)(FsProject *, const char *, FsError *))
{
    if (in->command->out != OUT_NEW && !is_folder(in->out)) {
        snprintf(err->message, sizeof err->message, "%s: no such folder; make it with: flashsplat ingest PHOTOS -o %s",
                 in->out, in->out);
        return err->code = FS_ERR_INPUT;
    }
    FsProject *project;
    int rc = fs_project_open(&project, in->out, in->settings, callbacks, err);
    if (rc < 0) return rc;
    rc = stage ? stage(project, err) : stage_arg(project, in->arg[0], err);
    fs_project_close(project);
    return rc;
}

#define STAGE(name_)                                                                                                   \
    static int call_##name_(const Invocation *in, const FsCallbacks *callbacks, FsError *err)                          \
    {                                                                                                                  \
        return on_project(in, callbacks, err, fs_##name_, NULL);                                                       \
    }
#define STAGE_WITH_ARGUMENT(name_)                                                                                     \
    static int call_##name_(const Invocation *in, const FsCallbacks *callbacks, FsError *err)                          \
    {                                                                                                                  \
        return on_project(in, callbacks, err, NULL, fs_##name_);                                                       \
    }

STAGE_WITH_ARGUMENT(run)
STAGE_WITH_ARGUMENT(ingest)
STAGE(poses)
STAGE(initialise)
STAGE(train)
STAGE(render)
STAGE_WITH_ARGUMENT(evaluate)
STAGE(export)

static int call_synth(const Invocation *in, const FsCallbacks *callbacks, FsError *err)
{
    return fs_synth(in->out, in->settings, callbacks, err);
}

static int call_pair(const Invocation *in, const FsCallbacks *callbacks, FsError *err)
{
    return fs_pair(in->arg[0], in->arg[1], in->out, in->settings, callbacks, err);
}

static int call_check(const Invocation *in, const FsCallbacks *callbacks, FsError *err)
{
    return fs_check(in->arg[0], in->settings, callbacks, err);
}

static int call_info(const Invocation *in, const FsCallbacks *callbacks, FsError *err)
{
    return fs_info(in->arg[0], in->settings, callbacks, err);
}

static int call_view(const Invocation *in, const FsCallbacks *callbacks, FsError *err)
{
    return fs_view(in->arg[0], in->settings, callbacks, err);
}

static int call_bench(const Invocation *in, const FsCallbacks *callbacks, FsError *err)
{
    return fs_bench(in->settings, callbacks, err);
}

// clang-format off
static const Command commands[] = {
    {.name = "run", .usage = "PHOTOS -o OUT", .help = "photos in, separated scene out: all stages in order",
     .detail = "PHOTOS is a folder of RAW, JPEG, HEIF, PNG, TIFF or .npy photos taken through glass, some with the flash and "
               "some without, or a scene as it was published: such photos in images_npy or images, with poses beside them. OUT "
               "is a folder; stages that are done in it already are skipped.",
     .stages = RUN_STAGES, .n_args = 1, .out = OUT_NEW, .call = call_run},
    {.name = "ingest", .usage = "PHOTOS -o OUT", .help = "read the photos into linear working images",
     .stages = FS_STAGE_INGEST, .n_args = 1, .out = OUT_NEW, .call = call_ingest},
    {.name = "poses", .usage = "OUT", .help = "find out where each photo was taken from, with COLMAP or a known model",
     .stages = FS_STAGE_POSES, .out = OUT_PROJECT, .call = call_poses},
    {.name = "initialise", .usage = "OUT", .help = "tell transmitted from reflected points, make the first clouds",
     .stages = FS_STAGE_INITIALISE, .out = OUT_PROJECT, .call = call_initialise},
    {.name = "train", .usage = "OUT", .help = "optimise the clouds against the photos", .stages = FS_STAGE_TRAIN,
     .out = OUT_PROJECT, .call = call_train},
    {.name = "render", .usage = "OUT [-o DIR]", .help = "render the layers as pictures, depth and video",
     .detail = "Without --cameras and --path, all posed photos are rendered into OUT/renders.",
     .stages = FS_STAGE_RENDER, .out = OUT_SETTING, .call = call_render},
    {.name = "evaluate", .usage = "OUT TRUTH", .help = "measure the layers against a folder of true ones",
     .detail = "TRUTH is a folder of <layer>/<view>.png with cameras.json, as synth writes it. The held-out views are to be "
               "rendered first: flashsplat render OUT --cameras TRUTH/cameras.json. Those of the photos (--views capture) are there "
               "after run.",
     .stages = FS_STAGE_EVALUATE, .n_args = 1, .out = OUT_PROJECT, .prints = true, .call = call_evaluate},
    {.name = "export", .usage = "OUT", .help = "write the clouds in formats that other programs open",
     .stages = FS_STAGE_EXPORT, .out = OUT_PROJECT, .call = call_export},
    {.name = "view", .usage = "OUT", .help = "open the page in the browser, with the scene in 3D",
     .detail = "Prints where the page is; with a display, opens it too. The page needs no server: --serve is for browsers "
               "that want none of file://, and gives it to this machine only.",
     .stages = FS_STAGE_VIEW, .n_args = 1, .out = OUT_NONE, .prints = true, .call = call_view},
    {.name = "synth", .usage = "-o OUT", .help = "make a capture through glass, with ground truth",
     .stages = FS_STAGE_SYNTH, .out = OUT_NEW, .call = call_synth},
    {.name = "pair", .usage = "FLASH NOFLASH -o FILE", .help = "difference of a flash / no-flash pair from a tripod",
     .detail = "FILE ends in .png.",
     .stages = FS_STAGE_PAIR, .n_args = 2, .out = OUT_NEW, .call = call_pair},
    {.name = "check", .usage = "PHOTOS", .help = "whether photos will do, in seconds: what to retake",
     .detail = "A line for each photo, then what to do. Exits with 0 where all is good, 3 where the photos are usable "
               "with doubts, 1 where they are not.",
     .stages = FS_STAGE_CHECK, .n_args = 1, .out = OUT_NONE, .prints = true, .call = call_check},
    {.name = "info", .usage = "FILE|OUT", .help = "describe a photo, a PLY, a COLMAP model or a project folder",
     .n_args = 1, .out = OUT_NONE, .prints = true, .call = call_info},
    {.name = "bench", .usage = "", .help = "time the kernels and the training step on this machine",
     .stages = FS_STAGE_BENCH, .out = OUT_NONE, .prints = true, .call = call_bench},
};
// clang-format on
#define N_COMMANDS (sizeof commands / sizeof *commands)

const Command *cli_commands(size_t *n)
{
    *n = N_COMMANDS;
    return commands;
}

const Command *cli_command_find(const char *name)
{
    for (size_t i = 0; i < N_COMMANDS; i++)
        if (strcmp(commands[i].name, name) == 0) return &commands[i];
    return NULL;
}
