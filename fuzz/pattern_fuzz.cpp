#include "fuzz/reader.h"
#include "registration/sewing/garment_pattern_json.h"

ATELIER_FUZZ_READER(pattern) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const atelier::SewingPattern pattern = atelier::garment_pattern_from_json(text, "pattern");
  for (const atelier::Panel& panel : pattern.panels) {
    ATELIER_CHECK(atelier::panel_area(panel) > 0, "a panel without area");
  }
}
