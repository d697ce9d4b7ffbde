#pragma once

#include <vector>

#include "capture/surface/instant.h"
#include "core/finding.h"
#include "core/mesh.h"

namespace atelier {

/// What the views of an instant agree on, and how it came about.
struct AgreedPoints {
  Mesh points;                    ///< oriented and coloured, without outliers
  std::vector<DepthMap> maps;     ///< of each view that took part, undistorted
  std::vector<LabelView> labels;  ///< of those that have labels, undistorted
  VisualHull hull;
  std::vector<Finding> findings;  ///< what was wrong with views, by their cameras' names
};

/// Hull from the masks, stereo within it, fusion. What is wrong with a view is said and does no
/// harm: it is left out if it is black ("view-black") or its mask is empty ("view-mask-empty"); a
/// mask that is inverted is turned round ("view-mask-inverted"), one that contradicts the others is
/// not used ("view-mask-off"); the depth of a view that others do not confirm, as of one that is
/// calibrated wrongly, is left out ("view-disagrees"). `equalize` is not looked at. Throws
/// DataError if fewer than two views are left or the views agree on fewer than 100 points;
/// LogicError for sizes that differ.
AgreedPoints agreed_points(std::vector<InstantView> views, const ReconstructOptions& options = {},
                           Device device = Device::Cpu);

}  // namespace atelier
