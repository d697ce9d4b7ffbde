#pragma once

#include "bodymodel/body_model.h"
#include "bodymodel/skinning.h"
#include "core/pose.h"

namespace atelier {

/// Rest vertices [V,3] that linear blend skinning without correctives takes to these posed ones:
/// what is off the model in a pose, as displacements before the skin moves. A vertex whose blended
/// transform is nearly flat (determinant below 0.05: joints that fold onto themselves) keeps its
/// rest place. Throws LogicError on sizes that do not agree. O(V K).
Points unposed_vertices(const BodyModel& model, const ShapedBody& body, const Pose& pose,
                        const Points& posed);

}  // namespace atelier
