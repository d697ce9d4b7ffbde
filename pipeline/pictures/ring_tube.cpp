#include "pipeline/pictures/ring_tube.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace atelier {

Mesh ring_tube(const Points& vertices, const std::vector<int>& line, bool closed) {
  constexpr double kRadius = 0.005;  // m
  const auto count = static_cast<Index>(line.size());
  const Index links = closed ? count : count - 1;
  Mesh ring;
  ring.vertices.resize(3 * count, 3);
  ring.faces.resize(6 * links, 3);
  for (Index i = 0; i < count; ++i) {
    const auto at = [&](Index k) -> Eigen::Vector3d {
      const Index row = closed ? (k + count) % count : std::clamp<Index>(k, 0, count - 1);
      return vertices.row(line[static_cast<std::size_t>(row)]).transpose();
    };
    const Eigen::Vector3d along = (at(i + 1) - at(i - 1)).normalized();
    const Eigen::Vector3d u = along.cross(Eigen::Vector3d(0.3, 0.5, 0.81)).normalized();
    const Eigen::Vector3d w = along.cross(u);
    for (int k = 0; k < 3; ++k) {
      const double turn = 2 * std::numbers::pi * k / 3;
      ring.vertices.row(3 * i + k) =
          (at(i) + kRadius * (std::cos(turn) * u + std::sin(turn) * w)).transpose();
      if (i >= links) {
        continue;
      }
      const auto a = static_cast<int>(3 * i + k);
      const auto b = static_cast<int>(3 * i + (k + 1) % 3);
      const auto c = static_cast<int>((3 * (i + 1) + k) % (3 * count));
      const auto d = static_cast<int>((3 * (i + 1) + (k + 1) % 3) % (3 * count));
      ring.faces.row(6 * i + 2 * k) << a, c, b;
      ring.faces.row(6 * i + 2 * k + 1) << b, c, d;
    }
  }
  return ring;
}

}  // namespace atelier
