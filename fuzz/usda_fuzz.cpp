#include <cmath>

#include "core/io/text_scanner.h"
#include "core/io/usd_text.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(usda) {
  const atelier::UsdLayer layer = atelier::parse_usda(atelier::as_text(bytes), "usda");
  const double unit = layer.metres_per_unit.value_or(1);
  ATELIER_CHECK(std::isfinite(unit) && unit > 0, "a scene of no size");
}
