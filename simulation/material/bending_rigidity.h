#pragma once

#include <vector>

#include "simulation/cloth/cloth.h"

namespace atelier {

/// How stiff the hinges of a mesh are against the plate that they stand for, by the direction in
/// which the cloth is bent.
struct BendingRigidity {
  /// [N] rigidity over the material's for bending along direction i 180 / N degrees from the
  /// weft (x of the pattern). 1: as the plate.
  std::vector<double> by_direction;
  double mean = 0;     ///< over directions
  double lowest = 0;   ///< of all directions
  double highest = 0;  ///< of all directions
};

/// Bends the mesh onto a cylinder along each of `directions` directions and compares the energy of
/// its hinges with that of a plate of the material's bending stiffness. Equilateral triangles give
/// 1 in every direction; a grid with one diagonal between 1 and 3, so that cloth on it folds along
/// its diagonals: remesh, or take a mesh without a direction of its own. An upper bound: vertices
/// of a simulation may leave the cylinder and so find a little less energy. Only faces with three
/// neighbours count, for an edge of the border bends no hinge.
///
/// Directions are those of the pattern where the garment has one; else they are measured in each
/// face from the horizontal (from x where the face is horizontal). Throws DataError for a garment
/// that make_cloth refuses, LogicError unless `directions` is in [1, 360]. Cost: O(F directions).
BendingRigidity bending_rigidity(const Garment& garment, int directions = 36,
                                 const ClothOptions& options = {});

}  // namespace atelier
