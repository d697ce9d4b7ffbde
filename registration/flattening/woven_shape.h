#pragma once

#include "registration/flattening/flatten_panel.h"

namespace atelier {

/// How woven cloth takes curvature: by shear, which is nearly free, rather than along its threads.
struct WovenShapeOptions {
  int iterations = 30;       ///< at most
  double still = 1e-4;       ///< m by which the last step moves a vertex at most
  double even = 0.025;       ///< stretch along a thread beyond which it stiffens, which spreads it
  double length_weight = 0;  ///< of `lengths`
};

/// The flat shape of a panel of woven cloth, warp along +y: from `start`, a shape that turns no
/// face over, the threads of every face get their length on the surface as far as they can, while
/// faces may shear. [V,2] m.
///
/// Alternates the panel's turn to its grain (grain_direction.h), each face's closest rotation and
/// the directions of its threads with a sparse linear solve (Pietroni et al., "Computational
/// pattern making from 3D garment models", 2022, section 5): two equations of thread lengths a face
/// (weight 50, more of what stretches beyond `even`), four of the rotation (weight 1). `lengths`
/// are edges in their present direction. From the third on steps are halved, since threads that
/// stiffen overshoot, and further until no face has less than 0.3 of its area. Ends when a step
/// moves no vertex by more than `still`. Throws LogicError for a start of other size.
Points2 woven_shape(const Points& vertices, const Triangles& faces, const Points2& start,
                    const WovenShapeOptions& options = {},
                    const std::vector<EdgeLength>& lengths = {});

/// The larger of |stretch - 1| along weft (x) and warp (y), of a face's deformation from flat to
/// curved.
double thread_strain(const Eigen::Matrix<double, 3, 2>& deformation);

}  // namespace atelier
