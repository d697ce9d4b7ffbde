#include "capture/layouts/opencv_yaml.h"

#include <algorithm>
#include <limits>

#include "capture/layouts/layout.h"
#include "core/error.h"
#include "core/io/text_scanner.h"
#include "core/printable.h"

namespace atelier {
namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t' || text.front() == '\r')) {
    text.remove_prefix(1);
  }
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r')) {
    text.remove_suffix(1);
  }
  return text;
}

std::string unquoted(std::string_view text) {
  text = trimmed(text);
  if (text.size() >= 2 && (text.front() == '"' || text.front() == '\'') &&
      text.back() == text.front()) {
    text = text.substr(1, text.size() - 2);
  }
  return std::string(text);
}

/// One line of the file: how far it is indented, and its text.
struct Line {
  std::size_t indent = 0;
  std::string_view text;
  std::int64_t number = 0;
};

std::vector<Line> lines_of(std::string_view text, const std::string& file, const Limits& limits) {
  std::vector<Line> lines;
  std::int64_t number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view raw = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    if (raw.find('\0') != std::string_view::npos ||
        static_cast<std::int64_t>(raw.size()) > limits.line_bytes) {
      throw DataError(file, "line " + std::to_string(number), "a NUL byte or an endless line",
                      "text");
    }
    std::size_t indent = 0;
    while (indent < raw.size() && raw[indent] == ' ') {
      ++indent;
    }
    const std::string_view content = trimmed(raw);
    if (!content.empty() && content.front() != '#') {
      lines.push_back({indent, content, number});
    }
  }
  return lines;
}

/// As OpenCV and PyYAML write a number that is none.
bool is_yaml_nan(std::string_view text) {
  return text == ".Nan" || text == ".nan" || text == ".NaN" || text == ".NAN" || text == "nan";
}

class YamlParser {
 public:
  YamlParser(std::vector<Line> lines, std::string file)
      : lines_(std::move(lines)), file_(std::move(file)) {}

  OpencvYaml parse() {
    if (lines_.empty() || !lines_.front().text.starts_with("%YAML")) {
      throw DataError(file_, "line 1", "no %YAML line", "a file of OpenCV's FileStorage");
    }
    at_ = 1;
    while (at_ < lines_.size()) {
      const Line& line = lines_[at_];
      if (line.text == "---" || line.text == "...") {
        ++at_;
      } else {
        entry();
      }
    }
    return std::move(result_);
  }

 private:
  [[noreturn]] void fail(const Line& line, const std::string& found,
                         const std::string& expected) const {
    throw DataError(file_, "line " + std::to_string(line.number), found, expected);
  }

  void entry() {
    const Line line = lines_[at_];
    const std::size_t colon = line.text.find(':');
    if (line.indent != 0 || colon == std::string_view::npos || colon == 0) {
      fail(line, in_quotes(line.text), "a key and a colon at the beginning of the line");
    }
    const std::string key = unquoted(line.text.substr(0, colon));
    if (!keys_.emplace(key, line.number).second) {
      fail(line, "the key '" + key.substr(0, 60) + "' a second time", "each key once");
    }
    const std::string_view value = trimmed(line.text.substr(colon + 1));
    ++at_;
    if (value.starts_with("!!opencv-matrix")) {
      result_.matrices.emplace(key, matrix(line));
    } else if (value.starts_with("[")) {
      result_.lists.emplace(key, flow(line, value));
    } else if (!value.empty() && !value.starts_with("!!") && value != "{") {
      result_.scalars.emplace(key, unquoted(value));
    } else {
      block(key);
    }
  }

  /// "- a" lines; anything else that is indented is passed over.
  void block(const std::string& key) {
    std::vector<std::string> items;
    bool is_list = false;
    while (at_ < lines_.size() && (lines_[at_].indent > 0 || lines_[at_].text.starts_with("- ") ||
                                   lines_[at_].text == "}" || lines_[at_].text == "]")) {
      const std::string_view text = lines_[at_].text;
      if (text.starts_with("- ")) {
        items.push_back(unquoted(text.substr(2)));
        is_list = true;
      }
      ++at_;
    }
    if (is_list) {
      result_.lists.emplace(key, std::move(items));
    }
  }

