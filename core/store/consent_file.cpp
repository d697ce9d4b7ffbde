#include "core/store/consent_file.h"

#include <system_error>

#include <toml++/toml.h>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/store/toml_text.h"
#include "core/store/utc_time.h"
#include "core/utf8.h"

namespace atelier {
namespace {

std::string text_of(const toml::table& table, const char* name, const std::string& file) {
  const toml::node* node = table.get(name);
  if (node == nullptr) {
    return "";
  }
  const auto text = node->value_exact<std::string>();
  if (!text || !is_printable_utf8(*text)) {
    throw DataError(file, std::string("consent.") + name, "no printable text", "a string");
  }
  return *text;
}

Consent consent_of(const toml::table& table, const std::string& file) {
  Consent consent{text_of(table, "who", file), text_of(table, "scope", file), ""};
  const toml::node* until = table.get("until");
  if (until != nullptr && until->is_date()) {
    const toml::date date = until->as_date()->get();
    consent.until = std::to_string(date.year) + (date.month < 10 ? "-0" : "-") +
                    std::to_string(date.month) + (date.day < 10 ? "-0" : "-") +
                    std::to_string(date.day);
  } else {
    consent.until = text_of(table, "until", file);
    if (!consent.until.empty() && !seconds_of_utc(consent.until + "T00:00:00Z")) {
      throw DataError(file, "consent.until", "'" + consent.until + "'", "a day: \"2030-12-31\"");
    }
  }
  if (consent.who.empty() || consent.scope.empty()) {
    throw DataError(file, "consent", "no who or no scope", "both: whose consent, and for what");
  }
  return consent;
}

}  // namespace

std::vector<Consent> read_consent(const std::filesystem::path& input) {
  constexpr int kFoldersAbove = 2;
  std::error_code error;
  std::filesystem::path folder =
      std::filesystem::is_directory(input, error) ? input : input.parent_path();
  for (int i = 0; i <= kFoldersAbove && !folder.empty(); ++i, folder = folder.parent_path()) {
    const std::filesystem::path path = folder / "capture.toml";
    if (!std::filesystem::exists(path, error)) {
      continue;
    }
    const std::string file = path.string();
    const toml::table capture =
        parse_toml_text(read_file_text(path, Limits{}.text_file_bytes), file);
    std::vector<Consent> consent;
    if (const toml::table* one = capture["consent"].as_table()) {
      consent.push_back(consent_of(*one, file));
    } else if (const toml::array* several = capture["consent"].as_array()) {
      for (const toml::node& node : *several) {
        if (!node.is_table()) {
          throw DataError(file, "consent", "an array of something else", "tables");
        }
        consent.push_back(consent_of(*node.as_table(), file));
      }
    } else if (capture.contains("consent")) {
      throw DataError(file, "consent", "no table", "a table with who, scope and until");
    }
    return consent;
  }
  return {};
}

}  // namespace atelier
