#include <algorithm>
#include <vector>

#include "core/mark/mark_code.h"
#include "fuzz/reader.h"

/// What waves of an image say of each bit of a mark's code, a signed byte each.
ATELIER_FUZZ_READER(mark) {
  if (std::ssize(bytes) != atelier::kMarkCodeBits) {
    throw atelier::DataError("an image", "mark", "another number of values", "520");
  }
  std::vector<float> soft(bytes.size());
  std::transform(bytes.begin(), bytes.end(), soft.begin(),
                 [](std::byte byte) { return static_cast<float>(static_cast<std::int8_t>(byte)); });
  const atelier::DecodedMark mark = atelier::decode_mark(soft);
  if (mark.difference != 0) {
    throw atelier::DataError("an image", "mark", "a checksum of other bits", "that of its bits");
  }
  const std::vector<std::uint8_t> code = atelier::mark_code(mark.bits);
  std::transform(code.begin(), code.end(), soft.begin(),
                 [](std::uint8_t bit) { return bit != 0 ? -1.0F : 1.0F; });
  ATELIER_CHECK(atelier::decode_mark(soft).bits == mark.bits, "bits that do not come back");
}
