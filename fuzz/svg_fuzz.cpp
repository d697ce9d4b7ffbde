#include "core/io/drawing_text.h"
#include "core/io/text_scanner.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(svg) {
  const atelier::SvgDrawing drawing = atelier::parse_svg(atelier::as_text(bytes), "svg");
  ATELIER_CHECK(drawing.elements > 0, "a drawing without its root");
  ATELIER_CHECK(
      drawing.view_box.empty() || (drawing.view_box.size() == 4 && drawing.view_box[2] >= 0),
      "a view of no size");
}
