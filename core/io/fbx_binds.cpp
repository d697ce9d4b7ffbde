#include "core/io/fbx_binds.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "core/io/fbx_records.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr Index kNumbers = 16;

/// By columns, as the file has it.
std::optional<Eigen::Matrix4d> matrix_of(const FbxRecord& record) {
  if (std::ssize(record.values) != kNumbers) {
    return std::nullopt;
  }
  Eigen::Matrix4d matrix;
  for (Index i = 0; i < kNumbers; ++i) {
    matrix(i) = record.values[static_cast<std::size_t>(i)].number;
  }
  return matrix;
}

/// The last three values: a property's are behind its name, type and flags.
std::optional<Eigen::Vector3d> vector_of(const FbxRecord& record) {
  if (record.values.size() < 4) {
    return std::nullopt;
  }
  Eigen::Vector3d vector;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const FbxValue& value = record.values[record.values.size() - 3 + axis];
    if (value.is_text) {
      return std::nullopt;
    }
    vector[static_cast<Index>(axis)] = value.number;
  }
  return vector;
}

void set_place(std::string_view property, const Eigen::Vector3d& value, FbxModel& model) {
  constexpr std::array<std::string_view, 4> kPivots = {"RotationPivot", "RotationOffset",
                                                       "ScalingPivot", "ScalingOffset"};
  if (!value.allFinite()) {
    return;
  }
  if (property == "GeometricTranslation") {
    model.geometric_translation = value;
  } else if (property == "GeometricRotation") {
    model.geometric_rotation = value;
  } else if (property == "GeometricScaling") {
    model.geometric_scaling = value;
  } else if (property == "PostRotation") {
    model.post_rotation = value;
  } else if (std::find(kPivots.begin(), kPivots.end(), property) != kPivots.end()) {
    model.pivots = model.pivots || !value.isZero(0);
  }
}

FbxInherit inherit_of(double number) {
  return number == 0   ? FbxInherit::ByAxis
         : number == 2 ? FbxInherit::NotOfParent
                       : FbxInherit::Whole;
}

}  // namespace

std::vector<FbxModel> fbx_models(std::span<const std::byte> bytes) {
  constexpr std::array<std::string_view, 3> kNames = {"Model", "P", "Property"};
  std::vector<FbxModel> models;
  FbxInherit otherwise = FbxInherit::Whole;
  read_fbx_records(bytes, kNames, [&](const FbxRecord& record) {
    const std::vector<FbxValue>& values = record.values;
    if (record.name == "Model") {
      const auto name = std::find_if(values.begin(), values.end(),
                                     [](const FbxValue& value) { return value.is_text; });
      FbxModel& model = models.emplace_back();
      model.name = name == values.end() ? std::string() : fbx_object_name(name->text);
      model.inherits = otherwise;
      return;
    }
    if (values.size() < 4 || !values[0].is_text) {
      return;
    }
    const std::string_view property = values[0].text;
    if (property == "InheritType") {  // before the first node: the template of all nodes
      (models.empty() ? otherwise : models.back().inherits) = inherit_of(values.back().number);
    } else if (models.empty()) {
      return;
    } else if (property == "RotationOrder") {
      const double order = values.back().number;
      models.back().rotation_order =
          order >= 0 && order <= 5 ? saturating_cast<int>(order) : models.back().rotation_order;
    } else if (const std::optional<Eigen::Vector3d> value = vector_of(record)) {
      set_place(property, *value, models.back());
    }
  });
  return models;
}

std::vector<FbxBind> fbx_binds(std::span<const std::byte> bytes) {
  constexpr std::array<std::string_view, 2> kNames = {"Transform", "TransformLink"};
  std::vector<FbxBind> binds;
  std::optional<Eigen::Matrix4d> transform;  // of the cluster that is being read
  read_fbx_records(bytes, kNames, [&](const FbxRecord& record) {
    const std::optional<Eigen::Matrix4d> matrix = matrix_of(record);
    if (!matrix) {
      return;
    }
    if (record.name == "Transform") {
      transform = matrix;
    } else if (transform && matrix->allFinite() && transform->allFinite()) {
      binds.push_back({*transform, *matrix});
      transform.reset();
    }
  });
  return binds;
}

}  // namespace atelier
