#include "core/io/page_text.h"

#include <algorithm>
#include <cctype>

#include "core/error.h"
#include "core/io/plain_text.h"
#include "core/io/text_scanner.h"

namespace atelier {
namespace {

bool starts_with_any_case(std::string_view text, std::string_view lower) {
  return text.size() >= lower.size() &&
         std::equal(lower.begin(), lower.end(), text.begin(), [](char a, char b) {
           return a == static_cast<char>(std::tolower(static_cast<unsigned char>(b)));
         });
}

class HtmlParser {
 public:
  HtmlParser(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  HtmlPage parse() {
    skip_to_doctype();
    if (!starts_with_any_case(rest(), "<!doctype html") || rest().size() < 15 ||
        std::string_view("> \t\r\n").find(rest()[14]) == std::string_view::npos) {
      throw DataError(file_, "beginning", beginning_of(text_), "a page, <!doctype html>");
    }
    while ((at_ = text_.find('<', at_)) != std::string_view::npos) {
      if (rest().starts_with("<!--")) {
        at_ = end_of("-->", 4, "a comment");
      } else if (rest().size() > 1 && (std::isalpha(static_cast<unsigned char>(rest()[1])) != 0 ||
                                       rest()[1] == '/' || rest()[1] == '!')) {
        tag();
      } else {
        ++at_;  // a "<" of the text
      }
    }
    at_ = text_.size();
    if (html_) {
      fail("the end of the text", "</html>");
    }
    return std::move(page_);
  }

 private:
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw DataError(file_, line_at(text_, at_), found, expected);
  }

  std::string_view rest() const { return text_.substr(at_); }

  /// Past what HTML allows before it: a byte order mark, blanks, comments, and XHTML's <?xml ...?>,
  /// which HTML takes for a comment.
  void skip_to_doctype() {
    at_ = text_.starts_with("\xEF\xBB\xBF") ? 3 : 0;
    for (;;) {
      at_ = std::min(text_.find_first_not_of(" \t\r\n", at_), text_.size());
      if (rest().starts_with("<!--")) {
        at_ = end_of("-->", 4, "a comment");
      } else if (rest().starts_with("<?xml ")) {
        at_ = end_of(">", 2, "<?xml");
      } else {
        return;
      }
    }
  }

  /// Behind the next `mark`, whatever its case.
  std::size_t end_of(std::string_view mark, std::size_t from, const std::string& what) const {
    for (std::size_t end = text_.find(mark[0], at_ + from); end != std::string_view::npos;
         end = text_.find(mark[0], end + 1)) {
      if (starts_with_any_case(text_.substr(end), mark)) {
        return end + mark.size();
      }
    }
    fail(what + " that does not end", std::string(mark));
  }

  void tag() {
    const std::string_view name = rest().substr(1, rest().find_first_of(" \t\r\n/>", 2) - 1);
    std::size_t end = at_ + 1;
    for (; end < text_.size() && text_[end] != '>'; ++end) {
      const bool quote = (text_[end] == '"' || text_[end] == '\'') && text_[end - 1] == '=';
      if (quote) {
        end = text_.find(text_[end], end + 1);
        if (end == std::string_view::npos) {
          fail("a value in quotes that does not end", "a quote");
        }
      }
    }
    if (end >= text_.size()) {
      fail("a tag that does not end, " + in_quotes(rest().substr(0, 20)), ">");
    }
    for (const char* raw : {"script", "style", "title", "textarea"}) {
      if (name.size() == std::string_view(raw).size() && starts_with_any_case(name, raw)) {
        const std::string mark = std::string("</") + raw;
        const std::size_t behind = end_of(mark, end - at_, "<" + std::string(raw) + ">");
        if (page_.title.empty() && name.size() == 5 && raw[0] == 't') {
          page_.title =
              text_.substr(end + 1, std::min<std::size_t>(behind - mark.size() - end - 1, 80));
        }
        at_ = behind;
        return;
      }
    }
    html_ = (html_ || (name.size() == 4 && starts_with_any_case(name, "html"))) &&
            !(name.size() == 5 && starts_with_any_case(name, "/html"));
    at_ = end + 1;
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  bool html_ = false;  ///< <html> is open
  HtmlPage page_;
};

}  // namespace

HtmlPage parse_html(std::string_view text, const std::string& file) {
  check_plain_text(text, file);
  return HtmlParser(text, file).parse();
}

}  // namespace atelier
