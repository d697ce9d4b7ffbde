#include "core/io/usd_text.h"

#include <algorithm>

#include "core/error.h"
#include "core/io/plain_text.h"
#include "core/io/text_scanner.h"
#include "core/printable.h"

namespace atelier {
namespace {

constexpr std::string_view kHeader = "#usda ";

/// Our choice: rigs nest a prim for each joint of a chain, and no file a thousand.
constexpr std::size_t kDeepest = 1000;

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == ':' || c == '.' || c == '-' || c == '+';
}

bool is_usd_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

bool is_no_finite_number(std::string_view word) {
  const bool sign = word.starts_with('-') || word.starts_with('+');
  const std::string_view plain = word.substr(sign ? 1 : 0);
  return plain == "nan" || plain == "inf";
}

char closing(char opening) {
  return opening == '(' ? ')' : opening == '[' ? ']' : '}';
}

class UsdParser {
 public:
  UsdParser(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  UsdLayer parse() {
    header();
    while (at_ < text_.size()) {
      token();
    }
    if (!open_.empty()) {
      at_ = open_.back();
      fail("a '" + std::string(1, text_[at_]) + "' that does not close",
           std::string("'") + closing(text_[at_]) + "'");
    }
    if (expected_ != Expected::Anything) {
      fail("the end of the text", "the rest of the prim that begins here");
    }
    if (not_finite_ > 0) {
      layer_.findings.push_back({Severity::Warning, "usd-not-finite",
                                 line_at(text_, first_not_finite_),
                                 counted(not_finite_, "number") + " not finite",
                                 "programs draw such meshes nowhere; write the scene again"});
    }
    if (layer_.first_frame && layer_.last_frame && *layer_.last_frame < *layer_.first_frame) {
      layer_.findings.push_back({Severity::Warning, "usd-time", "startTimeCode",
                                 "the last frame is before the first", "endTimeCode behind it"});
    }
    return std::move(layer_);
  }

 private:
  /// Tokens that may come next between prims.
  enum class Expected { Anything, TypeOrName, Body, ReorderedNames };

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw DataError(file_, line_at(text_, at_), found, expected);
  }

  std::string_view rest() const { return text_.substr(at_); }

  void header() {
    at_ = std::min(text_.find('\n'), text_.size());
    const std::string_view version = trimmed_text(text_.substr(0, at_).substr(kHeader.size()));
    double number = 0;
    if (!parse_number(version, number) || number < 1 || number >= 2) {
      throw DataError(file_, "line 1", "version " + in_quotes(version), "#usda 1.0");
    }
  }

  void token() {
    const char c = text_[at_];
    if (is_usd_blank(c) || (c == '=' && expected_ == Expected::ReorderedNames)) {
      ++at_;
    } else if (c == '#') {
      at_ = std::min(text_.find('\n', at_), text_.size());
    } else {
      part(c);
      before_ = text_[at_ - 1];
    }
  }

  /// Takes what is neither blank nor a comment.
  void part(char c) {
    if (c == '"' || c == '\'') {
      name(string());
    } else if (c == '@') {
      inside("asset name");
      skip_past(rest().starts_with("@@@") ? "@@@" : "@", rest().starts_with("@@@"));
    } else if (c == '<') {
      inside("path");
      skip_past(">", false);
    } else if (c == '(' || c == '[' || c == '{') {
      opens(c);
    } else if (c == ')' || c == ']' || c == '}') {
      closes(c);
    } else if (is_word(c)) {
      std::size_t end = at_;
      while (end < text_.size() && is_word(text_[end])) {
        ++end;
      }
      word(text_.substr(at_, end - at_), end);
      at_ = end;
    } else if (c == '=' && in_layer() && open_.size() == 1) {
      said_of_layer();
    } else {
      inside(in_quotes(text_.substr(at_, 1)));
      ++at_;
    }
  }

  void inside(const std::string& what) const {
    if (open_.empty()) {
      fail(what + " outside of a prim", "def, over or class");
    }
  }

  bool in_layer() const { return !open_.empty() && open_.front() == layer_begin_; }

  void opens(char c) {
    if (open_.empty()) {
      const bool layer = c == '(' && expected_ == Expected::Anything && layer_.prims == 0 &&
                         layer_begin_ == std::string_view::npos;
      const bool names = c == '[' && expected_ == Expected::ReorderedNames;
      const bool of_prim = c != '[' && expected_ == Expected::Body;
      if (!layer && !names && !of_prim) {
        fail("a '" + std::string(1, c) + "' outside of a prim", "def, over or class");
      }
      layer_begin_ = layer ? at_ : layer_begin_;
    }
    if (open_.size() >= kDeepest) {
      fail("brackets in brackets", "at most " + std::to_string(kDeepest) + " deep");
    }
    open_.push_back(at_);
    ++at_;
  }

