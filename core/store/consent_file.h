#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/store/consent.h"

namespace atelier {

/// Consent file beside a capture whose layout has no place for it.
inline constexpr const char* kConsentFile = "consent.toml";

/// The consent that a capture's `capture.toml` states, or else its `consent.toml`: a table
/// `[[consent]]` for each, or one `[consent]`, with who, scope, until. `input` is a file or a
/// folder; the file read is in it or, for a file or a sequence inside a capture, up to two folders
/// above. Empty where there is none. Throws DataError where it is there and wrong.
std::vector<Consent> read_consent(const std::filesystem::path& input);

/// The file that `read_consent` has it from; "" where there is none.
std::filesystem::path consent_file(const std::filesystem::path& input);

/// The tables that `parse_consent` reads back; "" for none.
std::string consent_toml(const std::vector<Consent>& consent);

/// The same of a text. @param file  its name in errors
std::vector<Consent> parse_consent(std::string_view text, const std::string& file);

/// The same of the text of a `consent.toml`. Throws DataError also where it states something else
/// and no consent: a table misspelt.
std::vector<Consent> parse_consent_file(std::string_view text, const std::string& file);

}  // namespace atelier
