#include "appearance/occlusion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/random.h"

namespace atelier {

OptionTable describe(OcclusionOptions& options) {
  OptionTable table;
  table.add("strata", options.strata, 1, 32, "", "Its square is the number of rays a texel");
  table.add("reach", options.reach, 1e-6, 100, "m", "What is farther away does not occlude");
  table.add("offset", options.offset, 0, 0.1, "m", "Above the surface, where rays start");
  return table;
}

Eigen::VectorXf ambient_visibility(const GeometryMaps& maps, const TriangleTree& tree,
                                   const OcclusionOptions& options, Device device) {
  ATELIER_CHECK(options.strata >= 1 && options.strata <= 32 && options.reach > 0 &&
                    options.reach <= 100 && options.offset >= 0 && options.offset <= 0.1,
                "options of the occlusion are out of range");
  const int cells = options.strata * options.strata;
  const Index count = maps.position.rows();
  Eigen::VectorXf visibility = Eigen::VectorXf::Ones(count);
  constexpr Index kTexelsAtOnce = 4096;  // bounds the memory of rays
  constexpr std::uint64_t kSeed = 0x0cc1;
  constexpr double kUnit = 1.0 / 4294967296.0;
  std::vector<Ray> rays;
  for (Index begin = 0; begin < count; begin += kTexelsAtOnce) {
    const Index end = std::min(count, begin + kTexelsAtOnce);
    rays.clear();
    for (Index i = begin; i < end; ++i) {
      const Eigen::Vector3d normal = maps.normal.row(i).cast<double>();
      const Eigen::Vector3d tangent = maps.tangent.row(i).cast<double>();
      const Eigen::Vector3d bitangent = normal.cross(tangent);
      for (int cell = 0; cell < cells; ++cell) {
        const RandomWords words = random_words(kSeed, static_cast<std::uint64_t>(i), cell);
        const double a = (cell % options.strata + words.word[0] * kUnit) / options.strata;
        const double b = (cell / options.strata + words.word[1] * kUnit) / options.strata;
        const double radius = std::sqrt(a);
        const double angle = 2 * std::numbers::pi * b;
        Ray ray;
        ray.origin = maps.position.row(i).cast<double>().transpose() + options.offset * normal;
        ray.direction = radius * std::cos(angle) * tangent + radius * std::sin(angle) * bitangent +
                        std::sqrt(std::max(0.0, 1 - a)) * normal;
        ray.t_max = options.reach;
        rays.push_back(ray);
      }
    }
    const std::vector<char> hits = any_hits(tree, rays, device);
    for (Index i = begin; i < end; ++i) {
      const auto first = hits.begin() + (i - begin) * cells;
      visibility[i] = 1.0F - static_cast<float>(std::count(first, first + cells, char{1})) /
                                 static_cast<float>(cells);
    }
  }
  return visibility;
}

}  // namespace atelier
