#include "core/io/json.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/error.h"
#include "core/io/file_bytes.h"

namespace atelier {
namespace {

/// Walks over the text and tells how far it is: the parser itself only says so in its own errors.
struct Cursor {
  // NOLINTBEGIN(readability-identifier-naming): the standard's names
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;
  // NOLINTEND(readability-identifier-naming)

  const char* at = nullptr;
  std::size_t* position = nullptr;

  reference operator*() const { return *at; }
  Cursor& operator++() {
    ++at;
    ++*position;
    return *this;
  }
  Cursor operator++(int) {
    Cursor before = *this;
    ++*this;
    return before;
  }
  bool operator==(const Cursor& other) const { return at == other.at; }
};

/// A word of Python's that is no JSON, and the number that stands in for it.
struct StandIn {
  std::string_view word;
  std::string_view number;
};
constexpr std::array<StandIn, 4> kStandIns = {
    {{"NaN", "0e0"}, {"-NaN", "-0e0"}, {"Infinity", "0e000000"}, {"-Infinity", "-0e000000"}}};

/// Builds the value while judging it: nothing is stored that a ceiling forbids.
class Builder : public nlohmann::json_sax<nlohmann::json> {
 public:
  Builder(std::string_view text, const std::string& file, const Limits& limits, bool stand_ins)
      : text_(text), file_(file), limits_(limits), stand_ins_(stand_ins) {}

