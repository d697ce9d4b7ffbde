#pragma once

#include <string>

#include "bodymodel/body_model.h"

namespace atelier {

/// The body with every length times `factor`: what turns a file in centimetres into metres (0.01).
/// Shape parameters in metres keep their surfaces and scale their values; all others keep their
/// values and scale their surfaces. Throws LogicError unless `factor` is positive and finite. O(V
/// S).
BodyModel scaled_body(BodyModel model, double factor);

/// Throws DataError for a template that cannot be in metres with Y up: a person who stands and is
/// not 0.3 to 3 m tall, anything else whose longest side is not 0.02 to 10 m, a person whose head
/// lies along z. Says the factor that would make an adult of it. The limits are our choice. O(V).
void check_body_size(const BodyModel& model, const std::string& file = "");

}  // namespace atelier
