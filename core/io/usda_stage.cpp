#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/io/plain_text.h"
#include "core/io/text_scanner.h"
#include "core/io/usd_stage.h"
#include "core/io/usd_text.h"

namespace atelier {
namespace {

constexpr std::string_view kOpening = "([{";
constexpr std::string_view kClosing = ")]}";

bool begins_refers(std::string_view key) {
  return key == "references" || key == "payload" || key == "inherits" || key == "specializes" ||
         key == "variants" || key == "variantSets";
}

/// Walks over a layer that parse_usda has found sound in its brackets and quotes.
class UsdaStageReader {
 public:
  UsdaStageReader(std::string_view text, const std::string& file, const Limits& limits)
      : text_(text), file_(file), limits_(limits) {}

  UsdStage read() {
    at_ = std::min(text_.find('\n'), text_.size());  // #usda 1.0
    double frames_a_second = 0;
    double codes_a_second = 0;
    metadata([&](std::string_view key) {
      if (key == "metersPerUnit") {
        stage_.metres_per_unit = positive(key);
      } else if (key == "framesPerSecond") {
        frames_a_second = positive(key);
      } else if (key == "timeCodesPerSecond") {
        codes_a_second = positive(key);
      } else if (key == "upAxis") {
        stage_.up = value().texts == std::vector<std::string>{"Z"} ? 'z' : 'y';
      } else {
        stage_.sublayers = stage_.sublayers || key == "subLayers";
        skip_value();
      }
    });
    stage_.fps = codes_a_second > 0    ? codes_a_second
                 : frames_a_second > 0 ? frames_a_second
                                       : stage_.fps;
    while (peek() != '\0') {
      statement();
    }
    if (!open_.empty()) {
      fail("the end of the text", "'}'");
    }
    return std::move(stage_);
  }

 private:
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw DataError(file_, line_at(text_, std::min(at_, text_.size())), found, expected);
  }

