#include "pipeline/pictures/named_views.h"

#include <cmath>
#include <numbers>

#include "core/saturating_cast.h"

namespace atelier {
namespace {

std::string place_of(const Eigen::Vector3d& from) {
  constexpr long kQuarter = 90;
  constexpr std::array kAxes = {"from +Z", "from +X", "from -Z", "from -X"};
  const double degrees = std::atan2(from.x(), from.z()) * 180 / std::numbers::pi;
  const long whole = (saturating_cast<long>(std::round(degrees)) + 4 * kQuarter) % (4 * kQuarter);
  return whole % kQuarter == 0 ? kAxes[static_cast<std::size_t>(whole / kQuarter)]
                               : "from " + std::to_string(whole) + " deg";
}

}  // namespace

std::array<NamedView, 2> two_sides(const Eigen::Vector3d& facing, const Eigen::Vector3d& across) {
  if (!facing.isZero()) {
    return {{{turned(kFront, facing), "front"}, {turned(kBack, facing), "back"}}};
  }
  return {{{turned(kFront, across), place_of(across)}, {turned(kBack, across), place_of(-across)}}};
}

}  // namespace atelier
