#include "core/io/toml.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include <toml++/toml.h>

#include "core/error.h"
#include "core/io/file_bytes.h"

namespace atelier {
namespace {

std::string place(std::int64_t line, std::int64_t column) {
  return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

/// Counts nesting and values before the parser runs: it would build dotted keys of any depth, and
/// freeing a tree of 100,000 levels overflows the stack. Follows strings and comments, so that what
/// is counted is what the parser will see, up to the first error that the parser itself finds.
class DepthCheck {
 public:
  DepthCheck(std::string_view text, const std::string& file, const Limits& limits)
      : text_(text), file_(file), limits_(limits) {}

  void run() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      switch (c) {
        case '#':
          at_ = std::min(text_.find('\n', at_), text_.size());
          continue;
        case '"':
        case '\'':
          skip_string(c);
          line_is_empty_ = false;
          continue;
        case '\n':
          next_line();
          break;
        case '.':
          ++dots_;
          break;
        case '=':
          key_dots_ = dots_;
          dots_ = 0;
          count_value();
          break;
        case ',':
          dots_ = key_dots_ = 0;
          count_value();
          break;
        case '[':
        case '{':
          if (line_is_empty_ && open_.empty()) {
            header_ = true;
            base_ = 0;
          }
          open_.push_back(1 + key_dots_);
          total_ += open_.back();
          dots_ = key_dots_ = 0;
          count_value();
          break;
        case ']':
        case '}':
          if (!open_.empty()) {
            total_ -= open_.back();
            open_.pop_back();
          }
          if (!header_) {
            dots_ = 0;
          }
          break;
        default:
          break;
      }
      if (base_ + total_ + key_dots_ + dots_ > limits_.text_depth) {
        refuse("nesting deeper than " + std::to_string(limits_.text_depth), "flatter TOML");
      }
      line_is_empty_ = line_is_empty_ && (c == ' ' || c == '\t' || c == '\n' || c == '\r');
      ++at_;
    }
  }

 private:
  void next_line() {
    ++line_;
    line_start_ = at_ + 1;
    if (header_) {
      base_ = dots_ + 2;  // the table, and its place in an array of tables
      header_ = false;
      total_ = 0;
      open_.clear();
    }
    dots_ = key_dots_ = 0;
    line_is_empty_ = true;
  }

  /// Goes behind a string of one or three quotes; a string of one quote ends with its line.
  void skip_string(char quote) {
    const bool escapes = quote == '"';
    const bool triple = text_.substr(at_, 3) == std::string(3, quote);
    at_ += triple ? 3 : 1;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '\n') {
        if (!triple) {
          return;
        }
        ++line_;
        line_start_ = at_ + 1;
      }
      if (escapes && c == '\\' && at_ + 1 < text_.size() && text_[at_ + 1] != '\n') {
        at_ += 2;
        continue;
      }
      if (c == quote && !triple) {
        ++at_;
        return;
      }
      if (c == quote && text_.substr(at_, 3) == std::string(3, quote)) {
        // Up to two quotes before the closing three belong to the string.
        std::size_t run = 3;
        while (run < 5 && at_ + run < text_.size() && text_[at_ + run] == quote) {
          ++run;
        }
        at_ += run;
        return;
      }
      ++at_;
    }
  }

  void count_value() {
    if (++values_ > limits_.text_values) {
      refuse("more than " + std::to_string(limits_.text_values) + " values", "smaller TOML");
    }
  }

  [[noreturn]] void refuse(const std::string& found, const std::string& expected) const {
    throw DataError(file_, place(line_, static_cast<std::int64_t>(at_ - line_start_) + 1), found,
                    expected);
  }

  std::string_view text_;
  const std::string& file_;
  const Limits& limits_;
  std::size_t at_ = 0;
  std::size_t line_start_ = 0;
  std::int64_t line_ = 1;
  bool line_is_empty_ = true;  ///< so far
  bool header_ = false;        ///< inside a line that begins with [
  std::int64_t base_ = 0;      ///< depth of the table of the last header
  std::vector<std::int64_t> open_;
  std::int64_t total_ = 0;     ///< sum of `open_`
  std::int64_t dots_ = 0;      ///< since the last separator
  std::int64_t key_dots_ = 0;  ///< of the key whose value follows
  std::int64_t values_ = 0;
};

toml::table parse_table(std::string_view text, const std::string& file, const Limits& limits) {
  check_toml_nesting(text, file, limits);
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    const toml::source_position& begin = error.source().begin;
    throw DataError(file, place(begin.line, begin.column),
                    std::string(error.description()).substr(0, 300), "TOML");
  }
}

