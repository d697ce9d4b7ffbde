#include "pipeline/synthesis/performance_state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "core/archive_arrays.h"
#include "core/check_bounded.h"
#include "core/error.h"
#include "core/limits.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kMaxSteps = 1e9;

/// The arrays of a state by their names, cloth first.
constexpr std::array kOfCloth = {std::pair{"cloth/positions", &ClothState::positions},
                                 std::pair{"cloth/velocities", &ClothState::velocities}};
constexpr std::array kOfFlesh = {std::pair{"flesh/last", &SoftTissue::last},
                                 std::pair{"flesh/last_velocity", &SoftTissue::last_velocity},
                                 std::pair{"flesh/offset", &SoftTissue::offset},
                                 std::pair{"flesh/velocity", &SoftTissue::velocity}};

std::int64_t whole_number(const Archive& archive, const std::string& name,
                          const std::string& file) {
  const auto found = archive.numbers.find(name);
  if (found == archive.numbers.end()) {
    throw DataError(file, name, "no such number", "a state of a synthesis");
  }
  const double value = found->second;
  if (!(value >= 0 && value <= kMaxSteps && value == std::floor(value))) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%g", value);
    throw DataError(file, name, text.data(), "a whole number from 0 to 1e+09");
  }
  return saturating_cast<std::int64_t>(value);
}

Points rows_of_state(const Archive& archive, const std::string& name, Index rows,
                     const std::string& file) {
  const Tensor& tensor = array_at(archive, name, file);
  const std::vector<std::int64_t> shape = {rows, 3};
  if (tensor.type != ElementType::Float64 || tensor.shape != shape) {
    throw DataError(file, name,
                    std::string(element_type_name(tensor.type)) + " " + shape_text(tensor.shape),
                    "float64 " + shape_text(shape));
  }
  check_bounded(tensor, Limits{}.mesh_coordinate, file, name);
  return Eigen::Map<const Points>(values_of<double>(tensor).data(), rows, 3);
}

bool is_named_in_state(const std::string& name) {
  const auto is_it = [&](const auto& one) { return name == one.first; };
  return std::any_of(kOfCloth.begin(), kOfCloth.end(), is_it) ||
         std::any_of(kOfFlesh.begin(), kOfFlesh.end(), is_it);
}

}  // namespace

Archive archive_of(const PerformanceState& state) {
  Archive archive;
  archive.schema = "atelier.synthesis.state";
  archive.numbers = {{"next_frame", static_cast<double>(state.next_frame)},
                     {"step", static_cast<double>(state.step)},
                     {"cloth_frame", static_cast<double>(state.cloth.frame)},
                     {"flesh_steps", static_cast<double>(state.flesh.steps)}};
  for (const auto& [name, member] : kOfCloth) {
    archive.datasets[name] = tensor_of(state.cloth.*member);
  }
  for (const auto& [name, member] : kOfFlesh) {
    archive.datasets[name] = tensor_of(state.flesh.*member);
  }
  return archive;
}

PerformanceState performance_state_of(const Archive& archive, Index cloth_vertices,
                                      Index body_vertices, const std::string& file) {
  check_units(archive, file);
  check_names(archive, file, is_named_in_state);
  PerformanceState state;
  state.next_frame = static_cast<int>(whole_number(archive, "next_frame", file));
  state.step = whole_number(archive, "step", file);
  state.cloth.frame = whole_number(archive, "cloth_frame", file);
  state.flesh.steps = static_cast<int>(whole_number(archive, "flesh_steps", file));
  for (const auto& [name, member] : kOfCloth) {
    state.cloth.*member = rows_of_state(archive, name, cloth_vertices, file);
  }
  for (const auto& [name, member] : kOfFlesh) {
    state.flesh.*member = rows_of_state(archive, name, body_vertices, file);
  }
  return state;
}

}  // namespace atelier
