#include "render/video.h"

#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"

#define BUFFER_BYTES 32768

struct Video {
    AVFormatContext *format;
    AVCodecContext *encoder;
    AVStream *stream;
    struct SwsContext *scaler;
    AVFrame *frame;
    AVPacket *packet;
    unsigned char *rgb; // (height, stride), 3 bytes a pixel; the stride leaves room for swscale to read over the end
    int stride;
    int width, height; // even
    int64_t frames;
    AtomicFile file;
    const Log *log;
};

// FFmpeg's log callback has no user pointer; its messages belong to whoever encodes on this thread.
static _Thread_local const Log *thread_log;

static void log_from_ffmpeg(void *context, int level, const char *format, va_list ap)
{
    (void)context;
    if (level > AV_LOG_WARNING || !thread_log) return;
    char line[500];
    vsnprintf(line, sizeof line, format, ap);
    line[strcspn(line, "\n")] = 0;
    if (*line) fs_log_debug(thread_log, "ffmpeg: %s", line);
}

static void capture_log(const Log *log)
{
    thread_log = log;
    av_log_set_callback(log ? log_from_ffmpeg : av_log_default_callback);
}

static int failed(const Video *video, const char *what, int code, FsError *err)
{
    char text[AV_ERROR_MAX_STRING_SIZE] = "";
    av_strerror(code, text, sizeof text);
    if (code == AVERROR(ENOMEM)) return fs_error_memory(err);
    char why[AV_ERROR_MAX_STRING_SIZE + 40];
    snprintf(why, sizeof why, "cannot %s the video: %s", what, text);
    return fs_file_failed(&video->file, why, err);
}

#if LIBAVFORMAT_VERSION_MAJOR < 61 // FFmpeg 7
typedef uint8_t OutByte;
#else
typedef const uint8_t OutByte;
#endif

static int put_out(void *file, OutByte *data, int size)
{
    return fs_file_put(file, data, (size_t)size) == size ? size : AVERROR(((AtomicFile *)file)->error);
}

static int64_t seek_to(void *file, int64_t offset, int whence)
{
    if (whence & AVSEEK_SIZE) return AVERROR(ENOSYS);
    return lseek(((AtomicFile *)file)->fd, offset, whence & ~AVSEEK_FORCE);
}

void fs_video_abort(Video *video)
{
    if (!video) return;
    if (video->format && video->format->pb) av_freep(&video->format->pb->buffer);
    if (video->format) avio_context_free(&video->format->pb);
    avformat_free_context(video->format);
    avcodec_free_context(&video->encoder);
    sws_freeContext(video->scaler);
    av_frame_free(&video->frame);
    av_packet_free(&video->packet);
    free(video->rgb);
    fs_file_abort(&video->file);
    free(video);
    capture_log(NULL);
}

static int open_encoder(Video *video, int fps)
{
    const AVCodec *codec = avcodec_find_encoder_by_name("libx264");
    if (!codec) codec = avcodec_find_encoder(AV_CODEC_ID_MPEG4);
    if (!codec) return AVERROR_ENCODER_NOT_FOUND;
    AVCodecContext *c = video->encoder = avcodec_alloc_context3(codec);
    if (!c) return AVERROR(ENOMEM);
    c->width = video->width;
    c->height = video->height;
    c->pix_fmt = AV_PIX_FMT_YUV420P;
    c->time_base = (AVRational){1, fps};
    c->framerate = (AVRational){fps, 1};
    c->gop_size = fps;
    c->thread_count = 1; // the same bytes on every machine
    c->color_range = AVCOL_RANGE_MPEG;
    c->colorspace = AVCOL_SPC_BT709;
    c->color_primaries = AVCOL_PRI_BT709;
    c->color_trc = AVCOL_TRC_BT709;
    c->flags |= AV_CODEC_FLAG_BITEXACT;
    if (video->format->oformat->flags & AVFMT_GLOBALHEADER) c->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    if (codec->id == AV_CODEC_ID_H264) {
        if (av_opt_set(c->priv_data, "preset", "medium", 0) == AVERROR(ENOMEM) ||
            av_opt_set(c->priv_data, "crf", "18", 0) == AVERROR(ENOMEM))
            fs_error_memory(NULL); // its default would do for an encoder that lacks it
#ifdef __x86_64__
        // those beyond differ from plain C, AVX-512's at random
        int set = av_opt_set(c->priv_data, "x264-params", "asm=sse2", 0); // AVERROR(EINVAL) for want of memory, too
        if (set < 0 && set != AVERROR_OPTION_NOT_FOUND) fs_error_memory(NULL);
#endif
    } else {
        c->flags |= AV_CODEC_FLAG_QSCALE;
        c->global_quality = 3 * FF_QP2LAMBDA;
    }
    return avcodec_open2(c, codec, NULL);
}

