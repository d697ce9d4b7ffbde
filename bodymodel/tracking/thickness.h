#pragma once

#include <Eigen/Core>

#include "bodymodel/body_model.h"

namespace atelier {

/// How much thicker or thinner than usual shape values make a person: a matrix Q [S,S] so that
/// d^T Q d, with d the values beyond neutral, is the sum over trunk, neck, thighs, shins, upper
/// arms and forearms of the squared change of a part's thickness, as a share: all skin's distance
/// from the bone a tenth more is 0.01, whether by one value or by several. Usual is the model's own
/// body, its girths times the square root of stature, since mass goes with the square of stature
/// (Quetelet). To first order at the neutral shape. Throws DataError for a body that is no person.
/// O(V S^2).
Eigen::MatrixXd thickness_change(const BodyModel& model);

}  // namespace atelier