  /// The next character that is neither blank nor of a comment; NUL at the end.
  char peek() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ';' || c == ',') {
        ++at_;
      } else {
        return c;
      }
    }
    return '\0';
  }

  bool take(char c) {
    const bool there = peek() == c;
    at_ += there ? 1 : 0;
    return there;
  }

  static bool is_in_word(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == ':' || c == '.' || c == '-' || c == '+' || static_cast<unsigned char>(c) > 127;
  }

  /// Letters, digits and what joins them; "" before anything else.
  std::string_view word() {
    peek();
    const std::size_t begin = at_;
    while (at_ < text_.size() && is_in_word(text_[at_])) {
      ++at_;
    }
    return text_.substr(begin, at_ - begin);
  }

  std::string_view word_of(const char* what) {
    const std::string_view found = word();
    if (found.empty()) {
      fail(in_quotes(text_.substr(std::min(at_, text_.size()), 1)), what);
    }
    return found;
  }

  bool at_quote() {
    const char c = peek();
    return c == '"' || c == '\'';
  }

  std::string_view quoted() {
    if (!at_quote()) {
      fail(in_quotes(text_.substr(std::min(at_, text_.size()), 1)), "a text in quotes");
    }
    const char quote = text_[at_];
    const std::string thrice(3, quote);
    const std::string mark = text_.substr(at_).starts_with(thrice) ? thrice : std::string(1, quote);
    const std::size_t begin = at_ + mark.size();
    for (at_ = begin; at_ < text_.size(); ++at_) {
      if (text_[at_] == '\\') {
        ++at_;
      } else if (text_.substr(at_).starts_with(mark)) {
        const std::string_view found = text_.substr(begin, at_ - begin);
        at_ += mark.size();
        return found;
      }
    }
    fail("a text in quotes that does not close", mark);
  }

  void skip_past(std::string_view mark) {
    const std::size_t end = text_.find(mark, at_ + mark.size());
    if (end == std::string_view::npos) {
      fail("the end of the text", "'" + std::string(mark) + "'");
    }
    at_ = end + mark.size();
  }

  /// One value, into `target` where there is one: numbers and texts of all brackets, one behind the
  /// other. Values of dictionaries are passed over.
  void read_value(UsdValue* target) {
    std::size_t depth = 0;
    do {
      const char c = peek();
      if (c == '\0') {
        fail("the end of the text", "a value");
      }
      if (kOpening.find(c) != std::string_view::npos) {
        target = c == '{' ? nullptr : target;
        ++depth;
        ++at_;
      } else if (kClosing.find(c) != std::string_view::npos) {
        if (depth == 0) {
          fail(in_quotes(text_.substr(at_, 1)), "a value");
        }
        --depth;
        ++at_;
      } else if (c == '"' || c == '\'') {
        const std::string_view text = quoted();
        if (target != nullptr) {
          target->texts.emplace_back(text);
        }
      } else if (c == '@') {
        skip_past(text_.substr(at_).starts_with("@@@") ? "@@@" : "@");
      } else if (c == '<') {
        skip_past(">");
      } else if (is_in_word(c)) {
        add_word(word(), target);
      } else {
        ++at_;  // "=" and the like in a dictionary
      }
    } while (depth > 0);
  }

  void add_word(std::string_view found, UsdValue* target) {
    double number = std::nan("");
    const bool no_number = !parse_number(found, number) && found != "nan" && found != "inf" &&
                           found != "-inf" && found != "-nan";
    if (target == nullptr || no_number) {
      return;  // None, true, the name of a type
    }
    if (static_cast<double>(++kept_) > static_cast<double>(limits_.tensor_bytes) / 8) {
      fail("more numbers than the limits allow", "a smaller scene");
    }
    target->numbers.push_back(number);
  }

  UsdValue value() {
    UsdValue result;
    read_value(&result);
    return result;
  }

  /// The text has quaternions as (w, x, y, z); binary layers, and we, have w last.
  UsdValue typed_value(std::string_view type) {
    UsdValue result = value();
    for (std::size_t i = 0; type.starts_with("quat") && i + 4 <= result.numbers.size(); i += 4) {
      const auto first = result.numbers.begin() + static_cast<std::ptrdiff_t>(i);
      std::rotate(first, first + 1, first + 4);
    }
    return result;
  }

  void skip_value() { read_value(nullptr); }

  double positive(std::string_view key) {
    const std::vector<double> numbers = value().numbers;
    if (numbers.size() != 1 || !(numbers[0] > 0) || !std::isfinite(numbers[0])) {
      fail(std::string(key) + " that is no number above 0", "one");
    }
    return numbers[0];
  }

  /// What stands in parentheses, if they are next: `on_value(key)` takes the value of each key.
  template <class OnValue>
  void metadata(const OnValue& on_value) {
    if (!take('(')) {
      return;
    }
    while (!take(')')) {
      if (at_quote()) {
        quoted();  // a comment
        continue;
      }
      if (peek() == '<' || peek() == '(') {
        skip_value();  // the prim and the offset behind the layer of a reference
        continue;
      }
      const std::string_view key = word_of("a key or ')'");
      if (take('=')) {
        on_value(key);
      }
    }
  }

  UsdPrim& prim() { return stage_.prims[static_cast<std::size_t>(open_.back())]; }

  void statement() {
    if (take('}')) {
      if (open_.empty()) {
        fail("'}'", "def, over or class");
      }
      open_.pop_back();
      return;
    }
    const std::string_view first = word_of("def, over, class, an attribute or '}'");
    if (first == "def" || first == "over" || first == "class") {
      begin_prim(first == "def");
    } else if (first == "reorder") {
      word();
      if (take('=')) {
        skip_value();
      }
    } else if (open_.empty()) {
      fail(in_quotes(first), "def, over or class");
    } else if (first == "variantSet") {
      prim().refers = true;
      quoted();
      if (take('=')) {
        skip_value();
      }
    } else if (first == "rel") {
      word_of("the name of a relationship");
      if (take('=')) {
        skip_value();
      }
      metadata([&](std::string_view) { skip_value(); });
    } else if (first != "custom" && first != "uniform" && first != "varying" && first != "config" &&
               first != "prepend" && first != "append" && first != "add" && first != "delete") {
      attribute(first);
    }
  }

  void begin_prim(bool defined) {
    UsdPrim next;
    next.parent = open_.empty() ? -1 : open_.back();
    next.defined = defined;
    next.type = word();
    next.name = quoted();
    metadata([&](std::string_view key) {
      next.refers = next.refers || begins_refers(key);
      if (key == "active") {
        const std::string_view yes = word();
        next.defined = next.defined && yes != "false" && yes != "0";
      } else {
        skip_value();
      }
    });
    if (!take('{')) {
      fail("no '{' behind the prim " + in_quotes(next.name), "'{'");
    }
    open_.push_back(static_cast<int>(stage_.prims.size()));
    stage_.prims.push_back(std::move(next));
  }

  /// `type` is read: what follows are "[]", a name, a value or samples, and what is said of it.
  void attribute(std::string_view type) {
    if (take('[') && !take(']')) {
      fail("a '[' behind a type", "']'");
    }
    std::string name(word_of("the name of an attribute"));
    const std::size_t dot = name.find('.');
    const std::string part = dot == std::string::npos ? "" : name.substr(dot + 1);
    name.resize(std::min(dot, name.size()));
    prim().skinned = prim().skinned || name == "primvars:skel:jointIndices";
    const bool uvs = name.starts_with("primvars:") &&
                     (name.ends_with(":indices") || type.starts_with("texCoord2"));
    const bool wanted = uvs || is_usd_mesh_attribute(name);
    UsdAttribute unwanted;
    UsdAttribute& target = wanted ? prim().attributes[name] : unwanted;
    if (take('=')) {
      if (!wanted || (!part.empty() && part != "timeSamples")) {
        skip_value();
      } else if (part.empty()) {
        target.value = typed_value(type);
        target.has_value = !target.value.numbers.empty() || !target.value.texts.empty();
      } else {
        samples(type, target);
      }
    }
    metadata([&](std::string_view key) {
      const std::vector<std::string> texts = value().texts;
      if (key == "interpolation" && !texts.empty()) {
        target.interpolation = texts.front();
      }
    });
    if (wanted && !target.has_value && target.times.empty()) {
      prim().attributes.erase(name);  // declared, or blocked
    }
  }

  /// "{ time: value, ... }", in any order.
  void samples(std::string_view type, UsdAttribute& target) {
    if (!take('{')) {
      fail("time samples without '{'", "'{'");
    }
    std::vector<std::pair<double, UsdValue>> all;
    while (!take('}')) {
      std::string_view time = word_of("a time or '}'");
      if (const std::size_t colon = time.find(':'); colon != std::string_view::npos) {
        at_ -= time.size() - colon - 1;  // a value may follow at once
        time = time.substr(0, colon);
      } else if (!take(':')) {
        fail("no ':' behind the time " + in_quotes(time), "':'");
      }
      double number = 0;
      if (!parse_number(time, number)) {
        fail("the time " + in_quotes(time), "a number");
      }
      if (std::cmp_greater_equal(all.size(), limits_.frames)) {
        fail("more samples", "at most " + std::to_string(limits_.frames));
      }
      all.emplace_back(number, typed_value(type));
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& [time, sample] : all) {
      if (!target.times.empty() && target.times.back() == time) {
        fail("the time " + std::to_string(time) + " twice", "each time once");
      }
      target.times.push_back(time);
      target.samples.push_back(std::move(sample));
    }
  }

  std::string_view text_;
  const std::string& file_;
  const Limits& limits_;
  UsdStage stage_;
  std::vector<int> open_;  ///< prims whose '}' is to come
  std::size_t at_ = 0;
  std::int64_t kept_ = 0;
};

}  // namespace

UsdStage read_usda_stage(std::string_view text, const std::string& file, const Limits& limits) {
  parse_usda(text, file);
  return UsdaStageReader(text, file, limits).read();
}

}  // namespace atelier
