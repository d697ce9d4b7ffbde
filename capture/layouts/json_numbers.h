#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/io/json_place.h"

namespace atelier {

/// Every number of an array, of arrays of numbers, or of one number, row by row. Throws DataError
/// for anything else below `place`.
std::vector<double> all_numbers(const JsonPlace& place);

/// Exactly that many, as rows of a matrix: [[1, 2], [3, 4]] and [1, 2, 3, 4] are the same.
Eigen::Matrix3d matrix3_of(const JsonPlace& place);
Eigen::Vector3d vector3_of(const JsonPlace& place);
Eigen::Matrix4d matrix4_of(const JsonPlace& place);

/// Pixels of a side, 1 to 65536, also written as 1080.0.
int pixels_of(const JsonPlace& place);

/// A matrix as an array of rows.
nlohmann::ordered_json rows_json(const Eigen::MatrixXd& matrix);

}  // namespace atelier
