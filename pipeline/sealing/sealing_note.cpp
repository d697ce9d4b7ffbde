#include "pipeline/sealing/sealing_note.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/store/consent_file.h"
#include "core/store/toml_entries.h"

namespace atelier {
namespace {

constexpr const char* kChecked = "checked";

std::string line(const char* key, const std::string& value) {
  return std::string(key) + " = " + nlohmann::json(value).dump() +
         "\n";  // JSON's escapes are TOML's
}

/// The text of a key, "" where it is not there.
std::string text_of(const std::vector<TomlEntry>& entries, const std::string& key) {
  const auto found = std::find_if(entries.begin(), entries.end(), [&](const TomlEntry& entry) {
    return entry.name == key && entry.kind == TomlEntry::Kind::Text;
  });
  return found == entries.end() ? "" : found->text;
}

}  // namespace

std::string sealing_note_text(const SealingNote& note) {
  const std::string consent = consent_toml(note.consent);
  return "format = 1\n" + line("kind", note.kind) + line("sealed", note.sealed) +
         line("purpose", note.purpose) + line("none_needed", note.none_needed) +
         (note.digests_checked ? line("digests", kChecked) : "") +
         (consent.empty() ? "" : "\n" + consent);
}

SealingNote parse_sealing_note(std::string_view text, const std::string& file) {
  const std::vector<TomlEntry> entries = read_toml_entries(text, file);
  SealingNote note;
  note.kind = text_of(entries, "kind");
  note.sealed = text_of(entries, "sealed");
  note.purpose = text_of(entries, "purpose");
  note.none_needed = text_of(entries, "none_needed");
  note.digests_checked = text_of(entries, "digests") == kChecked;
  note.consent = parse_consent(text, file);
  if (note.kind != "workspace" && note.kind != "export") {
    throw DataError(file, kSealingNote, "neither a workspace nor an export", "one of the two");
  }
  return note;
}

}  // namespace atelier
