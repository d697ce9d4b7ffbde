#pragma once

#include <vector>

#include "bodymodel/body_model.h"

namespace atelier {

/// The vertices that a joint or one below it moves most: of an ankle the foot.
std::vector<Index> vertices_moved_below(const BodyModel& model, int joint);

}  // namespace atelier
