// A body and a garment that move, as large as real ones, for timing the viewer: what
// scripts/viewer-speed looks at.
//
//   view_sequences FOLDER [FRAMES 1000] [BODY 20000] [GARMENT 10000]   vertices

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <numbers>

#include "core/parallel.h"
#include "core/sequence_archive.h"

namespace atelier {
namespace {

/// A tube of `rings` rings that sways, with folds that wander: every vertex moves in every frame.
Mesh tube(Index vertices, double radius, double low, double high, double time) {
  const auto around = static_cast<Index>(std::sqrt(2.0 * static_cast<double>(vertices)));
  const Index rings = vertices / around;
  Mesh mesh;
  mesh.vertices.resize(around * rings, 3);
  mesh.faces.resize(2 * around * (rings - 1), 3);
  for (Index r = 0; r < rings; ++r) {
    const double share = static_cast<double>(r) / static_cast<double>(rings - 1);
    const double height = low + share * (high - low);
    for (Index a = 0; a < around; ++a) {
      const double angle =
          2 * std::numbers::pi * static_cast<double>(a) / static_cast<double>(around);
      const double fold = 0.012 * std::sin(14 * angle + 3 * time + 9 * height) +
                          0.008 * std::sin(23 * angle - 5 * time);
      const double wide = radius * (1 + 0.35 * std::sin(4 * height)) + fold;
      mesh.vertices.row(r * around + a)
          << wide * std::cos(angle) + 0.2 * std::sin(2 * time) * height,
          height + 0.01 * std::sin(7 * time + angle),
          0.7 * wide * std::sin(angle) + 0.1 * std::sin(3 * time + 2 * height);
      if (r + 1 < rings) {
        const auto here = static_cast<int>(r * around + a);
        const auto next = static_cast<int>(r * around + (a + 1) % around);
        const auto up = static_cast<int>(around);
        mesh.faces.row(2 * (r * around + a)) << here, here + up, next;
        mesh.faces.row(2 * (r * around + a) + 1) << next, here + up, next + up;
      }
    }
  }
  return mesh;
}

void write(const std::filesystem::path& folder, int frames, Index vertices, double radius,
           double low, double high) {
  SequenceHeader header;
  header.fps = 30;
  for (int f = 0; f < frames; ++f) {
    header.frame_ids.push_back(f);
  }
  header.shared.faces = tube(vertices, radius, low, high, 0).faces;
  write_sequence_header(folder, header);
  parallel_for(frames, 1, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      write_sequence_frame(folder, header, static_cast<int>(f),
                           tube(vertices, radius, low, high, static_cast<double>(f) / 30));
    }
  });
}

int run(int count, char** arguments) {
  if (count < 2) {
    std::fputs("usage: view_sequences FOLDER [FRAMES] [BODY] [GARMENT]\n", stderr);
    return 2;
  }
  const auto number = [&](int place, int otherwise) {
    return count > place ? std::atoi(arguments[place]) : otherwise;
  };
  const std::filesystem::path folder = arguments[1];
  write(folder / "body", number(2, 1000), number(3, 20000), 0.16, 0, 1.7);
  write(folder / "dress", number(2, 1000), number(4, 10000), 0.22, 0.5, 1.4);
  return 0;
}

}  // namespace
}  // namespace atelier

int main(int count, char** arguments) {
  try {
    return atelier::run(count, arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
