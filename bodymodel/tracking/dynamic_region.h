#pragma once

#include <vector>

#include "bodymodel/tracking/scan_match.h"

namespace atelier {

struct DynamicOptions {
  double swing = 0.007;  ///< m, spread over time of the gap between clothing and body above which
                         ///< clothing counts as dynamic, [1e-3, 1]
  double gap = 0.03;     ///< m, median gap above which it does anyway, [1e-3, 1]
  int min_frames = 3;    ///< that must see a patch before its swing counts, [2, 1000]
};
OptionTable describe(DynamicOptions& options);

/// How far clothing lies off each part of the body: [V] sums over one frame.
struct ClothGaps {
  Eigen::VectorXd sum;    ///< metres times points
  Eigen::VectorXd count;  ///< points
};

/// Gaps of a frame: every point of clothing within `reach` metres, by its nearest body vertex. Gaps
/// are distances along the body's normal. O(N log F).
ClothGaps cloth_gaps(const FittedPerson& person, const BodySurface& surface, const ScanPoints& scan,
                     double reach = 0.4);

/// The region of the body over which clothing is highly dynamic (a swinging skirt, the bottom of a
/// dress): found from how the gap varies over time (our choice). Vertices are gathered into patches
/// of about 5 cm on the rest pose, patches take the spread and the median of their gaps over the
/// frames, the mask is smoothed by the majority of neighbours within 10 cm. [V] 1 inside. Empty
/// where no frame has clothing.
std::vector<char> dynamic_region(const FittedPerson& person, const std::vector<ClothGaps>& frames,
                                 const DynamicOptions& options = {});

}  // namespace atelier
