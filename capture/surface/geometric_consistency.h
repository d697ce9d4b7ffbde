#pragma once

#include <vector>

#include "capture/surface/instant.h"
#include "core/finding.h"
#include "core/mesh.h"

namespace atelier {

/// The views of an instant, prepared for stereo and fusion.
struct StraightInstant {
  std::vector<Camera> cameras;    ///< without distortion
  std::vector<Image> images;      ///< [H,W,3] of each, less its gain
  std::vector<ByteImage> masks;   ///< of each; empty: not known
  std::vector<ByteImage> labels;  ///< of each; empty: none
  VisualHull hull;
  std::vector<Finding> findings;  ///< what was wrong with views, by their cameras' names
};

/// Distortion and gain taken out, hull from the masks. Defects of a view are reported and do no
/// harm: it is left out if it is black ("view-black") or its mask is empty ("view-mask-empty"); a
/// mask that is inverted is turned round ("view-mask-inverted"), one that contradicts the others is
/// not used ("view-mask-off"). Throws DataError if fewer than two views are left; LogicError for
/// sizes that differ.
StraightInstant straight_instant(std::vector<InstantView> views,
                                 const ReconstructOptions& options = {});

/// The views whose stereo is computed for the wanted ones: these and those that they are compared
/// with.
std::vector<std::size_t> computed_views(const StraightInstant& instant,
                                        const ReconstructOptions& options,
                                        const std::vector<std::size_t>& wanted);

/// Stereo of the views within the hull. With `wanted`, only of their computed_views, so that
/// machines can share an instant; the other maps stay without pixels. A view whose sources are
/// computed without theirs differs a little from one of a whole run.
std::vector<DepthMap> instant_depths(const StraightInstant& instant,
                                     const ReconstructOptions& options = {},
                                     Device device = Device::Cpu,
                                     const std::vector<std::size_t>& wanted = {});

/// Points on which the views of an instant agree.
struct ConsistentPoints {
  Mesh points;                    ///< oriented and coloured, without outliers
  std::vector<DepthMap> maps;     ///< those of views that others contradict are emptied
  std::vector<Finding> findings;  ///< "view-disagrees": the depth of a view that others do not
                                  ///< confirm, as of one that is calibrated wrongly, is left out
};

/// Fusion of the views' maps. Throws DataError if they agree on fewer than 100 points.
ConsistentPoints consistent_points(const StraightInstant& instant, std::vector<DepthMap> maps,
                                   const ReconstructOptions& options = {});

}  // namespace atelier
