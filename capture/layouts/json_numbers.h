#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "capture/camera_conventions.h"
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

/// True for a value that stands for none: null, NaN, a text such as "null" and "None", an array
/// without anything in it or with such a value anywhere.
bool is_unsaid(const JsonPlace& place);

/// Reads rotation (9 numbers) and translation (3) of a camera, camera from world, from members of
/// `entry`. Where one is missing or unsaid, the rotation is all 0: open_dataset leaves a camera
/// without a pose out.
void read_pose(OpencvCamera& camera, const JsonPlace& entry, const char* rotation,
               const char* translation);

}  // namespace atelier
