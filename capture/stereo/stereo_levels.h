#pragma once

#include <vector>

#include "capture/stereo/stereo.h"
#include "capture/stereo/stereo_propagation_math.h"

namespace atelier {

/// A view at half its resolution, or half of that. Internal to stereo.
struct StereoLevel {
  Camera camera;
  Image image, near_depth, far_depth;
};

/// The views at every resolution. The finest is the views themselves: a copy of forty large ones
/// takes as long as their stereo on a GPU.
struct StereoLevels {
  const std::vector<StereoView>& views;
  std::vector<std::vector<StereoLevel>> halves;  ///< of each view, finest first
  std::size_t deepest = 0;                       ///< the coarsest level; 0 is the finest

  const Camera& camera(std::size_t view, std::size_t level) const;
  const Image& image(std::size_t view, std::size_t level) const;
  const Image& near_depth(std::size_t view, std::size_t level) const;
  const Image& far_depth(std::size_t view, std::size_t level) const;
};
StereoLevels stereo_levels(const std::vector<StereoView>& views, int levels);

/// A problem of a view's numbers at a level; its pointers are null.
StereoProblem stereo_problem(const Camera& camera, const StereoOptions& options,
                             std::uint64_t seed);

/// A source's numbers; its pointers are null.
StereoSource stereo_source(const Camera& reference, const Camera& source);

/// Each view draws numbers of its own.
inline std::uint64_t stereo_seed(const StereoOptions& options, std::size_t view) {
  return static_cast<std::uint64_t>(options.seed) * 1000003ULL + view;
}

/// Variations go on shrinking from level to level.
inline int refinement_iteration(const StereoOptions& options, int down, int refinement) {
  return options.iterations + down + refinement;
}

/// Whether a sweep is told what the planar prior predicts: once beliefs have settled a little.
inline bool uses_prior(const StereoOptions& options, int refinement) {
  return options.prior_weight > 0 && refinement > 0;
}

/// World's axes of a camera, row by row, as world_normal takes them.
struct WorldFromCamera {
  double row[9];
};
WorldFromCamera world_from_camera(const Camera& camera);

ATELIER_HOST_DEVICE inline Vec3f world_normal(const WorldFromCamera& axes, Vec3f normal) {
  const double x = normal.x;
  const double y = normal.y;
  const double z = normal.z;
  return {static_cast<float>(axes.row[0] * x + axes.row[1] * y + axes.row[2] * z),
          static_cast<float>(axes.row[3] * x + axes.row[4] * y + axes.row[5] * z),
          static_cast<float>(axes.row[6] * x + axes.row[7] * y + axes.row[8] * z)};
}

/// One minus a plane's cost, not below 0.
ATELIER_HOST_DEVICE inline float confidence_of(float cost) {
  return cost < 1 ? 1 - cost : 0;
}

/// A map in which nothing is known.
DepthMap empty_depth_map(const Camera& camera);

/// The twins.
std::vector<DepthMap> stereo_cpu(const std::vector<StereoView>& views,
                                 const StereoOptions& options);
std::vector<DepthMap> stereo_cuda(const std::vector<StereoView>& views,
                                  const StereoOptions& options);

}  // namespace atelier
