#include "capture/video_times.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

#include <unistd.h>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/regular_file.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

using FileBytes = std::span<const std::byte>;

constexpr std::uint64_t kBoxHead = 8;           // bytes of a box's size and type
constexpr std::uint64_t kLongHead = 16;         // of one whose size has 64 bits
constexpr std::uint64_t kMaxMovie = 256 << 20;  // bytes; a million images of all tables: 32 MB
// Beyond any camera's clock, exact in double.
constexpr std::int64_t kMaxTicks = std::int64_t{1} << 52;

constexpr const char* kAsRecorded =
    "one part at its own speed: ffmpeg -ignore_editlist 1 -i IN -map 0:v:0 -c copy OUT.mp4 keeps "
    "every image as it was recorded, ffmpeg -i IN -c:v libx264 -crf 12 OUT.mp4 what a player shows";

/// Size and kind of a box, as its first bytes say.
struct BoxHead {
  std::uint64_t bytes = 0;   ///< of head and content; what remains where the file says 0
  std::uint64_t header = 0;  ///< of the head
  std::string type;
};

/// @param head   of `left` bytes, or as many as it takes
/// @param left   from the box on
BoxHead box_head(FileBytes head, std::uint64_t left, const std::string& name) {
  ByteReader in(head, name);
  BoxHead box;
  box.bytes = in.big<std::uint32_t>("the size of a box");
  box.type = in.text(4, "the type of a box");
  box.header = kBoxHead;
  if (box.bytes == 1) {
    box.bytes = in.big<std::uint64_t>("the size of a box");
    box.header = kLongHead;
  } else if (box.bytes == 0) {
    box.bytes = left;
  }
  return box;
}

struct VideoBox {
  std::string type;
  FileBytes content;
};

/// The boxes in another one; fewer than eight bytes at the end are filling.
std::vector<VideoBox> boxes_in(FileBytes content, const std::string& name) {
  std::vector<VideoBox> boxes;
  while (content.size() >= kBoxHead) {
    const BoxHead head = box_head(content, content.size(), name);
    if (head.bytes < head.header || head.bytes > content.size()) {
      throw DataError(name, "box '" + head.type + "'", std::to_string(head.bytes) + " bytes",
                      std::to_string(head.header) + " to " + std::to_string(content.size()) +
                          ", the bytes that remain of the box around it");
    }
    const auto whole = static_cast<std::size_t>(head.bytes);
    boxes.push_back({head.type, content.subspan(static_cast<std::size_t>(head.header),
                                                whole - static_cast<std::size_t>(head.header))});
    content = content.subspan(whole);
  }
  return boxes;
}

struct VideoEdit {
  double duration = 0;      ///< of the movie's ticks; 0: to the end
  std::int64_t first = 0;   ///< tick of the media; -1: nothing is shown
  std::uint32_t speed = 0;  ///< 16.16
};

struct VideoTrack {
  bool video = false;
  std::int64_t ticks_per_second = 0;
  std::vector<VideoEdit> edits;
  std::int64_t images = -1;  ///< -1: no table
  FileBytes decoding;        ///< 'stts'
  FileBytes composition;     ///< 'ctts'; empty: as decoding
};

std::int64_t clock_of(FileBytes content, const std::string& name, const char* box) {
  ByteReader in(content, name);
  const bool is_long = in.big<std::uint32_t>("a version") >> 24 == 1;
  in.skip(is_long ? 16 : 8, "times of creation");
  const auto ticks = in.big<std::uint32_t>("ticks a second");
  if (ticks == 0) {
    throw DataError(name, std::string("box '") + box + "'", "no ticks a second", "1 and more");
  }
  return ticks;
}

std::vector<VideoEdit> edits_of(FileBytes content, const std::string& name) {
  ByteReader in(content, name);
  const bool is_long = in.big<std::uint32_t>("a version") >> 24 == 1;
  const std::size_t count =
      in.paid(in.big<std::uint32_t>("a count of edits"), is_long ? 20 : 12, "an edit list");
  std::vector<VideoEdit> edits(count);
  for (VideoEdit& edit : edits) {
    edit.duration = is_long ? static_cast<double>(in.big<std::uint64_t>("an edit's duration"))
                            : in.big<std::uint32_t>("an edit's duration");
    edit.first = is_long ? in.big<std::int64_t>("an edit's first tick")
                         : in.big<std::int32_t>("an edit's first tick");
    edit.speed = in.big<std::uint32_t>("an edit's speed");
    if (edit.first < -1 || edit.first > kMaxTicks) {
      in.fail("an edit from tick " + std::to_string(edit.first), "one of the media");
    }
  }
  return edits;
}

