#include "core/io/xml_elements.h"

#include <algorithm>
#include <charconv>

#include "core/error.h"
#include "core/io/text_scanner.h"
#include "core/utf8.h"

namespace atelier {
namespace {

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

/// Letters beyond ASCII are all taken: XML leaves few characters there out.
bool begins_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == ':' ||
         static_cast<unsigned char>(c) >= 0x80;
}

bool is_name(char c) {
  return begins_name(c) || (c >= '0' && c <= '9') || c == '-' || c == '.';
}

/// "&#181;" or "&#xB5;" at the beginning: a character that XML has.
bool is_number_of_character(std::string_view text) {
  if (!text.starts_with("&#")) {
    return false;
  }
  const bool hexadecimal = text.substr(2).starts_with("x");
  text = text.substr(hexadecimal ? 3 : 2);
  const std::size_t end = text.find(';');
  std::uint32_t code = 0;
  const char* last = text.data() + std::min(end, text.size());
  const auto [stop, error] = std::from_chars(text.data(), last, code, hexadecimal ? 16 : 10);
  const bool control = code < 32 && code != 9 && code != 10 && code != 13;
  const bool surrogate = code >= 0xD800 && code < 0xE000;
  return end != std::string_view::npos && error == std::errc() && stop == last && !control &&
         !surrogate && code <= 0x10FFFF;
}

struct Entity {
  std::string_view reference;
  char character;
};
constexpr Entity kEntities[] = {
    {"&lt;", '<'}, {"&gt;", '>'}, {"&amp;", '&'}, {"&quot;", '"'}, {"&apos;", '\''}};

/// The one of the five of XML that a text begins with; null for none.
const Entity* entity_of(std::string_view text) {
  const auto found = std::ranges::find_if(
      kEntities, [&](const Entity& entity) { return text.starts_with(entity.reference); });
  return found == std::end(kEntities) ? nullptr : found;
}

class XmlParser {
 public:
  XmlParser(std::string_view text, const std::string& file, const Limits& limits)
      : text_(text), file_(file), limits_(limits) {}

  std::vector<XmlElement> parse() {
    if (text_.starts_with("\xef\xbb\xbf")) {
      at_ = 3;
    }
    skip_declaration();
    while (skip_to_tag()) {
      if (rest().starts_with("<?")) {
        skip_instruction();
      } else if (rest().starts_with("<!--")) {
        skip_comment();
      } else if (rest().starts_with("<![CDATA[") && !open_.empty()) {
        skip_past("]]>");
      } else if (rest().starts_with("<!DOCTYPE") && elements_.empty()) {
        skip_doctype();
      } else if (rest().starts_with("<!")) {
        fail(in_quotes(rest().substr(0, 12)), "elements");
      } else if (rest().starts_with("</")) {
        end_tag();
      } else {
        begin_tag();
      }
    }
    if (!open_.empty()) {
      fail("the end of the text", "</" + open_.back() + ">");
    }
    if (elements_.empty()) {
      fail("no element", "XML");
    }
    return std::move(elements_);
  }

