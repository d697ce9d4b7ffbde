#pragma once

namespace atelier {

/// One scene of a batch: factors on the cloth's material.
struct ClothVariation {
  double stretch = 1;    ///< times the stiffness of every spring and strain, above 0
  double bending = 1;    ///< times the stiffness of every hinge, above 0
  double friction = -1;  ///< against the body; below 0: as in the options
};

}  // namespace atelier
