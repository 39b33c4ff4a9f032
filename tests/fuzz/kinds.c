#include "kinds.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"
#include "base/hash.h"
#include "base/owned.h"
#include "bench/result.h"
#include "evaluate/depth.h"
#include "evaluate/lpips.h"
#include "evaluate/truth.h"
#include "image/exif.h"
#include "image/heif.h"
#include "image/image.h"
#include "image/profile.h"
#include "image/raw.h"
#include "info/info.h"
#include "model/photos.h"
#include "model/cameras_file.h"
#include "model/points_ply.h"
#include "model/project.h"
#include "model/scene.h"
#include "poses/capture.h"
#include "poses/database.h"
#include "report/report.h"
#include "train/trainer.h"

#define MAX_FILE (1 << 24)

// A promise of a reader; the fuzzer and the replay both stop where it is broken.
static void check(bool kept, const char *what, const char *detail)
{
    if (kept) return;
    fprintf(stderr, "broken promise: %s: %s\n", what, detail);
    abort();
}

static char *in(const char *dir, const char *name) // stays for thirty-one more calls
{
    static FilePath path[32];
    static int next;
    FilePath *at = &path[next++ % 32];
    *at = fs_file_at("%s/%s", dir, name);
    return at->text;
}

// ---- photos ----

typedef int ReadTag(const char *path, LightTag *tag, FsError *err);
typedef int ReadImage(const char *path, Image *image, FsError *err);

static int read_image(const char *path, ReadTag *read_tag, ReadImage *read, FsError *err)
{
    LightTag tag;
    Image image = {0};
    read_tag(path, &tag, NULL);
    fs_profile_tag_free(&tag);
    int rc = read(path, &image, err);
    if (rc == 0) check(image.width > 0 && image.height > 0 && image.px && image.channels % 2, "an image", path);
    fs_image_free(&image);
    return rc;
}

static int read_png(const char *dir, FsError *err)
{
    return read_image(in(dir, "a.png"), fs_png_read_tag, fs_png_read, err);
}

static int read_tiff(const char *dir, FsError *err)
{
    return read_image(in(dir, "a.tif"), fs_tiff_read_tag, fs_tiff_read, err);
}

static int read_jpeg(const char *dir, FsError *err)
{
    return read_image(in(dir, "a.jpg"), fs_jpeg_read_tag, fs_jpeg_read, err);
}

static int read_heif(const char *dir, FsError *err)
{
    ExifInfo exif;
    const char *path = in(dir, "a.heic");
    check(fs_exif_read(path, &exif, NULL) < 0 || (exif.orientation >= 1 && exif.orientation <= 8), "EXIF", path);
    return read_image(path, fs_heif_read_tag, fs_heif_read, err);
}

static int read_raw(const char *dir, FsError *err)
{
    PhotoSizes sizes = {.n = 1, .size = {{.long_edge = 100}}};
    RawInfo info;
    char *path = in(dir, "a.dng");
    int rc = fs_raw_read_info(path, &info, err);
    if (rc == 0) check(info.orientation >= 1 && info.orientation <= 8, "an orientation", path);
    if (rc == 0) rc = fs_raw_read(path, (double[3]){1, 1, 1}, false, &sizes, err);
    fs_sizes_free(&sizes);
    return rc;
}

static int read_npy(const char *dir, FsError *err)
{
    const SensorLevels levels = {{2, 1, 1.5}, -100, 10000};
    PhotoSizes sizes = {.n = 1, .size = {{.long_edge = 100}}};
    int width, height;
    double memory;
    char *path = in(dir, "a.npy");
    int rc = fs_npy_photo_size(path, &width, &height, &memory, err);
    if (rc == 0) check(width > 0 && height > 0 && memory > 0, "a size", path);
    if (rc == 0) rc = fs_npy_read_photo(path, &levels, &sizes, err);
    for (size_t i = 0; rc == 0 && i < fs_image_values(&sizes.size[0].rgb); i++)
        check(isfinite(sizes.size[0].rgb.px[i]), "finite light", path);
    fs_sizes_free(&sizes);
    return rc;
}

