#include "capture/layouts/json_numbers.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

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
  const nlohmann::json& value = place.value();
  if (value.is_array()) {
    const std::vector<JsonPlace> items = place.items();
    return items.empty() || std::any_of(items.begin(), items.end(), is_unsaid);
  }
  if (value.is_number_float()) {
    return std::isnan(value.get<double>());
  }
  if (!value.is_string()) {
    return value.is_null();
  }
  const std::string& text = place.text();
  return text.empty() || text == "null" || text == "None" || text == "none" || text == "nan" ||
         text == "NaN";
}

void read_pose(OpencvCamera& camera, const JsonPlace& entry, const char* rotation,
               const char* translation) {
  const std::optional<JsonPlace> turn = entry.find(rotation);
  const std::optional<JsonPlace> shift = entry.find(translation);
  if (!turn || !shift || is_unsaid(*turn) || is_unsaid(*shift)) {
    camera.rotation.setZero();
    camera.translation.setZero();
    return;
  }
  camera.rotation = matrix3_of(*turn);
  camera.translation = vector3_of(*shift);
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
