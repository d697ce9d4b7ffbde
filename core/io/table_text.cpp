#include "core/io/table_text.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error.h"
#include "core/io/json.h"
#include "core/io/plain_text.h"
#include "core/io/text_scanner.h"
#include "core/printable.h"

namespace atelier {
namespace {

/// Columns of one table: a cell costs 32 times the comma that makes it.
constexpr std::size_t kMaxColumns = 65'536;

/// Cells one after the other, each with where its row ends.
class CsvCells {
 public:
  CsvCells(std::string_view text, const std::string& file, const Limits& limits)
      : text_(text), file_(file), limits_(limits), at_(text.starts_with("\xEF\xBB\xBF") ? 3 : 0) {}

  bool at_end() const { return at_ >= text_.size(); }
  bool ended_by_line() const { return line_ends_; }  ///< the last row, not by the end of the text
  std::int64_t line() const { return line_; }        ///< in which the last row began

  /// The cells of the next line; one that is empty of an empty line.
  const std::vector<std::string>& next_row() {
    row_.clear();
    line_ = 1 + lines_;
    line_ends_ = false;
    for (bool more = true; more;) {
      if (row_.size() == kMaxColumns) {
        fail("more than " + std::to_string(kMaxColumns) + " cells", "fewer");
      }
      row_.push_back(cell());
      more = !at_end() && text_[at_] == ',';
      at_ += more ? 1 : 0;
    }
    if (!at_end()) {  // cell() leaves "\n" or "\r\n"
      at_ += text_[at_] == '\r' ? 2 : 1;
      line_ends_ = true;
      ++lines_;
    }
    return row_;
  }

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw DataError(file_, "line " + std::to_string(line_), found, expected);
  }

 private:
  std::string cell() {
    const bool quoted = !at_end() && text_[at_] == '"';
    const std::size_t begin = at_;
    std::string value = quoted ? in_its_quotes() : plain();
    if (static_cast<std::int64_t>(at_ - begin) > limits_.line_bytes) {
      fail("a cell of " + std::to_string(at_ - begin) + " bytes",
           "at most " + std::to_string(limits_.line_bytes));
    }
    const std::string_view rest = text_.substr(at_);
    if (!rest.empty() && rest[0] != ',' && rest[0] != '\n' && !rest.starts_with("\r\n")) {
      fail(rest[0] == '\r' ? "a carriage return alone"
           : quoted        ? in_quotes(rest.substr(0, 20)) + " behind a cell in quotes"
                           : "a quote inside of a cell without quotes",
           rest[0] == '\r' ? "lines that end in LF or CRLF" : "\"...\", a quote in it twice");
    }
    return value;
  }

  std::string plain() {
    const std::size_t end = std::min(text_.find_first_of(",\"\r\n", at_), text_.size());
    std::string value(text_.substr(at_, end - at_));
    at_ = end;
    return value;
  }

  std::string in_its_quotes() {
    std::string value;
    for (++at_; !at_end(); ++at_) {
      if (text_[at_] == '"') {
        ++at_;
        if (at_end() || text_[at_] != '"') {
          return value;
        }
      }
      lines_ += text_[at_] == '\n' ? 1 : 0;
      value += text_[at_];
    }
    fail("a cell in quotes that does not close", "\"");
  }

