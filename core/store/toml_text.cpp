#include "core/store/toml_text.h"

#include "core/error.h"
#include "core/limits.h"

namespace atelier {
namespace {

std::string place(const toml::source_region& region) {
  return "line " + std::to_string(region.begin.line) + ", column " +
         std::to_string(region.begin.column);
}

void check_depth(const toml::node& node, std::int64_t depth, const std::string& file) {
  const Limits limits;
  if (depth > limits.text_depth) {
    throw DataError(file, place(node.source()),
                    "nesting deeper than " + std::to_string(limits.text_depth), "flatter TOML");
  }
  if (const toml::table* table = node.as_table()) {
    for (const auto& [name, value] : *table) {
      check_depth(value, depth + 1, file);
    }
  } else if (const toml::array* array = node.as_array()) {
    for (const toml::node& value : *array) {
      check_depth(value, depth + 1, file);
    }
  } else if (const auto* value = node.as_string();
             value != nullptr &&
             static_cast<std::int64_t>(value->get().size()) > limits.text_string_bytes) {
    throw DataError(file, place(node.source()),
                    "a string of " + std::to_string(value->get().size()) + " bytes",
                    "at most " + std::to_string(limits.text_string_bytes));
  }
}

}  // namespace

toml::table parse_toml_text(std::string_view text, const std::string& file) {
  const Limits limits;
  if (static_cast<std::int64_t>(text.size()) > limits.text_file_bytes) {
    throw DataError(file, "", std::to_string(text.size()) + " bytes of TOML",
                    "at most " + std::to_string(limits.text_file_bytes) + " bytes");
  }
  try {
    toml::table table = toml::parse(text);
    check_depth(table, 0, file);
    return table;
  } catch (const toml::parse_error& error) {
    throw DataError(file, place(error.source()), std::string(error.description()), "TOML 1.0");
  }
}

}  // namespace atelier
