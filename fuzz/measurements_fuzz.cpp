#include <cmath>

#include "bodymodel/formats/tailor_measurements.h"
#include "core/io/text_scanner.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(measurements) {
  const atelier::TailorMeasurements found =
      atelier::parse_tailor_measurements(atelier::as_text(bytes), "measurements");
  for (const auto& [name, length] : found.lengths) {
    ATELIER_CHECK(!name.empty() && std::abs(length) <= 100 && length != 0, "a length of nothing");
  }
}