  std::string_view text_;
  const std::string& file_;
  const Limits& limits_;
  std::size_t at_;
  std::int64_t lines_ = 0;
  std::int64_t line_ = 0;
  bool line_ends_ = false;
  std::vector<std::string> row_;
};

/// As C, Python, JavaScript and the C of older Windows ("1.#INF", "-1.#IND00") print them. "Nan"
/// may be a name.
bool is_not_finite(std::string_view cell) {
  constexpr std::string_view kWords[] = {"nan", "NaN", "NAN",      "inf",
                                         "Inf", "INF", "Infinity", "infinity"};
  const bool sign = cell.starts_with('-') || cell.starts_with('+');
  const std::string_view word = cell.substr(sign ? 1 : 0);
  constexpr std::string_view kOfWindows = "1.#";
  const std::string_view kind = word.starts_with(kOfWindows) ? word.substr(kOfWindows.size()) : "";
  return std::find(std::begin(kWords), std::end(kWords), word) != std::end(kWords) ||
         kind.starts_with("INF") || kind.starts_with("IND") || kind.starts_with("QNAN") ||
         kind.starts_with("SNAN") || word.starts_with("nan(");
}

bool is_json(std::string_view text, const Limits& limits) {
  try {
    parse_json(text, "", limits);
    return true;
  } catch (const DataError&) {
    return false;
  }
}

}  // namespace

CsvTable parse_csv(std::string_view text, const std::string& file, const Limits& limits) {
  check_plain_text(text, file);
  CsvCells cells(text, file, limits);
  CsvTable table;
  table.columns = cells.next_row();
  if (std::all_of(table.columns.begin(), table.columns.end(),  // pandas leaves that of rows out
                  [](const std::string& name) { return trimmed_text(name).empty(); })) {
    cells.fail(beginning_of(text), "columns' names in the first line");
  }
  const std::set<std::string> names(table.columns.begin(), table.columns.end());
  if (names.size() < table.columns.size()) {
    table.findings.push_back({Severity::Warning, "csv-column-twice", "line 1",
                              "two columns have one name", "programs take one of them"});
  }
  if (table.columns.size() == 1 &&
      table.columns.front().find_first_of(";\t") != std::string::npos) {
    table.findings.push_back({Severity::Warning, "csv-separator", "line 1",
                              "columns are not parted by commas", "a, b, c; not a; b; c"});
  }
  std::int64_t not_finite = 0;
  std::string first;
  while (!cells.at_end()) {
    const std::vector<std::string>& row = cells.next_row();
    if (row.size() == 1 && trimmed_text(row.front()).empty()) {
      continue;
    }
    if (row.size() != table.columns.size()) {
      cells.fail(std::to_string(row.size()) + " cells",
                 std::to_string(table.columns.size()) + ", as in the first line");
    }
    ++table.rows;
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (is_not_finite(trimmed_text(row[i]))) {
        first = not_finite == 0 ? "line " + std::to_string(cells.line()) + ", column " +
                                      in_quotes(table.columns[i])
                                : first;
        ++not_finite;
      }
    }
  }
  if (not_finite > 0) {
    table.findings.push_back({Severity::Warning, "not-finite", first,
                              counted(not_finite, "number") + " not finite",
                              "what is read from them is nowhere"});
  }
  if (!cells.ended_by_line()) {
    table.findings.push_back({Severity::Warning, "torn-line",
                              "line " + std::to_string(cells.line()), "it does not end",
                              "a program that was killed leaves one; its last number may be cut"});
  }
  return table;
}

JsonLines parse_json_lines(std::string_view text, const std::string& file, const Limits& limits) {
  JsonLines result;
  std::size_t at = 0;
  for (std::size_t end = 0; (end = text.find('\n', at)) != std::string_view::npos; at = end + 1) {
    ++result.lines;
    try {
      parse_json(text.substr(at, end - at), file, limits);
    } catch (const DataError& error) {  // which knows of its own line alone
      const std::size_t own = error.where.starts_with("line 1, ") ? 8 : 0;
      throw DataError(file, "line " + std::to_string(result.lines) + ", " + error.where.substr(own),
                      error.found, error.expected);
    }
  }
  if (at < text.size() && is_json(text.substr(at), limits)) {
    ++result.lines;
  } else if (at < text.size()) {
    result.findings.push_back({Severity::Warning, "torn-line",
                               "line " + std::to_string(result.lines + 1), "it does not end",
                               "a run that was killed leaves one; the next run leaves it out"});
  }
  return result;
}

}  // namespace atelier
