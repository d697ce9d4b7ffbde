#pragma once

#include "appearance/surface_frame.h"
#include "core/device.h"
#include "core/options.h"
#include "core/tree.h"

namespace atelier {

struct OcclusionOptions {
  int strata = 8;         ///< rays a vertex and side: its square, 1..32; more for less noise
  double reach = 1.0;     ///< m, what is farther away does not occlude, (0, 100]
  double offset = 0.002;  ///< m from the surface where rays start, so that a vertex does not meet
                          ///< the faces beside it, 0..0.1
};
OptionTable describe(OcclusionOptions& options);

/// Ambient visibility [V,2] of the outside and of the inside of a surface at its vertices, in
/// [0,1]: the cosine-weighted share of the hemisphere over each normal (and over its opposite) from
/// which nothing of `tree` is met. 1: open. Cloth is looked at from both sides, and the inside of a
/// skirt is darker than its outside.
///
/// `strata`^2 rays a side, one in each cell of a grid over the square that is mapped to the
/// cosine-weighted disc (Malley's method). The place within a cell is random by vertex and cell
/// alone (Philox): the same in every frame, so that what noise there is does not flicker, and on
/// any number of threads. Throws LogicError for options out of range.
Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor> ambient_visibility(
    const SurfaceFrame& frame, const TriangleTree& tree, const OcclusionOptions& options = {},
    Device device = Device::Cpu);

}  // namespace atelier