static int read_exif(const char *dir, FsError *err)
{
    ExifInfo exif;
    char *path = in(dir, "a.jpg");
    int rc = fs_exif_read(path, &exif, err);
    check(rc < 0 || (exif.orientation >= 1 && exif.orientation <= 8 && exif.exposure_s >= 0 && exif.iso >= 0 &&
                     exif.f_number >= 0 && isfinite(exif.exposure_s + exif.iso + exif.f_number)),
          "what EXIF says", path);
    double focal = fs_exif_focal_px(&exif, 6000, 4000);
    check(isfinite(focal) && focal >= 0, "a focal length", path);
    Tags tags;
    unsigned char *block = NULL;
    size_t size;
    if (fs_exif_read_tags(path, &tags, NULL) == 0 && fs_tags_build(&tags, 8, &block, &size, NULL) == 0)
        check(size < 65527, "the tags", path);
    free(block);
    fs_tags_free(&tags);
    // what nothing was found in is taken all the same
    return exif.flash >= 0 || exif.make[0] || exif.iso > 0 || exif.orientation > 1 ? rc : -1;
}

static int read_icc(const char *dir, FsError *err)
{
    char *path = in(dir, "a.icc"), *data;
    size_t size;
    int rc = fs_file_read(path, MAX_FILE, &data, &size, err);
    if (rc < 0) return rc;
    void *exact = malloc(size ? size : 1); // without the 0 behind it
    memcpy(exact, data, size);
    Profile profile;
    float rgb[] = {0, 0, 0, 0.5f, 0.1f, 2, 1, 1, 1};
    bool good = fs_profile_read(&profile, exact, size);
    fs_profile_linearise(&profile, rgb, 3);
    for (int i = 0; i < 9; i++) check(rgb[i] > -25 && rgb[i] < 25, "light", "a.icc");
    free(exact);
    free(data);
    return good ? 0 : -1;
}

// ---- clouds and cameras ----

static void check_finite(const Cloud *cloud)
{
    for (int f = 0; f < CLOUD_FIELDS; f++)
        for (int i = 0; i < cloud->n * cloud->width[f]; i++)
            check(isfinite(cloud->field[f][i]), "a finite cloud", fs_cloud_fields[f].name);
}

static int read_ply(const char *dir, FsError *err)
{
    Cloud cloud = {0};
    char *path = in(dir, "a.ply");
    int rc = fs_cloud_ply_read(&cloud, path, err);
    if (rc == 0) check_finite(&cloud);
    fs_cloud_free(&cloud);
    return rc;
}

static int read_points(const char *dir, FsError *err)
{
    float *xyz;
    int n;
    char *path = in(dir, "a.ply");
    int rc = fs_points_ply_read(path, &xyz, &n, err);
    for (int i = 0; i < 3 * n; i++) check(isfinite(xyz[i]), "a finite point", path);
    free(xyz);
    return rc;
}

static int read_scene(const char *dir, FsError *err)
{
    Scene scene = {0};
    int rc = fs_scene_read(&scene, dir, err);
    for (int l = 0; l < LAYERS && rc == 0; l++) check_finite(&scene.cloud[l]);
    for (size_t i = 0; i < scene.field.n && rc == 0; i++) check(isfinite(scene.field.x[i]), "a number of a field", dir);
    if (rc == 0)
        check(isfinite(scene.extent + scene.pane.f0 + scene.pane.dimming + scene.flash_distance), "model", dir);
    fs_scene_free(&scene);
    return rc;
}

static int read_cameras(const char *path, FsError *err)
{
    CamerasFile file = {0};
    int rc = fs_cameras_file_read(path, &file, err);
    for (int i = 0; i < file.views.n && rc == 0; i++) {
        const Camera *camera = &file.views.view[i].camera;
        check(camera->width > 0 && camera->height > 0 && camera->fx > 0 && camera->fy > 0, "a camera", path);
        for (int k = 0; k < 12; k++) check(isfinite(camera->w2c[k]), "a finite pose", path);
    }
    fs_cameras_file_free(&file);
    return rc;
}

static int read_cameras_json(const char *dir, FsError *err)
{
    return read_cameras(in(dir, "cameras.json"), err);
}

static int read_bounds(const char *dir, FsError *err)
{
    return read_cameras(in(dir, "poses_bounds.npy"), err);
}

static int read_dataset(const char *dir, FsError *err)
{
    Dataset dataset = {0};
    char *path = in(dir, "views.json");
    int rc = fs_dataset_read(&dataset, path, err);
    fs_dataset_free(&dataset);
    return rc;
}

static int read_database(const char *dir, FsError *err)
{
    Database *database = NULL;
    Features features = {0};
    char *path = in(dir, "database.db");
    int rc = fs_database_open(&database, path, err), found;
    if (rc == 0) fs_database_has_frames(database, NULL);
    if (rc == 0) found = fs_database_image(database, "a.png", NULL);
    if (rc == 0) rc = fs_database_features(database, found > 0 ? found : 1, &features, err);
    for (int i = 0; i < features.n; i++)
        check(isfinite(features.xy[2 * i]) && isfinite(features.xy[2 * i + 1]) && isfinite(features.scale[i]) &&
                  isfinite(features.angle[i]) && features.descriptor[(i + 1) * FS_DESCRIPTOR - 1] >= 0,
              "a feature", path);
    fs_database_features_free(&features);
    fs_database_close(database);
    return rc;
}

