#include "core/store/manifest_limits.h"

namespace atelier {

Limits manifest_limits() {
  Limits limits;
  constexpr std::int64_t kBytes = 256;  // of an output whose path is of common length
  constexpr std::int64_t kValues = 4;   // an object of three
  limits.text_file_bytes += kMaxFiles * kBytes;
  limits.text_values += kMaxFiles * kValues;
  return limits;
}

}  // namespace atelier
