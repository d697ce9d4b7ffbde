#include "simulation/cloth_state_archive.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "core/archive_arrays.h"
#include "core/check_bounded.h"
#include "core/error.h"
#include "core/limits.h"
#include "core/saturating_cast.h"
#include "simulation/cloth/cloth_state.h"

namespace atelier {
namespace {

constexpr const char* kPositions = "positions";
constexpr const char* kVelocities = "velocities";
constexpr double kMaxFrames = 1e9;

Points state_rows(const Archive& archive, const std::string& name, Index vertices,
                  const std::string& file) {
  const Tensor& tensor = array_at(archive, name, file);
  const std::vector<std::int64_t> shape = {vertices, 3};
  if (tensor.type != ElementType::Float64 || tensor.shape != shape) {
    throw DataError(file, name,
                    std::string(element_type_name(tensor.type)) + " " + shape_text(tensor.shape),
                    "float64 " + shape_text(shape) + ", as this cloth has vertices");
  }
  check_bounded(tensor, Limits{}.mesh_coordinate, file, name);
  return Eigen::Map<const Points>(values_of<double>(tensor).data(), vertices, 3);
}

std::int64_t count_at(const Archive& archive, const std::string& name, const std::string& file) {
  const auto found = archive.numbers.find(name);
  if (found == archive.numbers.end()) {
    throw DataError(file, name, "no such number", "how many frames are done");
  }
  const double value = found->second;
  if (!(value >= 0 && value <= kMaxFrames && value == std::floor(value))) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%g", value);
    throw DataError(file, name, text.data(), "a whole number from 0 to 1e+09");
  }
  return saturating_cast<std::int64_t>(value);
}

}  // namespace

void put_cloth_state(Archive& archive, const std::string& count, const ClothState& state) {
  archive.numbers[count] = static_cast<double>(state.frame);
  archive.datasets[kPositions] = tensor_of(state.positions);
  archive.datasets[kVelocities] = tensor_of(state.velocities);
}

ClothState cloth_state_at(const Archive& archive, const std::string& count, Index vertices,
                          const std::string& file) {
  check_units(archive, file);
  check_names(archive, file,
              [](const std::string& name) { return name == kPositions || name == kVelocities; });
  ClothState state;
  state.positions = state_rows(archive, kPositions, vertices, file);
  state.velocities = state_rows(archive, kVelocities, vertices, file);
  state.frame = count_at(archive, count, file);
  return state;
}

Archive archive_of(const ClothState& state) {
  Archive archive;
  archive.schema = "atelier.cloth_state";
  put_cloth_state(archive, "frame", state);
  return archive;
}

ClothState cloth_state_of(const Archive& archive, Index vertices, const std::string& file) {
  return cloth_state_at(archive, "frame", vertices, file);
}

}  // namespace atelier
