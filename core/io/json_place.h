#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace atelier {

/// A value inside a JSON document and the way to it ("meshes[2].name"), so that reading a field
/// checks its type and range, and an error names the field. The document must outlive it.
class JsonPlace {
 public:
  JsonPlace(const nlohmann::json& value, std::string file, std::string where = "")
      : value_(&value), file_(std::move(file)), where_(std::move(where)) {}

  bool has(const std::string& key) const;

  /// A member that must be there. Throws DataError if this is no object or has no such member.
  JsonPlace at(const std::string& key) const;
  /// A member, or nothing.
  std::optional<JsonPlace> find(const std::string& key) const;

  /// The items of an array; of the member `key`, none if it is absent.
  std::vector<JsonPlace> items() const;
  std::vector<JsonPlace> items(const std::string& key) const;
  /// Length of an array.
  std::size_t size() const;

  std::int64_t integer(std::int64_t least, std::int64_t greatest) const;
  double number() const;
  bool boolean() const;
  const std::string& text() const;
  std::vector<double> numbers() const;

  std::int64_t integer_or(const std::string& key, std::int64_t fallback, std::int64_t least,
                          std::int64_t greatest) const;
  bool boolean_or(const std::string& key, bool fallback) const;
  std::string text_or(const std::string& key, const std::string& fallback) const;

  const std::string& file() const { return file_; }
  const std::string& where() const { return where_; }
  const nlohmann::json& value() const { return *value_; }

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const;

 private:
  const nlohmann::json* value_;
  std::string file_;
  std::string where_;
};

}  // namespace atelier
