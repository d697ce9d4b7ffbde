#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "core/limits.h"

namespace atelier {

/// Parses TOML 1.0 (toml++) to the values of JSON: tables become objects, dates and times become
/// texts in RFC 3339. DataError with line and column for bad syntax, keys given twice, deeper
/// nesting than `limits.text_depth` (dotted keys count), longer strings than
/// `limits.text_string_bytes`, more values than `limits.text_values`, larger texts than
/// `limits.text_file_bytes`, nan and inf.
///
/// Include <nlohmann/json.hpp> in the .cpp that uses the result.
nlohmann::json parse_toml(std::string_view text, const std::string& file = "",
                          const Limits& limits = {});

/// The same of what Python's programs write: nan and inf become numbers that are NaN, which
/// JsonPlace::number refuses.
nlohmann::json parse_python_toml(std::string_view text, const std::string& file = "",
                                 const Limits& limits = {});

/// Refuses what parse_toml refuses for its nesting, number of values and size, before any parser
/// runs: dotted keys nest without brackets, and a parser that follows 100,000 of them ends in a
/// stack overflow. For callers of another TOML parser. Linear in the text.
void check_toml_nesting(std::string_view text, const std::string& file = "",
                        const Limits& limits = {});

/// Reads and parses a file.
nlohmann::json read_toml(const std::filesystem::path& path, const Limits& limits = {});

/// Line of every value of the text by its path, "cameras.3.id" being the id of the fourth of an
/// array of tables: for errors that name values which parse_toml has read. Refuses what parse_toml
/// refuses.
std::map<std::string, int> toml_lines(std::string_view text, const std::string& file = "",
                                      const Limits& limits = {});

}  // namespace atelier
