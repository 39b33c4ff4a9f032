// Layers as 8-bit PNG in the encoding of the layer PNGs; depth in millimetres and reflectance as 16-bit PNG.
#include "synth/truth_files.h"

#include "base/file.h"
#include "base/json_file.h"
#include "image/tone.h"
#include "model/colmap_model.h"
#include "model/layers.h"

static json_t *shot_json(const Shot *s)
{
    const Camera *c = &s->camera;
    const double *m = c->w2c;
    char file[24];
    snprintf(file, sizeof file, "%s.DNG", s->name);
    return json_pack("{s:s, s:s?, s:o, s:b, s:i, s:i, s:f, s:f, s:f, s:f, s:[[ffff][ffff][ffff][ffff]], s:b}", "name",
                     s->name, "file", s->held_out ? NULL : file, "flash",
                     s->held_out ? json_null() : json_boolean(s->flash), "held_out", s->held_out, "width", c->width,
                     "height", c->height, "fx", c->fx, "fy", c->fy, "cx", c->cx, "cy", c->cy, "w2c", m[0], m[1], m[2],
                     m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11], 0.0, 0.0, 0.0, 1.0, "truth", s->truth);
}

static int write_json(const char *dir, const char *scene, const Shot *shot, int n, FsError *err)
{
    json_t *images = json_array();
    for (int i = 0; i < n; i++) json_array_append_new(images, shot_json(&shot[i]));
    json_t *root = json_pack("{s:s, s:s, s:o}", "scene", scene, "note",
                             "w2c: world-to-camera, COLMAP axes (x right, y down, z forward), metres; "
                             "pixel centres at +0.5",
                             "images", images);
    return fs_json_file_write(fs_file_at("%s/cameras.json", dir).text, root, JSON_INDENT(1), err);
}

int fs_truth_files_sparse(const char *dir, const Shot *shot, int n, const Spec *spec, const Lens *lens, FsError *err)
{
    int rc;
    ColmapModel model = {0};
    FilePath path = fs_file_at("%s/sparse%s", dir, lens ? "_opencv" : "");
    TRY(fs_file_mkdirs(path.text, err));
    Rng rng = fs_rng_new(spec->seed * 53ull + 11);
    for (int i = 0; i < n; i++) {
        char name[24];
        snprintf(name, sizeof name, "%s.JPG", shot[i].name);
        Camera camera = spec->pose_noise ? fs_path_disturbed(&shot[i].camera, &rng) : shot[i].camera;
        if (i == 0) {
            ColmapCamera *c = fs_colmap_model_add_camera(&model, err);
            TRY(c ? 0 : FS_ERR_MEMORY);
            *c = (ColmapCamera){1, lens ? *lens : fs_lens_from_camera(&camera)};
        }
        ColmapImage *image = fs_colmap_model_add_image(&model, name, err);
        TRY(image ? 0 : FS_ERR_MEMORY);
        image->id = (uint32_t)i + 1;
        image->camera_id = 1;
        fs_camera_pose_to_quat(camera.w2c, image->quat, image->t);
    }
    TRY(fs_colmap_model_write(path.text, &model, false, err));
fail:
    fs_colmap_model_free(&model);
    return rc;
}

static const RenderLayer folders[] = {RENDER_T_N, RENDER_T_F,     RENDER_R,       RENDER_I_N,
                                      RENDER_I_F, RENDER_DEPTH_T, RENDER_DEPTH_R, RENDER_BETA};

int fs_truth_files_cameras(const char *dir, const char *scene, const Shot *shot, int n, const Spec *spec, FsError *err)
{
    MUST(write_json(dir, scene, shot, n, err));
    MUST(fs_truth_files_sparse(dir, shot, n, spec, NULL, err));
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++)
        MUST(fs_file_mkdirs(fs_file_at("%s/%s", dir, fs_render_layers[folders[i]].name).text, err));
    return 0;
}

// Writes a + b (b may be NULL), coded; scale: for maps that are not colours, which stay linear.
static int write_png(const char *dir, RenderLayer layer, const char *name, const Image *a, const Image *b, float scale,
                     FsError *err)
{
    Image image = {0};
    int rc;
    TRY(fs_image_copy(&image, a, err));
    for (size_t i = 0; i < fs_image_values(&image); i++) image.px[i] = (image.px[i] + (b ? b->px[i] : 0.0f)) * scale;
    bool color = image.channels == 3;
    if (color) fs_tone_encode_image(&image);
    TRY(fs_png_write(fs_file_at("%s/%s/%s.png", dir, fs_render_layers[layer].name, name).text, &image, color ? 8 : 16,
                     err));
fail:
    fs_image_free(&image);
    return rc;
}

int fs_truth_files_layers(const char *dir, const Shot *shot, const Traced *traced, FsError *err)
{
    const Image *l = traced->layer;
    MUST(write_png(dir, RENDER_T_N, shot->name, &l[TRACE_T_N], NULL, 1, err));
    MUST(write_png(dir, RENDER_T_F, shot->name, &l[TRACE_T_F], NULL, 1, err));
    MUST(write_png(dir, RENDER_R, shot->name, &l[TRACE_R_N], NULL, 1, err));
    if (shot->held_out) {
        MUST(write_png(dir, RENDER_I_N, shot->name, &l[TRACE_T_N], &l[TRACE_R_N], 1, err));
        MUST(write_png(dir, RENDER_I_F, shot->name, &l[TRACE_T_F], &l[TRACE_R_F], 1, err));
    }
    return 0;
}

int fs_truth_files_geometry(const char *dir, const Shot *shot, const Geometry *geometry, FsError *err)
{
    const float metre = 1000.0f / 65535.0f; // in millimetres
    MUST(write_png(dir, RENDER_DEPTH_T, shot->name, &geometry->depth_T, NULL, metre, err));
    MUST(write_png(dir, RENDER_DEPTH_R, shot->name, &geometry->depth_R, NULL, metre, err));
    return write_png(dir, RENDER_BETA, shot->name, &geometry->beta, NULL, 1, err);
}

int fs_truth_files_mask(const char *dir, const Shot *shot, const Image *mask, FsError *err)
{
    MUST(fs_file_mkdirs(fs_file_at("%s/figures", dir).text, err));
    return fs_png_write(fs_file_at("%s/figures/%s.png", dir, shot->name).text, mask, 8, err);
}