std::int64_t image_count(FileBytes content, const std::string& name, const Limits& limits) {
  ByteReader in(content, name);
  in.skip(8, "sizes of images");
  const std::int64_t count = in.big<std::uint32_t>("a count of images");
  if (count < 1 || count > limits.frames) {
    throw DataError(name, "", "no number of frames that is possible: " + std::to_string(count),
                    "1 to " + std::to_string(limits.frames));
  }
  return count;
}

void add_sample_tables(FileBytes content, const std::string& name, const Limits& limits,
                       VideoTrack& track) {
  for (const VideoBox& box : boxes_in(content, name)) {
    if (box.type == "stts") {
      track.decoding = box.content;
    } else if (box.type == "ctts") {
      track.composition = box.content;
    } else if ((box.type == "stsz" || box.type == "stz2") && track.video) {
      track.images = image_count(box.content, name, limits);
    }
  }
}

void add_media(FileBytes content, const std::string& name, const Limits& limits,
               VideoTrack& track) {
  const std::vector<VideoBox> boxes = boxes_in(content, name);
  for (const VideoBox& box : boxes) {  // first, since only of videos the rest counts
    if (box.type == "hdlr") {
      ByteReader in(box.content, name);
      in.skip(8, "a kind of media");
      track.video = in.text(4, "a kind of media") == "vide";
    }
  }
  if (!track.video) {
    return;
  }
  for (const VideoBox& box : boxes) {
    if (box.type == "mdhd") {
      track.ticks_per_second = clock_of(box.content, name, "mdhd");
    } else if (box.type == "minf") {
      for (const VideoBox& inner : boxes_in(box.content, name)) {
        if (inner.type == "stbl") {
          add_sample_tables(inner.content, name, limits, track);
        }
      }
    }
  }
}

VideoTrack video_track_of(FileBytes content, const std::string& name, const Limits& limits) {
  VideoTrack track;
  for (const VideoBox& box : boxes_in(content, name)) {
    if (box.type == "mdia") {
      add_media(box.content, name, limits, track);
    } else if (box.type == "edts") {
      for (const VideoBox& inner : boxes_in(box.content, name)) {
        if (inner.type == "elst") {
          track.edits = edits_of(inner.content, name);
        }
      }
    }
  }
  return track;
}

/// Ticks of the media at which images are composed, in the order in which they are stored.
std::vector<std::int64_t> composed_at(const VideoTrack& track, const std::string& name) {
  const auto images = static_cast<std::size_t>(track.images);
  std::vector<std::int64_t> at;
  at.reserve(images);
  ByteReader decoding(track.decoding, name);
  decoding.skip(4, "a version");
  std::size_t runs =
      decoding.paid(decoding.big<std::uint32_t>("a count of runs"), 8, "times of decoding");
  std::int64_t now = 0;
  for (; runs > 0 && at.size() < images; --runs) {
    const auto count = decoding.big<std::uint32_t>("a count of images");
    const auto step = decoding.big<std::uint32_t>("ticks an image");
    for (std::uint32_t i = 0; i < count && at.size() < images; ++i) {
      at.push_back(now);
      now += step;
    }
  }
  if (at.size() < images || now > kMaxTicks) {
    throw DataError(name, "box 'stts'",
                    at.size() < images ? "times of " + std::to_string(at.size()) + " images"
                                       : "images after " + std::to_string(now) + " ticks",
                    "times of the " + std::to_string(images) + " images that have a size");
  }
  if (!track.composition.empty()) {
    ByteReader later(track.composition, name);
    later.skip(4, "a version");
    runs = later.paid(later.big<std::uint32_t>("a count of runs"), 8, "times of composition");
    std::size_t image = 0;
    for (; runs > 0 && image < images; --runs) {
      const auto count = later.big<std::uint32_t>("a count of images");
      const auto offset = later.big<std::int32_t>("ticks between decoding and composition");
      for (std::uint32_t i = 0; i < count && image < images; ++i) {
        at[image++] += offset;
      }
    }
  }
  return at;
}

/// The part of the media that is shown, and when.
struct ShownPart {
  std::int64_t start = 0;  ///< ticks of the file's clock
  std::int64_t first = 0;  ///< ticks of the media
  std::int64_t end = kMaxTicks;
};