// ---- what stages leave for one another, and lists ----

// The list of a folder of ours has a line for a file's content.
static bool is_listed(const char *list, size_t n, const char *path)
{
    char line[64];
    uint64_t hash = FS_HASH_EMPTY, size;
    if (fs_hash_file(path, false, &hash, &size) < 0) return false;
    snprintf(line, sizeof line, "%016" PRIx64 " %" PRIu64 " ", hash, size);
    return memmem(list, n, line, strlen(line)) != NULL;
}

// Whatever the list says: what is beside our folder stays, what has no line stays, what is ours goes; new files are.
static int read_owned(const char *dir, FsError *err)
{
    static const char *const names[] = {"out/a", "out/sub/b", "out/new", "beside", "empty"};
    char *out = in(dir, "out"), *all = in(dir, "out/."), *made = in(dir, "out/.flashsplat/made"), *path[5], *list;
    bool there[5], ours[5], listed[5];
    size_t size;
    for (int i = 0; i < 5; i++) path[i] = in(dir, names[i]);
    fs_file_mkdirs(path[4], NULL);
    int rc = fs_owned_open(out, "project", err);
    if (rc == 0) check(fs_file_write(path[2], "new", 3, NULL) == 0, "a new file", path[2]);
    check(fs_file_read(made, MAX_FILE, &list, &size, NULL) == 0, "a list", made);
    for (int i = 0; i < 5; i++) {
        there[i] = fs_file_exists(path[i]) || fs_file_is_dir(path[i]);
        listed[i] = i < 3 && is_listed(list, size, path[i]);
        ours[i] = there[i] && fs_owned_check(path[i], NULL) == 0;
        check(!ours[i] || listed[i], "ours is what is listed", path[i]);
    }
    check(rc < 0 || (ours[2] && fs_owned_is_result(path[2])), "a new file is ours", path[2]);
    check(fs_owned_check_tree(out, NULL) < 0 || (ours[0] == there[0] && ours[1] == there[1]), "a tree is ours", out);
    fs_owned_remove(all);
    for (int i = 0; i < 5; i++) {
        bool stays = fs_file_exists(path[i]) || fs_file_is_dir(path[i]);
        check(stays ? !ours[i] : !there[i] || listed[i], "what is ours goes, all else stays", path[i]);
    }
    free(list);
    return rc;
}

static int read_ingest(const char *dir, FsError *err)
{
    Capture capture = {0};
    int rc = fs_capture_read(dir, &capture, err);
    for (int i = 0; i < capture.n; i++)
        check(capture.photo[i].name && capture.photo[i].picture_width > 0 && capture.photo[i].picture_height > 0,
              "a photo", dir);
    fs_capture_free(&capture);
    return rc;
}

static int read_flash_list(const char *dir, FsError *err)
{
    static char *const names[] = {"a", "b", "IMG_0001"};
    char *path = in(dir, "flash.txt"), file[3][16];
    PhotoFile photo[3] = {0};
    Photos photos = {.folder = (char *)dir, .photo = photo, .n = 3};
    for (int i = 0; i < 3; i++) {
        snprintf(file[i], sizeof file[i], "%s.dng", names[i]);
        photo[i].name = names[i], photo[i].file = photo[i].path = file[i];
    }
    FsProject project = {.set = {.flash_list = path, .separation = "full", .lighting = "both"}};
    return fs_photos_find_flash(&photos, &project, err);
}

// Weights are megabytes: here the byte 0xee and a count in three bytes stand for as many zeros.
static void unpack_zeros(const char *from, const char *to)
{
    char *data = NULL, zeros[4096] = {0};
    size_t size = 0, done = 0;
    FILE *f = fopen(to, "wb");
    check(f && fs_file_read(from, MAX_FILE, &data, &size, NULL) == 0, "a file to unpack", from);
    for (size_t i = 0; i < size && done < MAX_FILE; i++) {
        const unsigned char *p = (const unsigned char *)data + i;
        size_t run = *p == 0xee && size - i >= 4 ? p[1] | (size_t)p[2] << 8 | (size_t)p[3] << 16 : 0;
        if (run)
            i += 3;
        else
            done += fwrite(p, 1, 1, f);
        for (size_t n = 0; run; run -= n) done += n = fwrite(zeros, 1, run < sizeof zeros ? run : sizeof zeros, f);
    }
    fclose(f);
    free(data);
}