 private:
  std::string_view rest() const { return text_.substr(at_); }

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    const auto lines =
        1 + std::count(text_.begin(),
                       text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size())),
                       '\n');
    throw DataError(file_, "line " + std::to_string(lines), found, expected);
  }

  /// <?xml ...?>, which may stand at the beginning alone. The encodings that it can name other than
  /// UTF-8 have the same ASCII, and what is beyond it is not looked into.
  void skip_declaration() {
    bool utf8 = true;
    if (rest().starts_with("<?xml") && rest().size() > 5 && is_space(rest()[5])) {
      const std::size_t begin = at_;
      skip_past("?>");
      std::string said(text_.substr(begin, at_ - begin));
      std::ranges::transform(said, said.begin(), [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
      });
      utf8 = said.find("encoding") == std::string::npos || said.find("utf-8") != std::string::npos;
    }
    const std::size_t malformed = utf8 ? find_malformed_utf8(text_) : std::string_view::npos;
    if (malformed != std::string_view::npos) {
      at_ = malformed;
      fail("bytes that are no UTF-8", "UTF-8, or the encoding in <?xml ...?>");
    }
  }

  void skip_instruction() {
    const std::string_view target = rest().substr(2, 4);
    const bool is_xml = target.size() == 4 && (target[0] | 0x20) == 'x' &&
                        (target[1] | 0x20) == 'm' && (target[2] | 0x20) == 'l' &&
                        !is_name(target[3]);
    if (is_xml || target.empty() || !begins_name(target[0])) {
      fail(in_quotes(rest().substr(0, 12)), "<?xml at the beginning alone, others with a name");
    }
    skip_past("?>");
  }

  void skip_comment() {
    constexpr std::size_t kBegin = 4;  // "<!--"
    const std::size_t end = text_.find("--", at_ + kBegin);
    if (end == std::string_view::npos) {
      fail("no -->", "the end of what began here");
    }
    if (!text_.substr(end).starts_with("-->")) {
      at_ = end;
      fail("-- in a comment", "--> alone");
    }
    advance(end + 3);
  }

  /// Checks the text between tags: no "&" that begins no reference, and no end of a CDATA.
  void check_text(std::size_t end) {
    const std::string_view text = text_.substr(0, end);
    for (std::size_t i = at_; (i = text.find_first_of("&]", i)) < end; ++i) {
      const std::string_view here = text.substr(i);
      const bool reference = entity_of(here) != nullptr || is_number_of_character(here);
      if (here[0] == '&' ? !reference : here.starts_with("]]>")) {
        at_ = i;
        fail(in_quotes(here.substr(0, 12)), "&amp; or a reference of XML; ]]&gt;");
      }
    }
  }

  bool skip_to_tag() {
    const std::size_t tag = text_.find('<', at_);
    if (tag == std::string_view::npos) {
      if (open_.empty() &&
          !std::all_of(text_.begin() + static_cast<std::ptrdiff_t>(at_), text_.end(), is_space)) {
        fail("text behind the last element", "the end");
      }
      at_ = text_.size();
      return false;
    }
    if (open_.empty() && !std::all_of(text_.begin() + static_cast<std::ptrdiff_t>(at_),
                                      text_.begin() + static_cast<std::ptrdiff_t>(tag), is_space)) {
      fail("text outside of elements", "XML");
    }
    check_text(tag);
    if (just_opened_) {
      elements_.back().text = resolved(without_blanks(text_.substr(at_, tag - at_)));
      just_opened_ = false;
    }
    advance(tag);
    return true;
  }

  static std::string_view without_blanks(std::string_view text) {
    while (!text.empty() && is_space(text.front())) {
      text.remove_prefix(1);
    }
    while (!text.empty() && is_space(text.back())) {
      text.remove_suffix(1);
    }
    return text;
  }

  void skip_past(std::string_view end) {
    const std::size_t found = text_.find(end, at_);
    if (found == std::string_view::npos) {
      fail("no " + std::string(end), "the end of what began here");
    }
    advance(found + end.size());
  }

  /// One that only names the kind of text; what it could declare (entities) is not expanded here,
  /// so that a text with it would not be read as it is meant.
  void skip_doctype() {
    const std::size_t end = text_.find_first_of("[>", at_);
    if (end == std::string_view::npos || text_[end] == '[') {
      fail(in_quotes(rest().substr(0, 12)), "elements, without DOCTYPE that declares");
    }
    advance(end + 1);
  }

  void advance(std::size_t to) {
    line_ += std::count(text_.begin() + static_cast<std::ptrdiff_t>(at_),
                        text_.begin() + static_cast<std::ptrdiff_t>(to), '\n');
    at_ = to;
  }

  /// @return  whether there was any
  bool skip_space() {
    std::size_t to = at_;
    while (to < text_.size() && is_space(text_[to])) {
      ++to;
    }
    const bool any = to > at_;
    advance(to);
    return any;
  }

  std::string name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (at_ == begin ? begins_name : is_name)(text_[at_])) {
      ++at_;
    }
    check_length(at_ - begin);
    if (at_ == begin) {
      fail(rest().empty() ? "the end of the text" : in_quotes(rest().substr(0, 12)), "a name");
    }
    return std::string(text_.substr(begin, at_ - begin));
  }

  void check_length(std::size_t bytes) const {
    if (static_cast<std::int64_t>(bytes) > limits_.text_string_bytes) {
      fail("a text of " + std::to_string(bytes) + " bytes",
           "at most " + std::to_string(limits_.text_string_bytes));
    }
  }

  std::string value() {
    const char quote = at_ < text_.size() ? text_[at_] : '\0';
    if (quote != '"' && quote != '\'') {
      fail("a value without quotes", "\"...\"");
    }
    const std::size_t end = text_.find(quote, at_ + 1);
    if (end == std::string_view::npos) {
      fail("a value in quotes that does not end", std::string(1, quote));
    }
    const std::string_view raw = text_.substr(at_ + 1, end - at_ - 1);
    check_length(raw.size());
    if (raw.find_first_of(std::string_view("<\0", 2)) != std::string_view::npos) {
      fail("'<' or NUL in a value", "&lt;");
    }
    std::string result = resolved(raw);
    advance(end + 1);
    return result;
  }

  /// The characters that the five entities stand for; those by number stay as they stand there.
  std::string resolved(std::string_view raw) const {
    std::string result;
    for (std::size_t i = 0; i < raw.size(); ++i) {
      if (raw[i] != '&') {
        result += raw[i];
        continue;
      }
      if (const Entity* entity = entity_of(raw.substr(i))) {
        result += entity->character;
        i += entity->reference.size() - 1;
      } else if (is_number_of_character(raw.substr(i))) {
        const std::size_t semicolon = raw.find(';', i);
        result += raw.substr(i, semicolon + 1 - i);  // as it stands there
        i = semicolon;
      } else {
        fail("the entity " + in_quotes(raw.substr(i, 12)), "one of the five of XML");
      }
    }
    return result;
  }

  void begin_tag() {
    XmlElement element;
    element.line = line_;
    ++at_;
    element.name = name();
    if (open_.empty() && !elements_.empty()) {
      fail("a second root, <" + element.name.substr(0, 40) + ">", "one");
    }
    element.depth = static_cast<int>(open_.size());
    if (element.depth >= limits_.text_depth ||
        static_cast<std::int64_t>(elements_.size()) + attributes_ >= limits_.text_values) {
      fail("too many elements or too deep", "at most " + std::to_string(limits_.text_depth) +
                                                " levels and " +
                                                std::to_string(limits_.text_values) + " elements");
    }
    for (;;) {
      const bool apart = skip_space();
      if (rest().starts_with("/>")) {
        advance(at_ + 2);
        break;
      }
      if (rest().starts_with(">")) {
        advance(at_ + 1);
        open_.push_back(element.name);
        just_opened_ = true;
        break;
      }
      if (rest().empty()) {
        fail("the end of the text", "<" + element.name.substr(0, 40) + " ...>");
      }
      if (!apart) {
        fail(in_quotes(rest().substr(0, 12)) + " without a blank before it", "a blank, > or />");
      }
      if (static_cast<std::int64_t>(elements_.size()) + ++attributes_ > limits_.text_values) {
        fail("too many attributes",
             "at most " + std::to_string(limits_.text_values) + " with the elements");
      }
      const std::string key = name();
      skip_space();
      if (!rest().starts_with("=")) {
        fail("the attribute " + in_quotes(key) + " without a value", "= and a value");
      }
      ++at_;
      skip_space();
      if (!element.attributes.emplace(key, value()).second) {
        fail("the attribute " + in_quotes(key) + " a second time", "each once");
      }
    }
    elements_.push_back(std::move(element));
  }

  void end_tag() {
    at_ += 2;
    const std::string closed = name();
    if (open_.empty() || open_.back() != closed) {
      fail("</" + closed.substr(0, 40) + ">",
           open_.empty() ? "nothing" : "</" + open_.back() + ">");
    }
    open_.pop_back();
    skip_space();
    if (!rest().starts_with(">")) {
      fail("more in an end tag", ">");
    }
    advance(at_ + 1);
  }

  std::string_view text_;
  const std::string& file_;
  const Limits& limits_;
  std::size_t at_ = 0;
  std::int64_t line_ = 1;
  std::int64_t attributes_ = 0;  ///< of all elements
  bool just_opened_ = false;     ///< the last element, and nothing has followed its tag
  std::vector<std::string> open_;
  std::vector<XmlElement> elements_;
};

}  // namespace

std::vector<XmlElement> parse_xml_elements(std::string_view text, const std::string& file,
                                           const Limits& limits) {
  if (static_cast<std::int64_t>(text.size()) > limits.text_file_bytes) {
    throw DataError(file, "", std::to_string(text.size()) + " bytes",
                    "at most " + std::to_string(limits.text_file_bytes));
  }
  return XmlParser(text, file, limits).parse();
}

}  // namespace atelier
