#pragma once

#include <cstdint>

#include "core/types.h"
#include "simulation/cloth/cloth.h"

namespace atelier {

/// The part of a simulation that changes from frame to frame. Rows are the cloth's vertices.
/// Numbers of a float solver are exactly representable here, so a state written and read back
/// continues with the same bits.
struct ClothState {
  Points positions;        ///< [V,3] m
  Points velocities;       ///< [V,3] m/s
  std::int64_t frame = 0;  ///< frames done
};

/// The cloth at rest in its template shape.
ClothState rest_state(const Cloth& cloth);

/// The boundary conditions of one frame.
struct Control {
  Eigen::Vector3d gravity{0, -9.81, 0};  ///< m/s2
  Eigen::Vector3d wind{0, 0, 0};         ///< m/s
  Points wind_field;                     ///< [V,3] m/s at each vertex, added to `wind`, or empty
  Points body_start;  ///< [B,3] body vertices at the start of the frame, or empty: no body
  Points body_end;    ///< [B,3] at its end; the body moves linearly between
  Points
      pin_targets;  ///< [V,3] where fixed vertices are at the end of the frame (other rows are
                    ///< not read), or empty: they stay, or move with the body by their attachments
  bool exact_counts = false;  ///< count in this frame, whatever `intersection_interval` says
};

}  // namespace atelier
