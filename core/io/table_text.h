#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/finding.h"
#include "core/limits.h"

namespace atelier {

/// A table as comma-separated values, without its cells.
struct CsvTable {
  std::vector<std::string> columns;  ///< their names, the first line
  std::int64_t rows = 0;             ///< without them and without empty lines
  std::vector<Finding> findings;
};

/// Reads a CSV whole (RFC 4180, with names in its first line; lines may end in LF alone, as ours
/// do). Throws DataError, with the line, for a first line without names, more than 65,536 columns,
/// rows with another number of cells, a cell in quotes that does not close or goes on behind them,
/// a quote inside of a cell without quotes, and bytes that no text has. Findings: numbers that are
/// not finite, a last line that does not end, columns that another separator parts, and two columns
/// of one name.
CsvTable parse_csv(std::string_view text, const std::string& file = "", const Limits& limits = {});

/// JSON Lines: how many values, and whether the last one is torn.
struct JsonLines {
  std::int64_t lines = 0;         ///< with a value
  std::vector<Finding> findings;  ///< "torn-line": a run that was killed leaves one
};

/// Reads a JSON text in each line. Throws DataError, with the line, for one that parse_json
/// refuses; one behind the last line end, where a run was killed, is a finding instead.
JsonLines parse_json_lines(std::string_view text, const std::string& file = "",
                           const Limits& limits = {});

}  // namespace atelier
