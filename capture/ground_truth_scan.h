#pragma once

#include "core/io/ground_truth_archive.h"
#include "core/mesh.h"

namespace atelier {

/// The scan that a perfect reconstruction of a synthetic frame would be: every face of the true
/// surfaces (body, hair, shoes, garments) whose corners two cameras see, labelled. Layers, of which
/// the ground truth does not say who sees them, are whole.
Mesh ground_truth_scan(const GroundTruth& truth, const GroundTruthFrame& frame);

}  // namespace atelier