  bool null() override { return add(nullptr); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(std::int64_t value) override { return add(value); }
  bool number_unsigned(std::uint64_t value) override { return add(value); }
  bool number_float(double value, const std::string& digits) override {
    const bool stands_in =
        stand_ins_ && std::any_of(kStandIns.begin(), kStandIns.end(),
                                  [&](const StandIn& one) { return one.number == digits; });
    return add(stands_in ? std::numeric_limits<double>::quiet_NaN() : value);
  }
  bool string(std::string& value) override {
    check_string(value);
    return add(std::move(value));
  }
  bool binary(nlohmann::json::binary_t&) override { return false; }  // never in JSON text

  bool start_object(std::size_t) override { return open(nlohmann::json::object()); }
  bool start_array(std::size_t) override { return open(nlohmann::json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(std::string& name) override {
    check_string(name);
    if (open_.back()->contains(name)) {
      refuse("the key \"" + shown(name) + "\" twice in one object", "each key once");
    }
    key_ = std::move(name);
    return true;
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& error) override {
    // "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error while ..."
    std::string reason = error.what();
    if (const std::size_t end = reason.find("] "); end != std::string::npos) {
      reason.erase(0, end + 2);
    }
    if (const std::size_t end = reason.find(": "); reason.starts_with("parse error at")) {
      reason.erase(0, end + 2);
    }
    std::string expected = "JSON text";
    if (const std::size_t end = reason.rfind("; expected "); end != std::string::npos) {
      expected = reason.substr(end + std::string_view("; expected ").size());
      reason.erase(end);
    }
    throw DataError(file_, place(position), "no valid JSON: " + shown(reason), shown(expected));
  }

  Cursor begin() { return {text_.data(), &position_}; }
  Cursor end() { return {text_.data() + text_.size(), &position_}; }
  nlohmann::json take() { return std::move(root_); }

 private:
  bool add(nlohmann::json value) {
    insert(std::move(value));
    return true;
  }

  bool open(nlohmann::json container) {
    if (static_cast<std::int64_t>(open_.size()) >= limits_.text_depth) {
      refuse("nesting deeper than " + std::to_string(limits_.text_depth), "flatter JSON");
    }
    open_.push_back(insert(std::move(container)));
    return true;
  }

  bool close() {
    open_.pop_back();
    return true;
  }

  /// Stores a value where the parser stands. Pointers to open containers stay valid: a container is
  /// only appended to while it is the innermost one.
  nlohmann::json* insert(nlohmann::json value) {
    if (++values_ > limits_.text_values) {
      refuse("more than " + std::to_string(limits_.text_values) + " values", "smaller JSON");
    }
    if (open_.empty()) {
      root_ = std::move(value);
      return &root_;
    }
    nlohmann::json& parent = *open_.back();
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    return &(parent[key_] = std::move(value));
  }

  void check_string(const std::string& value) const {
    if (static_cast<std::int64_t>(value.size()) > limits_.text_string_bytes) {
      refuse("a string of " + std::to_string(value.size()) + " bytes",
             "at most " + std::to_string(limits_.text_string_bytes) + " bytes");
    }
  }

  [[noreturn]] void refuse(const std::string& found, const std::string& expected) const {
    throw DataError(file_, place(position_), found, expected);
  }

  static std::string shown(const std::string& value) {
    constexpr std::size_t kLongest = 200;
    return value.size() <= kLongest ? value : value.substr(0, kLongest) + "...";
  }

  std::string place(std::size_t position) const {
    const std::string_view before = text_.substr(0, std::min(position, text_.size()));
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    const std::size_t start = before.rfind('\n');
    const std::size_t column =
        start == std::string_view::npos ? before.size() : before.size() - start - 1;
    return "line " + std::to_string(line) + ", column " + std::to_string(column);
  }

  std::string_view text_;
  const std::string& file_;
  const Limits& limits_;
  bool stand_ins_;
  std::size_t position_ = 0;
  nlohmann::json root_;
  std::vector<nlohmann::json*> open_;
  std::string key_;
  std::int64_t values_ = 0;
};

/// The text with numbers of the same length, which nobody writes, for NaN, Infinity and -Infinity
/// outside of strings: places in it stay.
std::string with_stand_ins(std::string_view text) {
  std::string result(text);
  bool quoted = false;
  for (std::size_t at = 0; at < result.size(); ++at) {
    const auto* pair = std::find_if(kStandIns.begin(), kStandIns.end(), [&](const StandIn& one) {
      return !quoted && text.substr(at, one.word.size()) == one.word;
    });
    if (pair != kStandIns.end()) {
      result.replace(at, pair->number.size(), pair->number);
      at += pair->number.size() - 1;
    } else if (quoted && text[at] == '\\') {
      ++at;
    } else {
      quoted = (text[at] == '"') != quoted;
    }
  }
  return result;
}

nlohmann::json parsed(std::string_view text, const std::string& file, const Limits& limits,
                      bool stand_ins) {
  // The parser would take a NUL byte for the end of the text.
  if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos) {
    throw DataError(file, "byte " + std::to_string(nul), "a NUL byte", "JSON text");
  }
  Builder builder(text, file, limits, stand_ins);
  nlohmann::json::sax_parse(builder.begin(), builder.end(), &builder);
  return builder.take();
}

void check_size(std::string_view text, const std::string& file, const Limits& limits) {
  if (static_cast<std::int64_t>(text.size()) > limits.text_file_bytes) {
    throw DataError(file, "", std::to_string(text.size()) + " bytes of JSON",
                    "at most " + std::to_string(limits.text_file_bytes) + " bytes");
  }
}

}  // namespace

nlohmann::json parse_json(std::string_view text, const std::string& file, const Limits& limits) {
  check_size(text, file, limits);
  return parsed(text, file, limits, false);
}

nlohmann::json parse_python_json(std::string_view text, const std::string& file,
                                 const Limits& limits) {
  check_size(text, file, limits);
  const bool any =
      text.find("NaN") != std::string_view::npos || text.find("Infinity") != std::string_view::npos;
  return any ? parsed(with_stand_ins(text), file, limits, true) : parsed(text, file, limits, false);
}

nlohmann::json read_json(const std::filesystem::path& path, const Limits& limits) {
  return parse_json(read_file_text(path, limits.text_file_bytes), path.string(), limits);
}

}  // namespace atelier
