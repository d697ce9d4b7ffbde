#pragma once

#include <cstdint>
#include <string>

#include "core/archive.h"
#include "pipeline/synthesis/synthetic_subject.h"
#include "simulation/cloth/cloth_state.h"

namespace atelier {

/// The state from which the simulation of a synthetic capture continues after a frame.
struct PerformanceState {
  int next_frame = 0;  ///< of the sequence
  std::int64_t step = 0;
  ClothState cloth;
  SoftTissue flesh;
};

/// As an archive of schema "atelier.synthesis.state", version 1 (docs/reference/formats.md), and
/// back to the same bits. Reading throws DataError unless numbers are whole, from 0 to 1e9, and
/// there is a row of finite numbers within 1e9 for each of `cloth_vertices` and `body_vertices`.
Archive archive_of(const PerformanceState& state);
PerformanceState performance_state_of(const Archive& archive, Index cloth_vertices,
                                      Index body_vertices, const std::string& file = "");

}  // namespace atelier
