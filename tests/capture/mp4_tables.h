#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace atelier::fixtures {

/// Tables of one video track, written after ISO 14496-12 and not after any library.
struct Mp4Tables {
  struct Edit {
    std::uint32_t duration = 0;  ///< of the movie's ticks
    std::int32_t first = 0;      ///< tick of the media; -1: nothing is shown
    std::uint32_t speed = 0x10000;
  };
  std::uint32_t movie_ticks = 1000;
  std::uint32_t ticks = 12'800;
  std::uint32_t images = 10;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> steps = {{10, 512}};  ///< of decoding
  std::vector<std::pair<std::uint32_t, std::int32_t>> offsets = {};          ///< of composition
  std::vector<Edit> edits = {};
  bool fragments = false;
  bool sound_first = false;  ///< a track of another kind before it
};

inline std::string big32(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16),
          static_cast<char>(value >> 8), static_cast<char>(value)};
}

inline std::string mp4_box(const std::string& type, const std::string& content) {
  return big32(static_cast<std::uint32_t>(content.size() + 8)) + type + content;
}

/// A file without images: what a reader of times needs.
inline std::string mp4_tables(const Mp4Tables& tables) {
  const std::string version = big32(0);
  const auto clock = [&](const char* type, std::uint32_t ticks) {
    return mp4_box(type, version + big32(0) + big32(0) + big32(ticks) + big32(0));
  };
  std::string steps = version + big32(static_cast<std::uint32_t>(tables.steps.size()));
  for (const auto& [count, step] : tables.steps) {
    steps += big32(count) + big32(step);
  }
  std::string offsets = version + big32(static_cast<std::uint32_t>(tables.offsets.size()));
  for (const auto& [count, offset] : tables.offsets) {
    offsets += big32(count) + big32(static_cast<std::uint32_t>(offset));
  }
  std::string edits = version + big32(static_cast<std::uint32_t>(tables.edits.size()));
  for (const Mp4Tables::Edit& edit : tables.edits) {
    edits +=
        big32(edit.duration) + big32(static_cast<std::uint32_t>(edit.first)) + big32(edit.speed);
  }
  const auto handler = [&](const char* kind) {
    return mp4_box("hdlr", version + big32(0) + kind + std::string(13, '\0'));
  };
  const std::string samples = mp4_box("stts", steps) +
                              (tables.offsets.empty() ? "" : mp4_box("ctts", offsets)) +
                              mp4_box("stsz", version + big32(100) + big32(tables.images));
  const std::string media = mp4_box("mdia", clock("mdhd", tables.ticks) + handler("vide") +
                                                mp4_box("minf", mp4_box("stbl", samples)));
  const std::string list = tables.edits.empty() ? "" : mp4_box("edts", mp4_box("elst", edits));
  const std::string sound = mp4_box(
      "trak",
      mp4_box("edts", mp4_box("elst", version + big32(1) + big32(40) + big32(7) + big32(0x10000))) +
          mp4_box("mdia", clock("mdhd", 48'000) + handler("soun")));
  return mp4_box("ftyp", "isom" + big32(512) + "isom") +
         mp4_box("moov", clock("mvhd", tables.movie_ticks) + (tables.sound_first ? sound : "") +
                             mp4_box("trak", list + media) +
                             (tables.fragments ? mp4_box("mvex", "") : ""));
}

}  // namespace atelier::fixtures
