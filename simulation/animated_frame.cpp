#include "simulation/animated_frame.h"

#include <cstdio>

#include "core/error.h"
#include "simulation/cloth_state_archive.h"

namespace atelier {
namespace {

constexpr const char* kAnimatedSchema = "atelier.animated_frame";

}  // namespace

Archive archive_of(const AnimatedFrame& frame) {
  Archive archive;
  archive.schema = kAnimatedSchema;
  put_cloth_state(archive, "step", frame.state);
  for (const auto& [name, member] : kFrameFigures) {
    archive.numbers[name] = frame.figures.*member;
  }
  return archive;
}

AnimatedFrame animated_frame_of(const Archive& archive, Index vertices, const std::string& file) {
  AnimatedFrame frame;
  frame.state = cloth_state_at(archive, "step", vertices, file);
  for (const auto& [name, member] : kFrameFigures) {
    const auto found = archive.numbers.find(name);
    if (found == archive.numbers.end()) {
      throw DataError(file, name, "no such number", "a figure of the frame");
    }
    if (!(found->second >= 0)) {
      std::array<char, 32> text{};
      std::snprintf(text.data(), text.size(), "%g", found->second);
      throw DataError(file, name, text.data(), "a number of at least 0");
    }
    frame.figures.*member = found->second;
  }
  return frame;
}

AnimatedFrame read_animated_frame(const std::filesystem::path& file, Index vertices) {
  return animated_frame_of(read_archive(file, kAnimatedSchema, 1), vertices, file.string());
}

}  // namespace atelier
