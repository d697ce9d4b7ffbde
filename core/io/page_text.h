#pragma once

#include <string>
#include <string_view>

namespace atelier {

/// Metadata of an HTML page.
struct HtmlPage {
  std::string title;  ///< "" where there is none
};

/// Reads the frame of a page: <!doctype html>, before it comments at most, then tags, comments and
/// texts. Throws DataError, with the line, for another beginning and for a page that ends inside of
/// a tag, a comment, a value in quotes, a script, a style, a title or before `</html>` where it has
/// `<html>`: a browser shows what there is of such a page and does not say that the rest is
/// missing.
HtmlPage parse_html(std::string_view text, const std::string& file = "");

}  // namespace atelier
