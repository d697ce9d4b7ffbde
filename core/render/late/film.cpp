// H.264 by FFmpeg, for core/render/video.cpp: a shared object of its own, since FFmpeg brings a
// hundred others.
#include "core/render/late/film.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/saturating_cast.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

struct FreeFormat {
  void operator()(AVFormatContext* format) const {
    if (format->pb != nullptr) {
      avio_closep(&format->pb);  // after a failure; `finish` closes and checks
    }
    avformat_free_context(format);
  }
};
struct FreeCodec {
  void operator()(AVCodecContext* codec) const { avcodec_free_context(&codec); }
};
struct FreeFrame {
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};
struct FreePacket {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};

class Encoder : public VideoEncoder {
 public:
  Encoder(std::filesystem::path path, const std::filesystem::path& written, int width, int height,
          const VideoOptions& options)
      : path_(std::move(path)) {
    av_log_set_level(AV_LOG_ERROR);
    const AVCodec* encoder = avcodec_find_encoder_by_name("libx264");
    if (encoder == nullptr) {
      throw EnvironmentError("H.264 encoder libx264",
                             "this build of FFmpeg does not have it; "
                             "install a libavcodec that is built with x264, as Debian's is");
    }
    AVFormatContext* format = nullptr;
    check(avformat_alloc_output_context2(&format, nullptr, "mp4", written.c_str()), "starting");
    format_.reset(format);
    stream_ = avformat_new_stream(format, nullptr);
    codec_.reset(avcodec_alloc_context3(encoder));
    frame_.reset(av_frame_alloc());
    packet_.reset(av_packet_alloc());
    if (stream_ == nullptr || !codec_ || !frame_ || !packet_) {
      throw EnvironmentError(path_.string(), "out of memory");
    }
    codec_->width = width;
    codec_->height = height;
    codec_->pix_fmt = AV_PIX_FMT_YUV420P;
    codec_->time_base = av_d2q(1 / options.fps, 1'000'000);
    codec_->framerate = av_inv_q(codec_->time_base);
    codec_->color_range = AVCOL_RANGE_MPEG;
    codec_->color_primaries = AVCOL_PRI_BT709;
    codec_->color_trc = AVCOL_TRC_IEC61966_2_1;
    codec_->colorspace = AVCOL_SPC_BT709;
    codec_->thread_count = 1;
    if ((format_->oformat->flags & AVFMT_GLOBALHEADER) != 0) {
      codec_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    }
    check(av_opt_set_int(codec_->priv_data, "crf", options.quality, 0), "setting the quality");
    check(av_opt_set(codec_->priv_data, "preset", "medium", 0), "setting the preset");
    // x264's AVX-512 code for macroblock trees reads memory that nobody wrote (release 164): the
    // same frames would give different bytes.
    check(av_opt_set(codec_->priv_data, "x264-params", "mbtree=0", 0), "setting the parameters");
    check(avcodec_open2(codec_.get(), encoder, nullptr), "opening the encoder");
    stream_->time_base = codec_->time_base;
    stream_->avg_frame_rate = codec_->framerate;
    check(avcodec_parameters_from_context(stream_->codecpar, codec_.get()),
          "describing the stream");
    check(av_opt_set(format_->priv_data, "movflags", "+faststart", 0),
          "asking for the index in front");
    // No version string: the bytes depend on the frames alone.
    format_->flags |= AVFMT_FLAG_BITEXACT;
    check(avio_open(&format_->pb, written.c_str(), AVIO_FLAG_WRITE), "opening the file");
    check(avformat_write_header(format_.get(), nullptr), "writing the header");
    frame_->format = codec_->pix_fmt;
    frame_->width = width;
    frame_->height = height;
    check(av_frame_get_buffer(frame_.get(), 0), "taking memory for a frame");
  }

  void add(const ByteImage& image, Index number) override {
    check(av_frame_make_writable(frame_.get()), "taking memory for a frame");
    convert(image);
    frame_->pts = number;
    check(avcodec_send_frame(codec_.get(), frame_.get()), "encoding");
    write_packets();
  }

