#include "capture/layouts/json_numbers.h"

#include <nlohmann/json.hpp>

#include "capture/layouts/camera_side.h"
#include "core/printable.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

std::vector<double> exactly(const JsonPlace& place, std::size_t count) {
  std::vector<double> values = all_numbers(place);
  if (values.size() != count) {
    place.fail(counted(static_cast<std::int64_t>(values.size()), "number"), std::to_string(count));
  }
  return values;
}

}  // namespace

std::vector<double> all_numbers(const JsonPlace& place) {
  if (!place.value().is_array()) {
    return {place.number()};
  }
  std::vector<double> values;
  for (const JsonPlace& item : place.items()) {
    const std::vector<double> part =
        item.value().is_array() ? item.numbers() : std::vector<double>{item.number()};
    values.insert(values.end(), part.begin(), part.end());
  }
  return values;
}

Eigen::Matrix3d matrix3_of(const JsonPlace& place) {
  const std::vector<double> values = exactly(place, 9);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data());
}

Eigen::Vector3d vector3_of(const JsonPlace& place) {
  const std::vector<double> values = exactly(place, 3);
  return {values[0], values[1], values[2]};
}

Eigen::Matrix4d matrix4_of(const JsonPlace& place) {
  const std::vector<double> values = exactly(place, 16);
  return Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
}

bool is_unsaid(const JsonPlace& place) {
  if (!place.value().is_string()) {
    return place.value().is_null();
  }
  const std::string& text = place.text();
  return text.empty() || text == "null" || text == "None" || text == "none" || text == "nan" ||
         text == "NaN";
}

void read_pose(OpencvCamera& camera, const JsonPlace& rotation, const JsonPlace& translation) {
  if (is_unsaid(rotation) || is_unsaid(translation)) {
    camera.rotation.setZero();
    camera.translation.setZero();
    return;
  }
  camera.rotation = matrix3_of(rotation);
  camera.translation = vector3_of(translation);
}

int pixels_of(const JsonPlace& place) {
  const double value = place.number();
  if (!is_camera_side(value)) {
    place.fail("no number of pixels", camera_side_range());
  }
  return saturating_cast<int>(value);
}

nlohmann::ordered_json rows_json(const Eigen::MatrixXd& matrix) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    nlohmann::ordered_json row = nlohmann::ordered_json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      row.push_back(matrix(i, j));
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace atelier
