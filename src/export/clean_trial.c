#include "export/clean_trial.h"

#include <string.h>

#include "base/clock.h"
#include "base/owned.h"
#include "export/clean_file.h"
#include "export/clean_photo.h"

#define PIXEL_BYTES 30.0 // of a photo at its full size

typedef struct Trial {
    PhotoSizes sizes; // full and working size
    CleanGuide guide;
    CleanPicture picture;
} Trial;

static void free_trial(Trial *t)
{
    fs_sizes_free(&t->sizes);
    fs_clean_photo_free(&t->guide);
    fs_image_free(&t->picture.rgb);
}

// As fs_clean_run does it, but for what the clouds would show: all of the photo.
static int clean_photo(Trial *t, const CleanArgs *args, const Photos *photos, Threads *threads, FsError *err)
{
    const SensorLevels levels = fs_photos_developed(photos);
    PhotoLight light;
    Image *full = &t->sizes.size[0].rgb, *small = &t->sizes.size[1].rgb;
    Image *const to[2] = {&t->guide.T, &t->guide.whole};
    MUST(fs_photo_read(t->picture.path.text, &levels, &t->sizes, &light, err));
    t->picture.encoded = light >= PHOTO_ENCODED;
    for (int i = 0; i < 2; i++) {
        MUST(fs_image_new(to[i], small->width, small->height, 3, err));
        memcpy(to[i]->px, small->px, fs_image_values(small) * sizeof *small->px);
    }
    t->guide.full = t->sizes.white;
    MUST(fs_clean_photo_guide(&t->guide, small, &t->sizes.size[1].clipped, NULL, err));
    MUST(fs_clean_photo_apply(&t->guide, threads, full, &t->sizes.size[0].clipped, err));
    t->picture.rgb = *full;
    *full = (Image){0};
    return fs_clean_file_write(args, &t->picture, threads, err);
}

int fs_clean_trial_run(const FsProject *project, const char *folder, const bool wanted[CLEAN_FORMATS], RunCost *cost,
                       FsError *err)
{
    static const double balance[3] = {1, 1, 1};
    const Development development = {.light.exposure = 1};
    FsProject scratch = *project;
    Photos photos = {0};
    Trial t = {.sizes = {.n = 2, .size = {{.long_edge = 0}, {.long_edge = project->set.long_edge}}}};
    Threads *threads = fs_threads_new(project->set.threads);
    FilePath dir = fs_file_at("%s/" FS_OWNED_DIR "/estimate", project->out);
    int rc;
    scratch.out = dir.text;
    if (!threads) TRY(fs_error_memory(err));
    TRY(fs_photos_scan(&photos, folder, &(Log){0}, err));
    TRY(fs_photos_levels(&photos.npy, &project->set, err));
    const PhotoFile *photo = &photos.photo[photos.n / 2];
    t.picture = (CleanPicture){
        .name = "trial", .photo = *photo, .path = fs_photos_path(&photos, photo), .white_balance = balance};
    TRY(fs_file_mkdirs(fs_file_at("%s/export/photos", dir.text).text, err));
    double begin = fs_clock_seconds();
    TRY(clean_photo(&t, &(CleanArgs){.project = &scratch, .development = &development, .wanted = wanted}, &photos,
                    threads, err));
    *cost = (RunCost){photos.n * (fs_clock_seconds() - begin), PIXEL_BYTES * (double)fs_image_pixels(&t.picture.rgb)};
fail:
    free_trial(&t);
    fs_owned_remove(dir.text);
    fs_photos_free(&photos);
    fs_threads_free(threads);
    return rc;
}
