#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/store/consent.h"

namespace atelier {

/// The consent that a capture's `capture.toml` states: its table `[consent]` (or tables
/// `[[consent]]`) with who, scope, until. `input` is a file or a folder; the capture.toml read is
/// in it or, for a file or a sequence inside a capture, up to two folders above. Empty where there
/// is none. Throws DataError where it is there and wrong.
std::vector<Consent> read_consent(const std::filesystem::path& input);

/// The same of a text. @param file  its name in errors
std::vector<Consent> parse_consent(std::string_view text, const std::string& file);

}  // namespace atelier