/// Turns nodes of toml++ into JSON.
class Converter {
 public:
  /// @param nan  takes numbers that are not finite as NaN
  Converter(const std::string& file, const Limits& limits, bool nan = false)
      : file_(file), limits_(limits), nan_(nan) {}

  nlohmann::json convert(const toml::node& node, std::int64_t depth) const {
    if (depth > limits_.text_depth) {
      refuse(node, "nesting deeper than " + std::to_string(limits_.text_depth), "flatter TOML");
    }
    switch (node.type()) {
      case toml::node_type::table: {
        nlohmann::json object = nlohmann::json::object();
        for (const auto& [key, value] : *node.as_table()) {
          check_string(node, std::string(key.str()));
          object[std::string(key.str())] = convert(value, depth + 1);
        }
        return object;
      }
      case toml::node_type::array: {
        nlohmann::json array = nlohmann::json::array();
        for (const toml::node& value : *node.as_array()) {
          array.push_back(convert(value, depth + 1));
        }
        return array;
      }
      case toml::node_type::string:
        return check_string(node, node.as_string()->get());
      case toml::node_type::integer:
        return node.as_integer()->get();
      case toml::node_type::boolean:
        return node.as_boolean()->get();
      case toml::node_type::floating_point:
        if (!std::isfinite(node.as_floating_point()->get())) {
          if (nan_) {
            return std::numeric_limits<double>::quiet_NaN();
          }
          refuse(node, "a number that is not finite", "a finite number");
        }
        return node.as_floating_point()->get();
      case toml::node_type::date:
        return text_of(node.as_date()->get());
      case toml::node_type::time:
        return text_of(node.as_time()->get());
      case toml::node_type::date_time:
        return text_of(node.as_date_time()->get());
      case toml::node_type::none:
        break;
    }
    refuse(node, "a value of no type", "a value");
  }

 private:
  template <class T>
  static std::string text_of(const T& value) {
    std::ostringstream stream;
    stream.exceptions(std::ios::badbit);  // or it would swallow that memory runs out
    stream << value;
    return stream.str();
  }

  const std::string& check_string(const toml::node& node, const std::string& text) const {
    if (static_cast<std::int64_t>(text.size()) > limits_.text_string_bytes) {
      refuse(node, "a string of " + std::to_string(text.size()) + " bytes",
             "at most " + std::to_string(limits_.text_string_bytes) + " bytes");
    }
    return text;
  }

  [[noreturn]] void refuse(const toml::node& node, const std::string& found,
                           const std::string& expected) const {
    const toml::source_position& begin = node.source().begin;
    throw DataError(file_, place(begin.line, begin.column), found, expected);
  }

  const std::string& file_;
  const Limits& limits_;
  bool nan_;
};

void collect_lines(const toml::node& node, const std::string& path,
                   std::map<std::string, int>& lines) {
  if (!path.empty()) {
    lines[path] = static_cast<int>(node.source().begin.line);
  }
  const std::string prefix = path.empty() ? "" : path + ".";
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      collect_lines(value, prefix + std::string(key.str()), lines);
    }
  } else if (const toml::array* array = node.as_array()) {
    for (std::size_t i = 0; i < array->size(); ++i) {
      collect_lines((*array)[i], prefix + std::to_string(i), lines);
    }
  }
}

}  // namespace

void check_toml_nesting(std::string_view text, const std::string& file, const Limits& limits) {
  if (static_cast<std::int64_t>(text.size()) > limits.text_file_bytes) {
    throw DataError(file, "", std::to_string(text.size()) + " bytes of TOML",
                    "at most " + std::to_string(limits.text_file_bytes) + " bytes");
  }
  // Before what is counted: of a file of another kind its brackets say nothing.
  if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos) {
    const std::size_t lines = static_cast<std::size_t>(
        std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(nul), '\n'));
    throw DataError(file, "line " + std::to_string(lines + 1), "a NUL byte, which no text has",
                    "TOML");
  }
  DepthCheck(text, file, limits).run();
}

nlohmann::json parse_toml(std::string_view text, const std::string& file, const Limits& limits) {
  return Converter(file, limits).convert(parse_table(text, file, limits), 0);
}

nlohmann::json parse_python_toml(std::string_view text, const std::string& file,
                                 const Limits& limits) {
  return Converter(file, limits, true).convert(parse_table(text, file, limits), 0);
}

nlohmann::json read_toml(const std::filesystem::path& path, const Limits& limits) {
  return parse_toml(read_file_text(path, limits.text_file_bytes), path.string(), limits);
}

std::map<std::string, int> toml_lines(std::string_view text, const std::string& file,
                                      const Limits& limits) {
  std::map<std::string, int> lines;
  collect_lines(parse_table(text, file, limits), "", lines);
  return lines;
}

}  // namespace atelier
