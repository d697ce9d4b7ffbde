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

/// Light transfer [V,2*9] of the outside and, behind it, of the inside of a surface at its
/// vertices: from where light reaches each side. It is the cosine-weighted visibility, 1 in
/// directions from which nothing of `tree` is met, projected on real spherical harmonics of degree
/// 0 to 2 in the world (m from -l to l), and divided by what degree 0 of an open side has:
///
///   (1 / pi) integral of visible(w) max(0, cos) Y_lm(w) / Y_00 dw
///
/// The first number of each side is its ambient visibility, the cosine-weighted share of the
/// hemisphere over the normal that is open, in [0,1]; under nothing degrees 1 and 2 are 2/3 and 1/4
/// of Y_lm(normal) / Y_00 (Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance
/// Environment Maps", SIGGRAPH 2001). The light that a point receives from a distant static light,
/// part of which is occluded, is linear in these numbers if the light is smooth (Sloan, Kautz,
/// Snyder, "Precomputed Radiance Transfer", SIGGRAPH 2002). Cloth is seen from both sides, and the
/// inside of a skirt is darker than its outside.
///
/// `strata`^2 rays a side, one in each cell of a grid over the square that is mapped to the
/// cosine-weighted disk (Malley's method). The place within a cell is random by vertex and cell
/// alone (Philox): the same in every frame, so that what noise there is does not flicker, and on
/// any number of threads. Throws LogicError for options out of range.
TransferRows light_transfer(const SurfaceFrame& frame, const TriangleTree& tree,
                            const OcclusionOptions& options = {}, Device device = Device::Cpu);

}  // namespace atelier