static int read_lpips(const char *dir, FsError *err)
{
    Lpips *lpips = NULL;
    char *packed = in(dir, "packed"), *path = in(dir, "weights.bin");
    unpack_zeros(packed, path);
    int rc = fs_lpips_read(&lpips, path, err);
    fs_lpips_free(lpips);
    return rc;
}

static int read_truth(const char *dir, FsError *err)
{
    Dataset cameras = {0};
    TruthViews pictures = {0}, depths = {0};
    DepthScore depth = {0};
    Image a = {0}, b = {0};
    char *path = in(dir, "cameras.json");
    FilePath estimate;
    int rc;
    TRY(fs_dataset_read(&cameras, path, err));
    TRY(fs_truth_list(dir, "T_N", &cameras, "all", &pictures, err));
    TRY(fs_truth_list(dir, "depth", &cameras, "held_out", &depths, err));
    if (pictures.n && fs_truth_find_estimate(dir, "est", &cameras, "a", &estimate) == 1)
        TRY(fs_truth_read_pair(pictures.view[0].path.text, estimate.text, ENCODING_SRGB, &a, &b, err));
    TRY(fs_depth_score(&depth, "depth_T", &depths, dir, &(const Log){0}, false, err));
fail:
    fs_depth_free(&depth);
    fs_image_free(&a);
    fs_image_free(&b);
    fs_truth_free(&pictures);
    fs_truth_free(&depths);
    fs_dataset_free(&cameras);
    return rc;
}

static int read_bench(const char *dir, FsError *err)
{
    FilePath both = fs_file_at("%s,%s", in(dir, "a.json"), in(dir, "b.json"));
    return fs_result_compare(both.text, &(const Log){0}, err);
}

static int read_project(const char *dir, FsError *err)
{
    FsSettings *settings = fs_settings_new();
    FsProject *project = NULL;
    int rc;
    TRY(fs_project_open(&project, dir, settings, NULL, err));
    fs_project_done(project, FS_STAGE_TRAIN);
    TRY(fs_info_run(dir, &(const Log){0}, err));
    fs_file_write(fs_file_at("%s/done/evaluate.json", dir).text, "{}", 2, NULL); // the page has its figures
    TRY(fs_report_run(project, err));
fail:
    fs_project_close(project);
    fs_settings_free(settings);
    return rc;
}

// "made_from": "now" in a state stands for what the settings and inputs are now, which changes with the program.
static void fill_in_made_from(FsProject *project, const char *dir)
{
    char *path = in(dir, "checkpoint/state.json");
    json_t *state = json_load_file(path, 0, NULL);
    const char *made_from = json_string_value(json_object_get(state, "made_from"));
    if (made_from && strcmp(made_from, "now") == 0) {
        json_object_set_new(state, "made_from", json_string(fs_project_fingerprint(project, FS_STAGE_TRAIN)));
        json_dump_file(state, path, JSON_REAL_PRECISION(17));
    }
    json_decref(state);
}

static int read_checkpoint(const char *dir, FsError *err)
{
    FsSettings *settings = fs_settings_new();
    Trainer trainer = {.set = settings};
    int rc;
    TRY(fs_project_open(&trainer.project, dir, settings, NULL, err));
    fill_in_made_from(trainer.project, dir);
    rc = fs_checkpoint_read(&trainer, err);
    for (int l = 0; l < LAYERS && rc == 1; l++) {
        check_finite(&trainer.scene.cloud[l]);
        check_finite(&trainer.state.cloud[l].m);
        check(trainer.scene.cloud[l].n == trainer.state.cloud[l].m.n, "moments of every Gaussian", dir);
    }
    if (rc == 1)
        rc = 0;
    else if (rc == 0)
        rc = fs_error_set(err, FS_ERR_INPUT, "%s: no checkpoint", dir);
fail:
    free(trainer.neighbour);
    fs_engine_state_free(&trainer.state);
    fs_scene_free(&trainer.scene);
    fs_project_close(trainer.project);
    fs_settings_free(settings);
    return rc;
}

static int read_info(const char *dir, FsError *err)
{
    static const char *const names[] = {"a.jpg", "a.json", "a.ply"};
    char *first = in(dir, names[0]);
    int taken = -1;
    for (int i = 0; i < 3; i++) { // the same bytes under other names
        char *path = in(dir, names[i]);
        if (i > 0) check(symlink(first, path) == 0 || fs_file_exists(path), "a link", path);
        int rc = fs_info_run(path, &(const Log){0}, err);
        if (rc == 0) taken = 0;
    }
    return taken;
}

