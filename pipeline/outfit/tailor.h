#pragma once

#include "bodymodel/body_model.h"
#include "registration/sewing/parametric_patterns.h"

namespace atelier {

/// What a pattern maker needs to know of a body: its measures and where its landmarks stand. Throws
/// as measure_body does.
TailorMeasures tailor_measures(const BodyModel& body);

}  // namespace atelier
