#pragma once

#include <vector>

#include "capture/stereo/stereo.h"
#include "capture/stereo/stereo_math.h"

namespace atelier {

/// One resolution of a view. Internal to stereo.
struct StereoLevel {
  Camera camera;
  Image image, near_depth, far_depth;
};

/// Each view and its halves, finest first.
std::vector<std::vector<StereoLevel>> stereo_levels(const std::vector<StereoView>& views,
                                                    int levels);

/// A problem of the level's numbers; its pointers are null.
StereoProblem stereo_problem(const StereoLevel& reference, const StereoOptions& options,
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

/// What the beliefs of a view say, as a map.
DepthMap depth_map_of(const Camera& camera, const std::vector<StereoPlane>& planes,
                      const std::vector<float>& costs);

/// The twins: planes and costs of every view on the finest level.
struct StereoResult {
  std::vector<std::vector<StereoPlane>> planes;
  std::vector<std::vector<float>> costs;
};
StereoResult stereo_cpu(const std::vector<StereoView>& views, const StereoOptions& options);
StereoResult stereo_cuda(const std::vector<StereoView>& views, const StereoOptions& options);

}  // namespace atelier