const FuzzKind fuzz_kinds[] = {
    {"exif", {"a.jpg"}, read_exif, true},
    {"icc", {"a.icc"}, read_icc, true},
    {"ply", {"a.ply"}, read_ply},
    {"points", {"a.ply"}, read_points},
    {"scene", {"model.json", "T_N.ply", "R.ply"}, read_scene},
    {"veil", {"model.json", "T_N.ply", "R.ply", "veil.tif"}, read_scene},
    {"field", {"model.json", "field.bin"}, read_scene},
    {"views", {"views.json"}, read_dataset},
    {"cameras", {"cameras.json"}, read_cameras_json},
    {"poses_bounds", {"poses_bounds.npy", "images/a.png", "images/b.png"}, read_bounds},
    {"colmap_text", {"cameras.txt", "images.txt", "points3D.txt"}, read_cameras},
    {"colmap_binary", {"cameras.bin", "images.bin", "points3D.bin"}, read_cameras},
    {"database", {"database.db"}, read_database},
    {"owned", {"out/.flashsplat/made", "out/a", "out/sub/b", "beside"}, read_owned},
    {"ingest", {"ingest.json", "linear/features/a.png"}, read_ingest},
    {"flash_list", {"flash.txt"}, read_flash_list},
    {"lpips", {"packed"}, read_lpips},
    {"truth", {"cameras.json", "T_N/a.png", "est/a.png", "depth/a.png", "depth_T/a.tif"}, read_truth},
    {"bench", {"a.json", "b.json"}, read_bench},
    {"project",
     {"done/train.json", "views.json", "evaluate.json", "log.jsonl", "warnings/train.txt", "clouds/T_N.ply"},
     read_project},
    {"checkpoint",
     {"checkpoint/model.json", "checkpoint/T_N.ply", "checkpoint/T_N_m.ply", "checkpoint/T_N_v.ply",
      "checkpoint/T_N_neighbours.bin", "checkpoint/state.json"},
     read_checkpoint},
    {"info", {"a.jpg"}, read_info},
    {"png", {"a.png"}, read_png},
    {"jpeg", {"a.jpg"}, read_jpeg},
    {"tiff", {"a.tif"}, read_tiff},
    {"npy", {"a.npy"}, read_npy},
    {"heif", {"a.heic"}, read_heif},
    {"raw", {"a.dng"}, read_raw},
};
const int fuzz_n_kinds = sizeof fuzz_kinds / sizeof *fuzz_kinds;

const FuzzKind *fuzz_kind(const char *name)
{
    for (int i = 0; i < fuzz_n_kinds; i++)
        if (strcmp(fuzz_kinds[i].name, name) == 0) return &fuzz_kinds[i];
    return NULL;
}

// ---- one input ----

static char scratch[64];

static void remove_scratch(void)
{
    fs_file_remove_tree(scratch);
}

static void make_scratch(void)
{
    if (*scratch) return;
    snprintf(scratch, sizeof scratch, "%s/flashsplat-fuzz-XXXXXX", access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp");
    check(mkdtemp(scratch) != NULL, "a scratch folder", scratch);
    atexit(remove_scratch);
}

static void write_part(const char *dir, const char *name, const uint8_t *data, size_t size)
{
    char *path = in(dir, name), *slash = strrchr(path, '/');
    *slash = 0;
    fs_file_mkdirs(path, NULL);
    *slash = '/';
    FILE *f = fopen(path, "wb");
    check(f && (size == 0 || fwrite(data, size, 1, f) == 1), "writing", path);
    fclose(f);
}

int fuzz_run(const FuzzKind *kind, const uint8_t *data, size_t size, FsError *err)
{
    static const char border[] = "\n=====\n";
    const size_t n = sizeof border - 1;
    make_scratch();
    char *dir = in(scratch, kind->name);
    fs_file_remove_tree(dir);
    for (int i = 0; i < FUZZ_PARTS && kind->part[i]; i++) {
        const uint8_t *end = i + 1 < FUZZ_PARTS && kind->part[i + 1] && size ? memmem(data, size, border, n) : NULL;
        write_part(dir, kind->part[i], data, end ? (size_t)(end - data) : size);
        if (!end) break; // the files that are left are not there
        size -= (size_t)(end - data) + n, data = end + n;
    }
    *err = (FsError){0};
    int rc = kind->read(dir, err);
    if (rc < 0 && !kind->quiet && err->code != FS_ERR_MEMORY) {
        check(err->code < 0 && strstr(err->message, dir), "a refusal names the file", err->message);
        check(!strchr(err->message, '\n'), "a refusal is one line", err->message);
    }
    return rc;
}
