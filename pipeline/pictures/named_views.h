#pragma once

#include <array>
#include <string>

#include "core/render/framing.h"

namespace atelier {

/// A view, and what it is called under its image.
struct NamedView {
  View view;
  std::string name;
};

/// The two sides of a subject: "front" and "back" where it is known where it looks; else as they
/// are seen against `across`, each named after where its viewer stands: "from +Z" and "from -Z",
/// "from +X" and "from -X", or by degrees from +Z towards +X, as "from 42 deg".
/// @param facing  where it looks, horizontal; zero: nobody knows
std::array<NamedView, 2> two_sides(const Eigen::Vector3d& facing,
                                   const Eigen::Vector3d& across = Eigen::Vector3d::UnitZ());

}  // namespace atelier
