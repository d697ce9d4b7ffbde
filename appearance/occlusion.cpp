#include "appearance/occlusion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"

namespace atelier {

OptionTable describe(OcclusionOptions& options) {
  OptionTable table;
  table.add("strata", options.strata, 1, 32, "", "Its square is the number of rays a vertex");
  table.add("reach", options.reach, 1e-6, 100, "m", "What is farther away does not occlude");
  table.add("offset", options.offset, 0, 0.1, "m", "From the surface, where rays start");
  return table;
}

Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor> ambient_visibility(
    const SurfaceFrame& frame, const TriangleTree& tree, const OcclusionOptions& options,
    Device device) {
  ATELIER_CHECK(options.strata >= 1 && options.strata <= 32 && options.reach > 0 &&
                    options.reach <= 100 && options.offset >= 0 && options.offset <= 0.1,
                "options of the occlusion are out of range");
  const int cells = options.strata * options.strata;
  const Index count = frame.position.rows();
  Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor> visibility(count, 2);
  visibility.setOnes();
  constexpr Index kVerticesAtOnce = 4096;  // bounds the memory of rays
  constexpr Index kGrain = 64;
  constexpr std::uint64_t kSeed = 0x0cc1;
  constexpr double kUnit = 1.0 / 4294967296.0;
  std::vector<Ray> rays;
  for (Index begin = 0; begin < count; begin += kVerticesAtOnce) {
    const Index end = std::min(count, begin + kVerticesAtOnce);
    rays.resize(static_cast<std::size_t>(2 * (end - begin) * cells));
    parallel_for(end - begin, kGrain, [&](Index first, Index last) {
      for (Index i = first; i < last; ++i) {
        const Eigen::Vector3d outward = frame.normal.row(begin + i).cast<double>().transpose();
        const Eigen::Vector3d unit =
            outward.norm() > 0 ? outward.normalized() : Eigen::Vector3d::UnitY();
        const Eigen::Vector3d position = frame.position.row(begin + i).cast<double>().transpose();
        const Eigen::Vector3d tangent = unit.unitOrthogonal();
        const Eigen::Vector3d bitangent = unit.cross(tangent);
        for (int side = 0; side < 2; ++side) {
          const Eigen::Vector3d normal = side == 0 ? unit : Eigen::Vector3d(-unit);
          for (int cell = 0; cell < cells; ++cell) {
            const RandomWords words =
                random_words(kSeed, static_cast<std::uint64_t>(begin + i), cell);
            const double a = (cell % options.strata + words.word[0] * kUnit) / options.strata;
            const double b = (cell / options.strata + words.word[1] * kUnit) / options.strata;
            const double radius = std::sqrt(a);
            const double angle = 2 * std::numbers::pi * b;
            Ray& ray = rays[static_cast<std::size_t>((2 * i + side) * cells + cell)];
            ray.origin = position + options.offset * normal;
            ray.direction = radius * std::cos(angle) * tangent +
                            radius * std::sin(angle) * bitangent +
                            std::sqrt(std::max(0.0, 1 - a)) * normal;
            ray.t_max = options.reach;
          }
        }
      }
    });
    const std::vector<char> hits = any_hits(tree, rays, device);
    for (Index i = 0; i < 2 * (end - begin); ++i) {
      const auto first = hits.begin() + i * cells;
      visibility(begin + i / 2, i % 2) =
          1.0F -
          static_cast<float>(std::count(first, first + cells, char{1})) / static_cast<float>(cells);
    }
  }
  return visibility;
}

}  // namespace atelier