static int open_file(Video *video, int fps)
{
    FilePath url = fs_file_at("file:%s", video->file.temp); // a name may look like a protocol's: 10:30/film.mp4
    int rc = avformat_alloc_output_context2(&video->format, NULL, "mp4", url.text);
    if (rc < 0) return rc;
    video->format->flags |= AVFMT_FLAG_BITEXACT;
    if ((rc = open_encoder(video, fps)) < 0) return rc;
    video->stream = avformat_new_stream(video->format, NULL);
    if (!video->stream) return AVERROR(ENOMEM);
    video->stream->time_base = video->encoder->time_base;
    video->stream->avg_frame_rate = video->encoder->framerate;
    if ((rc = avcodec_parameters_from_context(video->stream->codecpar, video->encoder)) < 0) return rc;
    unsigned char *buffer = av_malloc(BUFFER_BYTES);
    video->format->pb =
        buffer ? avio_alloc_context(buffer, BUFFER_BYTES, 1, &video->file, NULL, put_out, seek_to) : NULL;
    if (!video->format->pb) {
        av_free(buffer);
        return AVERROR(ENOMEM);
    }
    // not among avformat_write_header's options: for want of memory it would lose it in silence
    MUST(av_opt_set(video->format->priv_data, "movflags", "+faststart", 0));
    return avformat_write_header(video->format, NULL);
}

static int open_frame(Video *video)
{
    video->frame = av_frame_alloc();
    video->packet = av_packet_alloc();
    video->stride = (3 * video->width + 127) / 64 * 64;
    video->rgb = calloc((size_t)video->stride, (size_t)video->height);
    if (!video->frame || !video->packet || !video->rgb) return AVERROR(ENOMEM);
    video->frame->format = AV_PIX_FMT_YUV420P;
    video->frame->width = video->width;
    video->frame->height = video->height;
    video->frame->color_range = AVCOL_RANGE_MPEG;
    video->frame->colorspace = AVCOL_SPC_BT709;
    MUST(av_frame_get_buffer(video->frame, 0));
    video->scaler =
        sws_getContext(video->width, video->height, AV_PIX_FMT_RGB24, video->width, video->height, AV_PIX_FMT_YUV420P,
                       SWS_BICUBIC | SWS_ACCURATE_RND | SWS_BITEXACT | SWS_FULL_CHR_H_INP, NULL, NULL, NULL);
    if (!video->scaler) return AVERROR(ENOMEM);
    sws_setColorspaceDetails(video->scaler, sws_getCoefficients(SWS_CS_ITU709), 1, sws_getCoefficients(SWS_CS_ITU709),
                             0, 0, 1 << 16, 1 << 16);
    return 0;
}

int fs_video_open(Video **result, const char *path, int width, int height, int frames_per_second, const Log *log,
                  FsError *err)
{
    *result = NULL;
    if (width < 2 || height < 2)
        return fs_error_input(err, "%s: pictures of %d x %d are too small for a video", path, width, height);
    Video *video = calloc(1, sizeof *video);
    if (!video) return fs_error_memory(err);
    video->width = width & ~1;
    video->height = height & ~1;
    video->log = log;
    int rc;
    TRY(fs_file_begin(&video->file, path, err));
    capture_log(log);
    if ((rc = open_file(video, frames_per_second)) < 0 || (rc = open_frame(video)) < 0)
        TRY(failed(video, "begin", rc, err));
    *result = video;
    return 0;
fail:
    fs_video_abort(video);
    return rc;
}

// Sends one frame (NULL: the end) and writes the packets that come out.
static int encode(Video *video, const AVFrame *frame)
{
    int rc = avcodec_send_frame(video->encoder, frame);
    while (rc >= 0) {
        rc = avcodec_receive_packet(video->encoder, video->packet);
        if (rc == AVERROR(EAGAIN) || rc == AVERROR_EOF) return 0;
        if (rc < 0) break;
        if (!video->packet->duration) video->packet->duration = 1;
        av_packet_rescale_ts(video->packet, video->encoder->time_base, video->stream->time_base);
        video->packet->stream_index = video->stream->index;
        rc = av_interleaved_write_frame(video->format, video->packet);
    }
    return rc;
}

static unsigned char to_byte(float value)
{
    return value > 0 ? (unsigned char)(value < 1 ? value * 255 + 0.5f : 255) : 0;
}

int fs_video_add(Video *video, const Image *picture, FsError *err)
{
    if (picture->channels != 3 || (picture->width & ~1) != video->width || (picture->height & ~1) != video->height)
        return fs_error_input(err, "%s: a picture of %d x %d, expected %d x %d like the first", video->file.path,
                              picture->width, picture->height, video->width, video->height);
    capture_log(video->log);
    for (int y = 0; y < video->height; y++)
        for (int i = 0; i < 3 * video->width; i++)
            video->rgb[(size_t)video->stride * (size_t)y + (size_t)i] =
                to_byte(picture->px[(size_t)(3 * picture->width) * (size_t)y + (size_t)i]);
    int rc = av_frame_make_writable(video->frame);
    if (rc >= 0) {
        const uint8_t *source[4] = {video->rgb};
        int source_stride[4] = {video->stride};
        sws_scale(video->scaler, source, source_stride, 0, video->height, video->frame->data, video->frame->linesize);
        video->frame->pts = video->frames++;
        rc = encode(video, video->frame);
    }
    return rc < 0 ? failed(video, "write", rc, err) : 0;
}

int fs_video_finish(Video *video, FsError *err)
{
    capture_log(video->log);
    int rc = encode(video, NULL);
    if (rc >= 0) rc = av_write_trailer(video->format);
    if (rc >= 0) avio_flush(video->format->pb);
    if (rc >= 0) rc = video->format->pb->error;
    rc = rc < 0 ? failed(video, "finish", rc, err) : fs_file_commit(&video->file, err);
    fs_video_abort(video);
    return rc;
}
