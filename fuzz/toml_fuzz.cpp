#include <nlohmann/json.hpp>
#include <string_view>

#include "core/io/json.h"
#include "core/io/toml.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(toml) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const nlohmann::json value = atelier::parse_toml(text, "toml");
  ATELIER_CHECK(value.is_object(), "a TOML text is a table");
  atelier::toml_lines(text, "toml");
}
