#include "pipeline/sealing/cbor_items.h"

#include "core/error.h"

namespace atelier {

CborHead CborItems::next() {
  const std::uint8_t first = byte();
  const unsigned size = first & 31u;
  CborHead item{static_cast<CborType>(first >> 5), size};
  if (size < 24) {
    return item;
  }
  if (size > 27) {
    refuse("an item of unknown length");
  }
  item.value = 0;
  for (int i = 0; i < 1 << (size - 24); ++i) {
    item.value = item.value << 8 | byte();
  }
  return item;
}

std::string_view CborItems::content(std::uint64_t size) {
  if (size > bytes_.size()) {
    refuse("an item that is cut off");
  }
  const std::string_view taken = bytes_.substr(0, size);
  bytes_.remove_prefix(size);
  return taken;
}

std::string_view CborItems::bytes_item() {
  const CborHead item = next();
  if (item.type != CborType::Bytes) {
    refuse("something else than bytes");
  }
  return content(item.value);
}

void CborItems::skip(int depth) {
  constexpr int kDeepestItem = 16;
  if (depth > kDeepestItem) {
    refuse("items that lie too deep");
  }
  const CborHead item = next();
  if (item.type == CborType::Bytes || item.type == CborType::Text) {
    content(item.value);
    return;
  }
  if (item.type == CborType::Tag) {
    skip(depth + 1);
    return;
  }
  if (item.type != CborType::Array && item.type != CborType::Map) {
    return;
  }
  if (item.value > bytes_.size()) {
    refuse("more items than bytes");
  }
  const std::uint64_t count = item.type == CborType::Map ? 2 * item.value : item.value;
  for (std::uint64_t i = 0; i < count; ++i) {
    skip(depth + 1);
  }
}

void CborItems::refuse(const char* found) const {
  throw DataError(file_, "content credentials", found, "CBOR as C2PA has it");
}

std::uint8_t CborItems::byte() {
  return static_cast<std::uint8_t>(content(1)[0]);
}

std::string cbor_head(CborType type, std::uint64_t value) {
  const int high = static_cast<int>(type) << 5;
  if (value < 24) {
    return {static_cast<char>(high | static_cast<int>(value))};
  }
  const int power = value < 0x100 ? 0 : value < 0x10000 ? 1 : value < 0x100000000 ? 2 : 3;
  std::string bytes(1, static_cast<char>(high | (24 + power)));
  for (int i = (1 << power) - 1; i >= 0; --i) {
    bytes += static_cast<char>(value >> (8 * i) & 0xFF);
  }
  return bytes;
}

}  // namespace atelier
