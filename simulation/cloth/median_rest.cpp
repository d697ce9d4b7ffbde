#include "simulation/cloth/median_rest.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/median.h"

namespace atelier {

void rest_on_median_lengths(Garment& garment, const std::vector<Points>& frames) {
  ATELIER_CHECK(!frames.empty(), "lengths of no frame");
  for (const Points& frame : frames) {
    ATELIER_CHECK(frame.rows() == garment.mesh.vertices.rows(), "a frame of another mesh");
  }
  constexpr double kFlattest = 0.2;   // height over edge, of what is no sliver
  constexpr double kMinWidth = 0.05;  // of a sliver, by its longest edge
  const Triangles& faces = garment.mesh.faces;
  garment.rest.resize(3 * faces.rows(), 2);
  garment.rest_faces.resize(faces.rows(), 3);
  std::vector<double> lengths(frames.size());
  const auto median_length = [&](int a, int b) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      lengths[i] = (frames[i].row(a) - frames[i].row(b)).norm();
    }
    return median(lengths);
  };
  const auto corner = [](double base, double left, double right) -> Eigen::Vector2d {
    const double x = (base * base + left * left - right * right) / (2 * base);
    return {x, std::sqrt(std::max(0.0, left * left - x * x))};
  };
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3i v = faces.row(f);
    double base = median_length(v[0], v[1]);
    Eigen::Vector2d apex = corner(base, median_length(v[0], v[2]), median_length(v[1], v[2]));
    if (!(apex.y() > kFlattest * std::max(base, apex.norm()))) {
      const auto length = [&](int a, int b) {
        return (garment.mesh.vertices.row(v[a]) - garment.mesh.vertices.row(v[b])).norm();
      };
      base = std::max(length(0, 1), 1e-4);  // m; corners may lie on each other
      apex = corner(base, length(0, 2), length(1, 2));
    }
    // One that is a sliver there too is given some width, as no solver takes it otherwise.
    base = std::max(base, kMinWidth * apex.norm());
    apex.y() = std::max(apex.y(), kMinWidth * std::max(base, std::abs(apex.x())));
    const auto first = static_cast<int>(3 * f);
    garment.rest.row(first) << 0, 0;
    garment.rest.row(first + 1) << base, 0;
    garment.rest.row(first + 2) = apex.transpose();
    garment.rest_faces.row(f) << first, first + 1, first + 2;
  }
}

}  // namespace atelier
