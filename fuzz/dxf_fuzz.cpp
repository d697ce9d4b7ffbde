#include "core/io/drawing_text.h"
#include "core/io/text_scanner.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(dxf) {
  const atelier::DxfDrawing drawing = atelier::parse_dxf(atelier::as_text(bytes), "dxf");
  ATELIER_CHECK(!drawing.sections.empty(), "a drawing without sections");
}
