#include "core/io/json_place.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {

bool JsonPlace::has(const std::string& key) const {
  return value_->is_object() && value_->contains(key);
}

JsonPlace JsonPlace::at(const std::string& key) const {
  const std::optional<JsonPlace> found = find(key);
  if (!found) {
    fail("no \"" + key + "\"", "a member \"" + key + "\"");
  }
  return *found;
}

std::optional<JsonPlace> JsonPlace::find(const std::string& key) const {
  if (!value_->is_object()) {
    fail(value_->type_name(), "an object");
  }
  const auto found = value_->find(key);
  if (found == value_->end()) {
    return std::nullopt;
  }
  return JsonPlace(*found, file_, where_.empty() ? key : where_ + "." + key);
}

std::vector<JsonPlace> JsonPlace::items() const {
  std::vector<JsonPlace> places;
  places.reserve(size());
  for (std::size_t i = 0; i < value_->size(); ++i) {
    places.emplace_back((*value_)[i], file_, where_ + "[" + std::to_string(i) + "]");
  }
  return places;
}

std::vector<JsonPlace> JsonPlace::items(const std::string& key) const {
  const std::optional<JsonPlace> found = find(key);
  return found ? found->items() : std::vector<JsonPlace>();
}

std::size_t JsonPlace::size() const {
  if (!value_->is_array()) {
    fail(value_->type_name(), "an array");
  }
  return value_->size();
}

std::int64_t JsonPlace::integer(std::int64_t least, std::int64_t greatest) const {
  const std::string range = std::to_string(least) + " to " + std::to_string(greatest);
  std::int64_t result = 0;
  if (value_->is_number_unsigned()) {
    const auto positive = value_->get<std::uint64_t>();
    if (greatest < 0 || positive > static_cast<std::uint64_t>(greatest)) {
      fail(std::to_string(positive), range);
    }
    result = static_cast<std::int64_t>(positive);
  } else if (value_->is_number_integer()) {
    result = value_->get<std::int64_t>();
  } else if (value_->is_number_float() && std::abs(value_->get<double>()) < 9e15 &&
             value_->get<double>() == std::floor(value_->get<double>())) {
    result = saturating_cast<std::int64_t>(value_->get<double>());  // 4.0
  } else {
    fail(value_->is_number() ? value_->dump() : value_->type_name(), "a whole number, " + range);
  }
  if (result < least || result > greatest) {
    fail(std::to_string(result), range);
  }
  return result;
}

double JsonPlace::number() const {
  if (!value_->is_number()) {
    fail(value_->type_name(), "a number");
  }
  if (!std::isfinite(value_->get<double>())) {
    fail("NaN", "a finite number");
  }
  return value_->get<double>();
}

bool JsonPlace::boolean() const {
  if (!value_->is_boolean()) {
    fail(value_->type_name(), "true or false");
  }
  return value_->get<bool>();
}

const std::string& JsonPlace::text() const {
  if (!value_->is_string()) {
    fail(value_->type_name(), "a string");
  }
  return value_->get_ref<const std::string&>();
}

std::vector<double> JsonPlace::numbers() const {
  std::vector<double> result;
  for (const JsonPlace& item : items()) {
    result.push_back(item.number());
  }
  return result;
}

std::int64_t JsonPlace::integer_or(const std::string& key, std::int64_t fallback,
                                   std::int64_t least, std::int64_t greatest) const {
  const std::optional<JsonPlace> found = find(key);
  return found ? found->integer(least, greatest) : fallback;
}

bool JsonPlace::boolean_or(const std::string& key, bool fallback) const {
  const std::optional<JsonPlace> found = find(key);
  return found ? found->boolean() : fallback;
}

std::string JsonPlace::text_or(const std::string& key, const std::string& fallback) const {
  const std::optional<JsonPlace> found = find(key);
  return found ? found->text() : fallback;
}

void JsonPlace::fail(const std::string& found, const std::string& expected) const {
  throw DataError(file_, where_, found, expected);
}

}  // namespace atelier
