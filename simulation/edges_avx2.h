#pragma once

#include "simulation/edge_math.h"

namespace atelier {

/// Whether this processor runs AVX2 and fused multiply-add.
bool avx2_available();

/// Projects edges `begin` to `end` - 1, which share no particle, eight at a time: project_edge in
/// another order of operations, so results agree to rounding. `x` and `start` have room for one
/// more particle at `spare`, which is overwritten. Only where avx2_available().
void project_edges_avx2(const Places* edges, const EdgeRule<float>* rules,
                        EdgeMultipliers<float>* lambda, int begin, int end, Vec4<float>* x,
                        Vec4<float>* start, int spare, const SubstepScale<float>& scale);

}  // namespace atelier
