#pragma once

#include "appearance/geometry_maps.h"
#include "core/device.h"
#include "core/options.h"
#include "core/tree.h"

namespace atelier {

struct OcclusionOptions {
  int strata = 8;         ///< rays a texel: its square, 1..32; more for less noise
  double reach = 1.0;     ///< m, what is farther away does not occlude, (0, 100]
  double offset = 0.002;  ///< m above the surface where rays start, so that a texel does not meet
                          ///< the faces beside it, 0..0.1
};
OptionTable describe(OcclusionOptions& options);

/// Ambient visibility of points on a surface, [T] in [0,1]: the cosine-weighted share of the
/// hemisphere over each normal from which nothing of `tree` is met. 1: open.
///
/// `strata`^2 rays, one in each cell of a grid over the square that is mapped to the
/// cosine-weighted disc (Malley's method). The place within a cell is random by texel and cell
/// alone (Philox): the same in every frame, so that what noise there is does not flicker, and on
/// any number of threads. Throws LogicError for options out of range.
Eigen::VectorXf ambient_visibility(const GeometryMaps& maps, const TriangleTree& tree,
                                   const OcclusionOptions& options = {},
                                   Device device = Device::Cpu);

}  // namespace atelier