ShownPart shown_part(const VideoTrack& track, std::int64_t movie_ticks, const std::string& name) {
  const auto in_media = [&](double duration) {
    const double ticks = std::round(duration * static_cast<double>(track.ticks_per_second) /
                                    static_cast<double>(movie_ticks));
    return saturating_cast<std::int64_t>(std::min(ticks, static_cast<double>(kMaxTicks)));
  };
  ShownPart part;
  int parts = 0;
  for (const VideoEdit& edit : track.edits) {
    if (edit.first < 0) {
      part.start = std::min(part.start + (parts == 0 ? in_media(edit.duration) : 0), kMaxTicks);
      continue;
    }
    constexpr std::uint32_t kOwnSpeed = 1 << 16;
    if (++parts > 1 || edit.speed != kOwnSpeed) {
      char speed[40];
      std::snprintf(speed, sizeof speed, "a speed of %.4g", edit.speed / double{kOwnSpeed});
      throw DataError(
          name, "edit list",
          parts > 1 ? "several parts of the recording, one after the other" : std::string(speed),
          kAsRecorded);
    }
    part.first = edit.first;
    if (edit.duration > 0) {
      part.end = edit.first + in_media(edit.duration);
    }
  }
  if (parts == 0 && !track.edits.empty()) {
    throw DataError(name, "edit list", "no part of the recording that is shown", kAsRecorded);
  }
  return part;
}

VideoTimes times_of_track(const VideoTrack& track, std::int64_t movie_ticks,
                          const std::string& name) {
  const ShownPart part = shown_part(track, movie_ticks, name);
  VideoTimes times;
  times.ticks_per_second = track.ticks_per_second;
  for (const std::int64_t at : composed_at(track, name)) {
    if (at >= part.first && at < part.end) {
      times.ticks.push_back(part.start + at - part.first);
    }
  }
  times.hidden = track.images - std::ssize(times.ticks);
  if (times.ticks.empty()) {
    throw DataError(name, "edit list", "no image that is shown", kAsRecorded);
  }
  std::sort(times.ticks.begin(), times.ticks.end());
  return times;
}

std::optional<VideoTimes> times_of_movie(FileBytes movie, const std::string& name,
                                         const Limits& limits) {
  const std::vector<VideoBox> boxes = boxes_in(movie, name);
  if (std::any_of(boxes.begin(), boxes.end(),
                  [](const VideoBox& box) { return box.type == "mvex"; })) {
    throw DataError(name, "", "images in fragments, of which no table says how many there are",
                    "one table: ffmpeg -i IN -map 0:v:0 -c copy OUT.mp4 writes it and changes no "
                    "image");
  }
  std::int64_t movie_ticks = 0;
  std::optional<VideoTrack> video;
  for (const VideoBox& box : boxes) {
    if (box.type == "mvhd") {
      movie_ticks = clock_of(box.content, name, "mvhd");
    } else if (box.type == "trak" && !video) {
      VideoTrack track = video_track_of(box.content, name, limits);
      if (track.video) {
        video = std::move(track);
      }
    }
  }
  if (!video || video->images < 0 || video->decoding.empty() || video->ticks_per_second == 0 ||
      movie_ticks == 0) {
    return std::nullopt;
  }
  return times_of_track(*video, movie_ticks, name);
}

/// Where the content of the box 'moov' is.
struct MoviePlace {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
};

/// @param head_at  bytes at an offset, as many as a head has or as remain
template <class HeadAt>
std::optional<MoviePlace> movie_place(std::uint64_t size, const std::string& name,
                                      const HeadAt& head_at) {
  std::uint64_t at = 0;
  while (size - at >= kBoxHead) {
    const BoxHead head = box_head(head_at(at), size - at, name);
    const bool movie = head.type == "moov";
    if (head.bytes < head.header || head.bytes > size - at || (movie && head.bytes > kMaxMovie)) {
      if (!movie) {
        return std::nullopt;  // another kind of file, or one that is cut off in its images
      }
      throw DataError(
          name, "box 'moov'", std::to_string(head.bytes) + " bytes",
          std::to_string(head.header) + " to " + std::to_string(std::min(size - at, kMaxMovie)));
    }
    if (movie) {
      return MoviePlace{at + head.header, head.bytes - head.header};
    }
    at += head.bytes;
  }
  return std::nullopt;
}

}  // namespace

