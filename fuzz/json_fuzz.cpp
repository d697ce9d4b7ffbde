#include <nlohmann/json.hpp>
#include <string_view>

#include "core/io/json.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(json) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const nlohmann::json value = atelier::parse_json(text, "json");
  // What is read can be written and read again to the same value.
  ATELIER_CHECK(atelier::parse_json(value.dump(), "json") == value, "JSON does not round-trip");
}
