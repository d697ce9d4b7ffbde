#pragma once

#include <vector>

#include "core/types.h"
#include "simulation/cloth/cloth_state.h"
#include "simulation/cloth/frame_report.h"

namespace atelier {

/// The part of the model that exact counts of a frame need, for any solver.
struct CountedCloth {
  Triangles faces;            ///< of the cloth
  Triangles body_faces;       ///< no rows: no body
  Points rest_positions;      ///< [V,3] m
  std::vector<int> layer;     ///< [V] or empty
  double thickness = 0;       ///< m kept from the body
  double self_thickness = 0;  ///< m kept between two sheets; 0: no contact of the cloth with itself
};

/// The report with crossings, vertices inside the body and least gaps counted exactly, on the CPU,
/// at the end of a frame (FrameReport says what each is). `control`: of that frame.
FrameReport with_exact_counts(FrameReport report, const CountedCloth& cloth,
                              const Points& positions, const Control& control);

}  // namespace atelier
