// Videos: read back with FFmpeg's own demuxer and decoder.
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <string.h>
#include <unistd.h>

#include "render/pictures.h"
#include "render/video.h"
#include "temp_dir.h"

typedef struct Seen {
    int frames, width, height, pixel_format;
    double first_y, first_u, first_v; // middle of the first frame
    double fps;
} Seen;

static void take_frames(AVCodecContext *decoder, AVFrame *frame, Seen *seen)
{
    while (avcodec_receive_frame(decoder, frame) == 0) {
        if (seen->frames++ == 0) {
            int x = frame->width / 2, y = frame->height / 2;
            seen->first_y = frame->data[0][y * frame->linesize[0] + x];
            seen->first_u = frame->data[1][y / 2 * frame->linesize[1] + x / 2];
            seen->first_v = frame->data[2][y / 2 * frame->linesize[2] + x / 2];
        }
        seen->width = frame->width;
        seen->height = frame->height;
        seen->pixel_format = frame->format;
    }
}

static Seen watch(const char *path)
{
    Seen seen = {0};
    AVFormatContext *format = NULL;
    assert_int_equal(avformat_open_input(&format, path, NULL, NULL), 0);
    assert_true(avformat_find_stream_info(format, NULL) >= 0);
    assert_int_equal(format->nb_streams, 1);
    assert_non_null(strstr(format->iformat->name, "mp4"));
    AVStream *stream = format->streams[0];
    seen.fps = av_q2d(stream->avg_frame_rate);
    const AVCodec *codec = avcodec_find_decoder(stream->codecpar->codec_id);
    AVCodecContext *decoder = avcodec_alloc_context3(codec);
    avcodec_parameters_to_context(decoder, stream->codecpar);
    assert_int_equal(avcodec_open2(decoder, codec, NULL), 0);
    AVPacket *packet = av_packet_alloc();
    AVFrame *frame = av_frame_alloc();
    while (av_read_frame(format, packet) == 0) {
        assert_int_equal(avcodec_send_packet(decoder, packet), 0);
        av_packet_unref(packet);
        take_frames(decoder, frame, &seen);
    }
    avcodec_send_packet(decoder, NULL);
    take_frames(decoder, frame, &seen);
    av_frame_free(&frame);
    av_packet_free(&packet);
    avcodec_free_context(&decoder);
    avformat_close_input(&format);
    return seen;
}

static void fill(Image *image, float r, float g, float b, int shift)
{
    for (int i = 0; i < image->width * image->height; i++) {
        bool stripe = i % image->width < shift;
        image->px[3 * i] = stripe ? 0 : r;
        image->px[3 * i + 1] = stripe ? 0 : g;
        image->px[3 * i + 2] = stripe ? 0 : b;
    }
}

static int make_video(const char *path, int frames, FsError *err)
{
    Image image;
    assert_int_equal(fs_image_new(&image, 65, 49, 3, NULL), 0);
    Video *video;
    int rc = fs_video_open(&video, path, image.width, image.height, 30, NULL, err);
    for (int i = 0; i < frames && rc == 0; i++) {
        fill(&image, 0.8f, 0.2f, 0.1f, i);
        rc = fs_video_add(video, &image, err);
    }
    if (rc == 0) {
        assert_false(fs_file_exists(path)); // not before it is whole
        rc = fs_video_finish(video, err);
    }
    fs_image_free(&image);
    return rc;
}

static void a_video_plays(void **state)
{
    char *path = fs_file_path("%s/v.mp4", (const char *)*state),
         *again = fs_file_path("%s/w.mp4", (const char *)*state);
    assert_int_equal(make_video(path, 37, NULL), 0);
    Seen seen = watch(path);
    assert_int_equal(seen.frames, 37);
    assert_int_equal(seen.width, 64); // odd sizes lose their last column and row
    assert_int_equal(seen.height, 48);
    assert_int_equal(seen.pixel_format, AV_PIX_FMT_YUV420P);
    assert_float_equal(seen.fps, 30, 0.01);
    // BT.709, limited range, of (0.8, 0.2, 0.1)
    double y = 0.2126 * 0.8 + 0.7152 * 0.2 + 0.0722 * 0.1;
    assert_float_equal(seen.first_y, 16 + 219 * y, 3);
    assert_float_equal(seen.first_u, 128 + 224 * (0.1 - y) / 1.8556, 3);
    assert_float_equal(seen.first_v, 128 + 224 * (0.8 - y) / 1.5748, 3);
    assert_int_equal(make_video(again, 37, NULL), 0);
    char *a, *b;
    size_t na, nb;
    assert_int_equal(fs_file_read(path, 1 << 24, &a, &na, NULL), 0);
    assert_int_equal(fs_file_read(again, 1 << 24, &b, &nb, NULL), 0);
    assert_int_equal(na, nb);
    assert_memory_equal(a, b, na);
    free(a);
    free(b);
    free(path);
    free(again);
}

// A name that looks like a protocol's to FFmpeg.
static void a_path_may_have_a_colon(void **state)
{
    FsError err = {0};
    assert_int_equal(chdir(*state), 0);
    assert_int_equal(fs_file_mkdirs("10:30", NULL), 0);
    if (make_video("10:30/v.mp4", 3, &err) != 0) fail_msg("%s", err.message);
    char *path = fs_file_path("%s/10:30/v.mp4", (const char *)*state);
    assert_int_equal(watch(path).frames, 3);
    assert_int_equal(chdir("/"), 0);
    free(path);
}

static void failures_leave_no_file(void **state)
{
    FsError err = {0};
    Video *video;
    Image image;
    FileList list;
    char *nowhere = fs_file_path("%s/no/such/v.mp4", (const char *)*state);
    char *path = fs_file_path("%s/v.mp4", (const char *)*state);
    assert_int_equal(make_video(nowhere, 3, &err), FS_ERR_IO);
    assert_non_null(strstr(err.message, nowhere));
    assert_null(strchr(err.message, '\n'));
    assert_int_equal(fs_video_open(&video, path, 1, 50, 30, NULL, &err), FS_ERR_INPUT);
    assert_int_equal(fs_video_open(&video, path, 40, 30, 30, NULL, &err), 0);
    assert_int_equal(fs_image_new(&image, 60, 30, 3, NULL), 0);
    assert_int_equal(fs_video_add(video, &image, &err), FS_ERR_INPUT);
    fs_video_abort(video);
    fs_image_free(&image);
    assert_int_equal(fs_file_list(*state, &list, NULL), 0);
    assert_int_equal(list.n, 0);
    fs_file_list_free(&list);
    free(nowhere);
    free(path);
}

static void pictures_beside_one_another_may_be_too_wide(void **state)
{
    FsError err = {0};
    Films *films;
    for (int wide = 0; wide < 2; wide++) {
        FilePath dir = fs_file_at("%s/%d", (const char *)*state, wide);
        assert_int_equal(fs_pictures_films_begin(&films, dir.text, wide ? 6000 : 60, 2, &(Log){0}, &err), 0);
        assert_int_equal(fs_pictures_films_finish(films, &err), 0);
        assert_true(fs_file_exists(fs_file_at("%s/T.mp4", dir.text).text));
        assert_int_equal(fs_file_exists(fs_file_at("%s/side_by_side.mp4", dir.text).text), !wide);
    }
}

int main(void)
{
    av_log_set_level(AV_LOG_QUIET);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_video_plays, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(a_path_may_have_a_colon, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(failures_leave_no_file, temp_dir_make, temp_dir_remove),
        cmocka_unit_test_setup_teardown(pictures_beside_one_another_may_be_too_wide, temp_dir_make, temp_dir_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
