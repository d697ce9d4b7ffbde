#include "core/io/page_text.h"
#include "core/io/text_scanner.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(html) {
  const atelier::HtmlPage page = atelier::parse_html(atelier::as_text(bytes), "html");
  ATELIER_CHECK(page.title.size() <= bytes.size(), "a title that is nowhere");
}