std::optional<VideoTimes> read_video_times(FileBytes bytes, const std::string& name,
                                           const Limits& limits) {
  const auto place = movie_place(bytes.size(), name, [&](std::uint64_t at) {
    return bytes.subspan(static_cast<std::size_t>(at));
  });
  return place ? times_of_movie(bytes.subspan(static_cast<std::size_t>(place->offset),
                                              static_cast<std::size_t>(place->bytes)),
                                name, limits)
               : std::nullopt;
}

std::optional<VideoTimes> read_video_times(const std::filesystem::path& path,
                                           const Limits& limits) {
  const RegularFile file(path);
  const auto read_at = [&](std::span<std::byte> target, std::uint64_t at) {
    std::size_t got = 0;
    while (got < target.size()) {
      const ssize_t more = pread(file.descriptor(), target.data() + got, target.size() - got,
                                 static_cast<off_t>(at + got));
      if (more <= 0) {
        throw EnvironmentError(path.string(), "cannot be read");
      }
      got += static_cast<std::size_t>(more);
    }
  };
  const auto size = static_cast<std::uint64_t>(file.size());
  std::array<std::byte, kLongHead> head{};
  const auto place = movie_place(size, path.string(), [&](std::uint64_t at) {
    const auto count = static_cast<std::size_t>(std::min(kLongHead, size - at));
    read_at(std::span(head).first(count), at);
    return FileBytes(head).first(count);
  });
  if (!place) {
    return std::nullopt;
  }
  std::vector<std::byte> movie(static_cast<std::size_t>(place->bytes));
  read_at(movie, place->offset);
  return times_of_movie(movie, path.string(), limits);
}

VideoPace video_pace(const VideoTimes& times) {
  VideoPace pace;
  const auto ticks_per_second = static_cast<double>(times.ticks_per_second);
  pace.start = static_cast<double>(times.ticks.front()) / ticks_per_second;
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < times.ticks.size(); ++i) {
    steps.push_back(times.ticks[i] - times.ticks[i - 1]);
  }
  if (steps.empty()) {
    return pace;
  }
  std::vector<std::int64_t> sorted = steps;
  const auto middle = sorted.begin() + std::ssize(sorted) / 2;
  std::nth_element(sorted.begin(), middle, sorted.end());
  const auto usual = static_cast<double>(*middle);
  std::int64_t intervals = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const auto step = static_cast<double>(steps[i]);
    const double whole = std::max(1.0, std::round(step / usual));
    constexpr double kOff = 0.25;  // of an interval
    if (!(usual > 0 && std::abs(step - whole * usual) <= kOff * usual)) {
      pace.uneven = static_cast<Index>(i) + 1;
      pace.missing = 0;
      pace.first_gap = -1;
      intervals = std::ssize(steps);
      break;
    }
    const auto passed = saturating_cast<std::int64_t>(whole);
    if (passed > 1 && pace.first_gap < 0) {
      pace.first_gap = static_cast<Index>(i) + 1;
    }
    intervals += passed;
    pace.missing += static_cast<Index>(passed - 1);
  }
  const std::int64_t length = times.ticks.back() - times.ticks.front();
  pace.fps = length > 0
                 ? static_cast<double>(intervals) * ticks_per_second / static_cast<double>(length)
                 : 0;
  return pace;
}

std::vector<Finding> video_findings(const VideoTimes& times, const std::string& place) {
  const VideoPace pace = video_pace(times);
  const Index image = std::max(pace.uneven, pace.first_gap);
  if (image < 0) {
    return {};
  }
  const auto at = static_cast<std::size_t>(image);
  char what[200];
  std::snprintf(what, sizeof what,
                "image %td comes %.4g s after the one before it, at %.4g a second", image,
                static_cast<double>(times.ticks[at] - times.ticks[at - 1]) /
                    static_cast<double>(times.ticks_per_second),
                pace.fps);
  char advice[200];
  std::snprintf(
      advice, sizeof advice,
      "before anything is detected in it, write it at one rate: ffmpeg -i IN -fps_mode cfr "
      "-r %.6g -c:v libx264 -crf 12 OUT.mp4",
      pace.fps);
  if (pace.uneven >= 0) {
    return {{Severity::Warning, "video-uneven", place,
             std::string("its images come at uneven times: ") + what +
                 "; frames are numbered in their order",
             advice}};
  }
  return {{Severity::Warning, "video-frames-missing", place,
           std::to_string(pace.missing) + " images are missing: " + what +
               "; frames from there on are numbered too low",
           advice}};
}

}  // namespace atelier
