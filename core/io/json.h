#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "core/limits.h"

namespace atelier {

/// Parses one JSON text (RFC 8259) strictly. Refused, with line and column, as DataError: anything
/// but UTF-8, NUL bytes, comments, text after the value, trailing commas, duplicate keys, lone
/// surrogates, numbers beyond double (1e999), NaN and Infinity, deeper nesting than
/// `limits.text_depth`, longer strings than `limits.text_string_bytes`, more values than
/// `limits.text_values`, larger texts than `limits.text_file_bytes`. Integers beyond 64 bits become
/// doubles. Linear in the text.
///
/// Include <nlohmann/json.hpp> in the .cpp that uses the result.
nlohmann::json parse_json(std::string_view text, const std::string& file = "",
                          const Limits& limits = {});

/// The same of what Python's json.dump writes: NaN, Infinity and -Infinity, which are no JSON,
/// become numbers that are NaN, which JsonPlace::number refuses.
nlohmann::json parse_python_json(std::string_view text, const std::string& file = "",
                                 const Limits& limits = {});

/// Reads and parses a file.
nlohmann::json read_json(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier
