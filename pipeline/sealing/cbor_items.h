#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace atelier {

// Major types of CBOR (RFC 8949).
enum class CborType { Unsigned, Negative, Bytes, Text, Array, Map, Tag, Simple };

/// The start of an item.
struct CborHead {
  CborType type = CborType::Unsigned;
  std::uint64_t value = 0;  ///< number, or how many bytes or items follow
};

/// Items of CBOR, read one behind the other. Everything throws DataError for an item that is cut
/// off, of unknown length, or deeper than C2PA's are.
class CborItems {
 public:
  CborItems(std::string_view bytes, std::string file) : bytes_(bytes), file_(std::move(file)) {}

  CborHead next();
  /// What follows the start of bytes or a text.
  std::string_view content(std::uint64_t size);
  /// An item that has to be bytes.
  std::string_view bytes_item();
  /// Passes over an item with all that is in it.
  void skip(int depth = 0);
  [[noreturn]] void refuse(const char* found) const;

 private:
  std::uint8_t byte();

  std::string_view bytes_;
  std::string file_;
};

/// The start of an item as bytes.
std::string cbor_head(CborType type, std::uint64_t value);

}  // namespace atelier
