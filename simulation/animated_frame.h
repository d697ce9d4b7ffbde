#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <utility>

#include "core/archive.h"
#include "simulation/cloth/cloth_state.h"

namespace atelier {

/// Diagnostics of one frame of an animation.
struct FrameFigures {
  double strain_p99 = 0;  ///< of the edges, share of their rest length
  double inside = 0;      ///< vertices inside the body
  double depth = 0;       ///< m, of the deepest of them
  double crossings = 0;   ///< of the cloth with itself
};

inline constexpr std::array<std::pair<const char*, double FrameFigures::*>, 4> kFrameFigures = {
    {{"strain_p99", &FrameFigures::strain_p99},
     {"inside", &FrameFigures::inside},
     {"depth", &FrameFigures::depth},
     {"crossings", &FrameFigures::crossings}}};

/// A frame's cloth, as files keep it: schema "atelier.animated_frame", version 1
/// (docs/reference/formats.md).
struct AnimatedFrame {
  ClothState state;
  FrameFigures figures;
};

/// As an archive, and back. Throws DataError for what cloth_state_at refuses, such as another
/// cloth, and for figures that are missing or below 0.
Archive archive_of(const AnimatedFrame& frame);
AnimatedFrame animated_frame_of(const Archive& archive, Index vertices,
                                const std::string& file = "");

AnimatedFrame read_animated_frame(const std::filesystem::path& file, Index vertices);

}  // namespace atelier
