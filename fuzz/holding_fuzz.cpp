#include <cmath>
#include <string_view>

#include "fuzz/reader.h"
#include "registration/tracking/holding_file.h"

/// What is read is in its ranges, can be written, and reads the same.
ATELIER_FUZZ_READER(holding) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::vector<atelier::HeldRing> rings = atelier::parse_holding(text, "holding.toml");
  for (const atelier::HeldRing& ring : rings) {
    ATELIER_CHECK(!ring.garment.empty() && ring.vertices.size() >= 2 && ring.vertices[0] >= 0 &&
                      ring.rest_girth >= 0 && ring.rest_girth <= 100 && ring.stiffness >= 0 &&
                      ring.stiffness <= 1e6,
                  "a ring that there can be");
  }
  const auto again = atelier::parse_holding(atelier::holding_text(rings));
  ATELIER_CHECK(again.size() == rings.size(), "as many rings as were written");
  for (std::size_t i = 0; i < rings.size(); ++i) {
    ATELIER_CHECK(
        again[i].garment == rings[i].garment && again[i].opening == rings[i].opening &&
            again[i].kind == rings[i].kind && again[i].closed == rings[i].closed &&
            again[i].vertices == rings[i].vertices &&
            std::abs(again[i].rest_girth - rings[i].rest_girth) <= 1e-5 * rings[i].rest_girth,
        "a ring reads back as it was");
  }
}
