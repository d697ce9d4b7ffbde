#include "core/store/consent_file.h"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/store/toml_entries.h"
#include "core/store/utc_time.h"
#include "core/utf8.h"

namespace atelier {
namespace {

constexpr std::string_view kTable = "consent";

/// Of a table; those from the fourth on are written where they say something.
constexpr std::array<std::pair<std::string_view, std::string Consent::*>, 6> kFields = {{
    {"who", &Consent::who},
    {"scope", &Consent::scope},
    {"until", &Consent::until},
    {"revocation", &Consent::revocation},
    {"key", &Consent::key},
    {"signature", &Consent::signature},
}};
constexpr std::size_t kAlways = 3;

const char* kind_name(TomlEntry::Kind kind) {
  switch (kind) {
    case TomlEntry::Kind::Boolean:
      return "true or false";
    case TomlEntry::Kind::Number:
      return "a number";
    case TomlEntry::Kind::Text:
      return "a text";
    case TomlEntry::Kind::Numbers:
      return "a list of numbers";
    case TomlEntry::Kind::Table:
    case TomlEntry::Kind::Other:
      break;
  }
  return "a list or a table";
}

void set_field(Consent& consent, const std::string& field, const TomlEntry& entry,
               const std::string& file) {
  const std::string place = "line " + std::to_string(entry.line) + ", " + entry.name;
  const auto known = std::find_if(kFields.begin(), kFields.end(),
                                  [&](const auto& one) { return field == one.first; });
  if (known == kFields.end()) {
    throw DataError(file, place, "a field that consent does not have",
                    "who, scope and until, and where they are there revocation, key and signature");
  }
  if (entry.kind != TomlEntry::Kind::Text) {
    throw DataError(file, place, kind_name(entry.kind), "a string");
  }
  if (!is_printable_utf8(entry.text)) {
    throw DataError(file, place, "no printable text", "a string without control characters");
  }
  if (field == "until" && !entry.text.empty() && !seconds_of_utc(entry.text + "T00:00:00Z")) {
    throw DataError(file, place, "'" + entry.text.substr(0, 40) + "'", "a day: 2030-12-31");
  }
  consent.*known->second = entry.text;
}

std::vector<Consent> consent_of(const std::vector<TomlEntry>& entries, const std::string& file) {
  std::map<std::string, Consent> by_table;  // "" or the number in an array of tables
  for (const TomlEntry& entry : entries) {
    const std::size_t dot = entry.name.find('.');
    if (entry.name.substr(0, dot) != kTable) {
      continue;
    }
    if (entry.kind == TomlEntry::Kind::Table) {
      by_table[dot == std::string::npos ? "" : entry.name.substr(dot + 1)];
      continue;
    }
    if (dot == std::string::npos) {
      throw DataError(file, "line " + std::to_string(entry.line), "a consent that is no table",
                      "[[consent]] with who, scope and until, once for each consent");
    }
    const std::size_t last = entry.name.rfind('.');
    const std::string which = last == dot ? "" : entry.name.substr(dot + 1, last - dot - 1);
    set_field(by_table[which], entry.name.substr(last + 1), entry, file);
  }
  std::vector<Consent> all;
  for (const auto& [which, consent] : by_table) {
    if (consent.who.empty() || consent.scope.empty()) {
      throw DataError(file, "consent", "no who or no scope", "both: whose consent, and for what");
    }
    all.push_back(consent);
  }
  return all;
}

std::vector<Consent> consent_alone(const std::vector<TomlEntry>& entries, const std::string& file) {
  std::vector<Consent> consent = consent_of(entries, file);
  if (entries.empty()) {  // a full disk leaves one: what was agreed to is not forgotten over that
    throw DataError(file, "", "a file that says nothing",
                    "[[consent]] with who, scope and until, or no such file");
  }
  if (consent.empty()) {  // a table misspelt
    throw DataError(file, "line " + std::to_string(entries.front().line),
                    "'" + entries.front().name.substr(0, 60) + "', but no table [[consent]]",
                    "[[consent]] with who, scope and until, once for each consent");
  }
  return consent;
}

struct StatedConsent {
  std::vector<Consent> consent;
  std::filesystem::path file;
};

StatedConsent stated_consent(const std::filesystem::path& input) {
  constexpr int kFoldersAbove = 2;
  if (input.empty()) {
    return {};
  }
  const std::filesystem::path whole =
      std::filesystem::absolute(input);  // "capture" has folders above
  std::filesystem::path folder =
      file_kind(whole) == std::filesystem::file_type::directory ? whole : whole.parent_path();
  for (int i = 0; i <= kFoldersAbove && !folder.empty(); ++i, folder = folder.parent_path()) {
    bool is_capture = false;
    for (const char* name : {"capture.toml", kConsentFile}) {
      const std::filesystem::path path = folder / name;
      if (file_kind(path) == std::filesystem::file_type::not_found) {
        continue;
      }
      is_capture = true;
      const std::string text = read_file_text(path, Limits{}.text_file_bytes);
      const std::vector<TomlEntry> entries = read_toml_entries(text, path.string());
      auto consent = name == std::string_view(kConsentFile) ? consent_alone(entries, path.string())
                                                            : consent_of(entries, path.string());
      if (!consent.empty()) {
        return {std::move(consent), path};
      }
    }
    if (is_capture) {
      break;
    }
  }
  return {};
}

}  // namespace

std::vector<Consent> parse_consent(std::string_view text, const std::string& file) {
  return consent_of(read_toml_entries(text, file), file);
}

std::vector<Consent> parse_consent_file(std::string_view text, const std::string& file) {
  return consent_alone(read_toml_entries(text, file), file);
}

std::vector<Consent> read_consent(const std::filesystem::path& input) {
  return stated_consent(input).consent;
}

std::filesystem::path consent_file(const std::filesystem::path& input) {
  return stated_consent(input).file;
}

std::string consent_toml(const std::vector<Consent>& consent) {
  const auto quoted = [](const std::string& text) {
    return nlohmann::json(text).dump();  // JSON's escapes are TOML's
  };
  std::string text;
  for (const Consent& one : consent) {
    text += text.empty() ? "[[consent]]\n" : "\n[[consent]]\n";
    for (std::size_t i = 0; i < kFields.size(); ++i) {
      const std::string& value = one.*kFields[i].second;
      if (i < kAlways || !value.empty()) {
        text += std::string(kFields[i].first) + " = " + quoted(value) + "\n";
      }
    }
  }
  return text;
}

}  // namespace atelier
