#pragma once

#include <cstdint>

namespace atelier {

/// Diagnostics of one simulated frame.
struct FrameReport {
  std::int64_t frame = 0;  ///< frames done, this one included
  double strain_p50 = 0;   ///< median of |length / rest - 1| over the mesh edges
  double strain_p95 = 0;
  double strain_max = 0;
  double spring_residual = 0;  ///< root mean square of C + a' lambda over springs [m]
  double hinge_residual = 0;   ///< the same over hinges [rad]
  /// The same over warp, weft and shear of strain triangles, without those of no stiffness. No
  /// unit: stretch is relative, shear the cosine of the angle between the yarns. -1: the cloth has
  /// none, or the frame was written before this was measured.
  double strain_residual = -1;
  double kinetic_energy = 0;  ///< J
  double elastic_energy = 0;  ///< J
  int body_contacts = 0;      ///< vertices that touched the body in the last substep
  /// Free vertices inside the body after the frame, by the nearest surface within the contact
  /// reach: in every frame; deeper vertices are not among them (`inside` counts all).
  int penetrating = 0;
  double penetration_depth = 0;  ///< m, the deepest of them
  int self_contacts = 0;  ///< pairs of cloth primitives that pushed each other in the last substep
  int self_candidates = 0;  ///< pairs that were watched during the frame
  int self_searches = 0;    ///< how often all pairs of cloth were looked for in the frame
  int self_renewals = 0;    ///< and those of particles that left their flights
  double device_ms = 0;     ///< CUDA: duration of the frame on the device
  // Exact counts, every `intersection_interval` frames; -1: not counted, or no body.
  int crossings = -1;       ///< edge-triangle crossings of the cloth with itself
  int body_crossings = -1;  ///< edge-triangle crossings of cloth and body
  /// Vertices inside the body by its winding number, however deep, outside of where it overlaps
  /// itself (core/depths_inside.h).
  int inside = -1;
  double inside_depth = -1;  ///< m, the deepest of them; 0: none
  /// Least distance of cloth and body, and of cloth and cloth (simulation/contact/min_gap.h),
  /// over what contact keeps there; 1: it is kept everywhere; 0: something is through or inside. -1
  /// also where no thickness is kept, or the frame was written before this was measured.
  double body_gap = -1;
  double self_gap = -1;
};

}  // namespace atelier