  void finish() override {
    check(avcodec_send_frame(codec_.get(), nullptr), "encoding the end");
    write_packets();
    check(av_write_trailer(format_.get()), "writing the index");
    check(format_->pb->error, "writing");
    check(avio_closep(&format_->pb), "closing the file");
  }

 private:
  void check(int result, const char* doing) const {
    if (result < 0) {
      char reason[AV_ERROR_MAX_STRING_SIZE] = {};
      av_strerror(result, reason, sizeof reason);
      // FFmpeg's own codes are beyond the system's.
      const bool system = result > -4096;
      throw EnvironmentError(
          path_.string(),
          std::string(doing) + " failed: " + (system ? system_reason(AVUNERROR(result)) : reason));
    }
  }

  void write_packets() {
    while (true) {
      const int result = avcodec_receive_packet(codec_.get(), packet_.get());
      if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) {
        return;
      }
      check(result, "encoding");
      av_packet_rescale_ts(packet_.get(), codec_->time_base, stream_->time_base);
      packet_->stream_index = stream_->index;
      check(av_interleaved_write_frame(format_.get(), packet_.get()), "writing");
      check(format_->pb->error, "writing");
    }
  }

  // sRGB bytes to BT.709 Y'CbCr of limited range; colour differences are means of 2 x 2 pixels.
  void convert(const ByteImage& image) {
    const int w = codec_->width;
    const int h = codec_->height;
    const auto pixel = [&](int x, int y, int c) {
      return static_cast<float>(
          image.at(std::min(x, image.width - 1), std::min(y, image.height - 1), c));
    };
    const auto byte = [](float value) {
      return saturating_cast<std::uint8_t>(std::round(std::clamp(value, 0.0f, 255.0f)));
    };
    for (int y = 0; y < h; ++y) {
      std::uint8_t* row = frame_->data[0] + static_cast<std::ptrdiff_t>(y) * frame_->linesize[0];
      for (int x = 0; x < w; ++x) {
        const float luma =
            0.2126f * pixel(x, y, 0) + 0.7152f * pixel(x, y, 1) + 0.0722f * pixel(x, y, 2);
        row[x] = byte(16 + luma * (219.0f / 255));
      }
    }
    for (int y = 0; y < h / 2; ++y) {
      std::uint8_t* cb = frame_->data[1] + static_cast<std::ptrdiff_t>(y) * frame_->linesize[1];
      std::uint8_t* cr = frame_->data[2] + static_cast<std::ptrdiff_t>(y) * frame_->linesize[2];
      for (int x = 0; x < w / 2; ++x) {
        float rgb[3] = {0, 0, 0};
        for (int c = 0; c < 3; ++c) {
          rgb[c] = 0.25f * (pixel(2 * x, 2 * y, c) + pixel(2 * x + 1, 2 * y, c) +
                            pixel(2 * x, 2 * y + 1, c) + pixel(2 * x + 1, 2 * y + 1, c));
        }
        const float luma = 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2];
        cb[x] = byte(128 + (rgb[2] - luma) / 1.8556f * (224.0f / 255));
        cr[x] = byte(128 + (rgb[0] - luma) / 1.5748f * (224.0f / 255));
      }
    }
  }

  std::filesystem::path path_;
  std::unique_ptr<AVFormatContext, FreeFormat> format_;
  std::unique_ptr<AVCodecContext, FreeCodec> codec_;
  std::unique_ptr<AVFrame, FreeFrame> frame_;
  std::unique_ptr<AVPacket, FreePacket> packet_;
  AVStream* stream_ = nullptr;
};

}  // namespace
}  // namespace atelier

extern "C" atelier::VideoEncoder* atelier_new_film(const std::filesystem::path& path,
                                                   const std::filesystem::path& written, int width,
                                                   int height,
                                                   const atelier::VideoOptions& options) {
  return new atelier::Encoder(path, written, width, height, options);
}
