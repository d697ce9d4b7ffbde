#pragma once

#include "simulation/xpbd/edge_math.h"

namespace atelier {

/// Whether this processor runs AVX2 and fused multiply-add.
bool avx2_available();

/// Edges `begin` to `end` - 1, which share no particle.
struct EdgeRun {
  const Places* edges;
  const EdgeRule<float>* rules;
  EdgeMultipliers<float>* lambda;
  int begin, end;
};

/// A patch's particles now and at the start of the substep, with room for one more at `spare`,
/// which is overwritten.
struct PatchParticles {
  Vec4<float>* x;
  Vec4<float>* start;
  int spare;
};

/// Projects edges eight at a time: project_edge in another order of operations, so results agree to
/// rounding. Only where avx2_available().
void project_edges_avx2(const EdgeRun& run, const PatchParticles& particles,
                        const SubstepScale<float>& scale);

}  // namespace atelier