  void closes(char c) {
    if (open_.empty() || closing(text_[open_.back()]) != c) {
      fail("'" + std::string(1, c) + "'", open_.empty()
                                              ? "a bracket that opens before it"
                                              : std::string("'") + closing(text_[open_.back()]) +
                                                    "' for " + line_at(text_, open_.back()));
    }
    open_.pop_back();
    const bool of_prim = open_.empty() && c == '}';
    const bool of_names = open_.empty() && c == ']';
    expected_ = of_prim || of_names ? Expected::Anything : expected_;
    ++at_;
  }

  /// The text between quotes; leaves what is behind them.
  std::string_view string() {
    const char quote = text_[at_];
    const std::size_t count = rest().starts_with(std::string(3, quote)) ? 3 : 1;
    for (std::size_t end = at_ + count; end < text_.size(); ++end) {
      if (text_[end] == '\\') {
        ++end;
      } else if (text_[end] == '\n' && count == 1) {
        break;
      } else if (text_.substr(end).starts_with(std::string(count, quote))) {
        const std::string_view value = text_.substr(at_ + count, end - at_ - count);
        at_ = end + count;
        return value;
      }
    }
    fail("a text in quotes that does not close", std::string(count, quote));
  }

  void skip_past(std::string_view mark, bool over_lines) {
    const std::size_t end = text_.find(mark, at_ + mark.size());
    const std::size_t newline = over_lines ? std::string_view::npos : text_.find('\n', at_);
    if (end == std::string_view::npos || newline < end) {
      fail("a '" + std::string(1, text_[at_]) + "' that does not close",
           "'" + std::string(mark) + "'");
    }
    at_ = end + mark.size();
  }

  /// A text in quotes between prims is the name of one.
  void name(std::string_view value) {
    if (!open_.empty()) {
      return;
    }
    if (expected_ != Expected::TypeOrName || value.empty()) {
      fail("a name, " + in_quotes(value), "def, over or class before it");
    }
    expected_ = Expected::Body;
    ++layer_.prims;
  }

  void word(std::string_view word, std::size_t end) {
    if (!open_.empty()) {
      if (is_no_finite_number(word) && is_value(end)) {
        first_not_finite_ = not_finite_ == 0 ? at_ : first_not_finite_;
        ++not_finite_;
      }
      last_word_ = word;
      return;
    }
    if (expected_ == Expected::Anything && (word == "def" || word == "over" || word == "class")) {
      expected_ = Expected::TypeOrName;
    } else if (expected_ == Expected::Anything && word == "reorder") {
      expected_ = Expected::ReorderedNames;
    } else if (expected_ != Expected::TypeOrName && expected_ != Expected::ReorderedNames) {
      fail(in_quotes(word), expected_ == Expected::Body ? "'{'" : "def, over or class");
    }
  }

  /// Whether the word that ends at `end` stands where a value does: attributes may have the names
  /// `inf` and `nan`, behind their type or before "=".
  bool is_value(std::size_t end) const {
    while (end < text_.size() && is_usd_blank(text_[end])) {
      ++end;
    }
    const bool named = end < text_.size() && text_[end] == '=';
    return !named && std::string_view("=,[(:").find(before_) != std::string_view::npos;
  }

  /// name = value, of the whole layer.
  void said_of_layer() {
    const std::string_view key = last_word_;
    const auto value_of = [&]() {
      return trimmed_text(rest().substr(1, rest().find_first_of("\n;)#") - 1));
    };
    const auto number = [&](std::optional<double>& target, bool positive) {
      double value = 0;
      const std::string_view word = value_of();
      if (!parse_number(word, value) || (positive && value <= 0)) {
        fail(std::string(key) + " = " + in_quotes(word),
             positive ? "a finite number above 0" : "a finite number");
      }
      target = value;
    };
    if (key == "metersPerUnit") {
      number(layer_.metres_per_unit, true);
    } else if (key == "framesPerSecond") {
      number(layer_.fps, true);
    } else if (key == "startTimeCode") {
      number(layer_.first_frame, false);
    } else if (key == "endTimeCode") {
      number(layer_.last_frame, false);
    } else if (key == "upAxis") {
      const std::string_view axis = value_of();
      if (axis != "\"Y\"" && axis != "\"Z\"" && axis != "'Y'" && axis != "'Z'") {
        fail("upAxis = " + in_quotes(axis), "\"Y\" or \"Z\"");
      }
      layer_.up_axis = axis.substr(1, 1);
    }
    ++at_;  // the value's brackets and quotes count
  }

  std::string_view text_;
  const std::string& file_;
  UsdLayer layer_;
  std::size_t at_ = 0;
  std::vector<std::size_t> open_;  ///< where brackets stand that are open
  std::size_t layer_begin_ = std::string_view::npos;
  Expected expected_ = Expected::Anything;
  std::string_view last_word_;
  char before_ = ' ';  ///< the last character that is neither blank nor of a comment
  std::int64_t not_finite_ = 0;
  std::size_t first_not_finite_ = 0;
};

}  // namespace

UsdLayer parse_usda(std::string_view text, const std::string& file) {
  if (!text.starts_with(kHeader)) {
    throw DataError(file, "beginning", beginning_of(text), "a scene as USD text, #usda 1.0");
  }
  check_plain_text(text, file);
  return UsdParser(text, file).parse();
}

}  // namespace atelier