  /// The rest of "[ a, b," up to the bracket, over lines.
  std::vector<std::string> flow(const Line& begin, std::string_view first) {
    std::vector<std::string> items;
    first.remove_prefix(1);
    for (std::string_view rest = first;;) {
      const std::size_t end = rest.find(']');
      std::string_view part = rest.substr(0, end);
      while (!part.empty()) {
        const std::size_t comma = std::min(part.find(','), part.size());
        const std::string item = unquoted(part.substr(0, comma));
        if (!item.empty()) {
          items.push_back(item);
        }
        part.remove_prefix(std::min(comma + 1, part.size()));
      }
      if (end != std::string_view::npos) {
        if (!trimmed(rest.substr(end + 1)).empty()) {
          fail(begin, "text behind ']'", "the end of the line");
        }
        return items;
      }
      if (at_ >= lines_.size()) {
        fail(begin, "a list without ']'", "']' before the end of the file");
      }
      rest = lines_[at_++].text;
    }
  }

  RowMatrix matrix(const Line& begin) {
    std::int64_t rows = -1;
    std::int64_t cols = -1;
    std::vector<std::string> data;
    bool has_data = false;
    while (at_ < lines_.size() && lines_[at_].indent > 0 && !has_data) {
      const Line line = lines_[at_++];
      const std::size_t colon = line.text.find(':');
      const std::string_view name = trimmed(line.text.substr(0, colon));
      const std::string_view value =
          colon == std::string_view::npos ? "" : trimmed(line.text.substr(colon + 1));
      if (name == "rows" || name == "cols") {
        if (!parse_integer(value, name == "rows" ? rows : cols)) {
          fail(line, in_quotes(value), "a number of " + std::string(name));
        }
      } else if (name == "dt") {
        const std::string kind = unquoted(value);
        if (kind != "d" && kind != "f" && kind != "i" && kind != "u") {
          fail(line, "elements of type " + in_quotes(kind), "d, f, i or u, one channel");
        }
      } else if (name == "data" && value.starts_with("[")) {
        data = flow(line, value);
        has_data = true;
      } else {
        fail(line, in_quotes(line.text), "rows, cols, dt or data of a matrix");
      }
    }
    const auto count = static_cast<std::int64_t>(data.size());
    if (!has_data || rows < 0 || cols < 0 || rows > count || cols > count || rows * cols != count) {
      fail(begin,
           "a matrix of " + std::to_string(rows) + " x " + std::to_string(cols) + " with " +
               counted(count, "number"),
           "rows times cols numbers");
    }
    RowMatrix result(rows, cols);
    for (std::int64_t i = 0; i < count; ++i) {
      const std::string& number = data[static_cast<std::size_t>(i)];
      if (is_yaml_nan(number)) {
        result.data()[i] = std::numeric_limits<double>::quiet_NaN();
      } else if (!parse_number(number, result.data()[i])) {
        fail(begin, in_quotes(data[static_cast<std::size_t>(i)]), "a finite number");
      }
    }
    return result;
  }

  std::vector<Line> lines_;
  std::string file_;
  std::size_t at_ = 0;
  std::map<std::string, std::int64_t> keys_;
  OpencvYaml result_;
};

}  // namespace

OpencvYaml parse_opencv_yaml(std::string_view text, const std::string& file, const Limits& limits) {
  if (static_cast<std::int64_t>(text.size()) > limits.text_file_bytes) {
    throw DataError(file, "", std::to_string(text.size()) + " bytes",
                    "at most " + std::to_string(limits.text_file_bytes));
  }
  return YamlParser(lines_of(text, file, limits), file).parse();
}

std::string opencv_yaml_matrix(const std::string& name, const RowMatrix& matrix) {
  std::string text = name + ": !!opencv-matrix\n   rows: " + std::to_string(matrix.rows()) +
                     "\n   cols: " + std::to_string(matrix.cols()) + "\n   dt: d\n   data: [ ";
  for (Index i = 0; i < matrix.size(); ++i) {
    text += (i > 0 ? ", " : "") + number_text(matrix.data()[i]);
  }
  return text + " ]\n";
}

}  // namespace atelier
