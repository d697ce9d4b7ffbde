#pragma once

#include "bodymodel/body_model.h"
#include "registration/sewing/parametric_patterns.h"

namespace atelier {

/// The data of a body for a pattern maker: its measures and landmarks. Throws as measure_body does.
TailorMeasures tailor_measures(const BodyModel& body);

}  // namespace atelier
