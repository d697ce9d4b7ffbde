#include "core/io/byte_reader.h"

#include "core/error.h"

namespace atelier {

std::span<const std::byte> ByteReader::take(std::size_t count, std::string_view what) {
  if (count > remaining()) {
    fail("the file ends inside " + std::string(what) + ": " + std::to_string(remaining()) +
             " bytes left",
         std::to_string(count) + " bytes");
  }
  const std::span<const std::byte> taken = bytes_.subspan(position_, count);
  position_ += count;
  return taken;
}

std::string_view ByteReader::text(std::size_t count, std::string_view what) {
  const std::span<const std::byte> taken = take(count, what);
  return {reinterpret_cast<const char*>(taken.data()), taken.size()};
}

void ByteReader::seek(std::uint64_t offset, std::string_view what) {
  if (offset > bytes_.size()) {
    fail(std::string(what) + " at byte " + std::to_string(offset) + ", beyond the end",
         "an offset of at most " + std::to_string(bytes_.size()));
  }
  position_ = static_cast<std::size_t>(offset);
}

std::size_t ByteReader::paid(std::uint64_t count, std::size_t element_bytes,
                             std::string_view what) const {
  ATELIER_CHECK(element_bytes > 0, "an element takes bytes");
  if (count > remaining() / element_bytes) {
    fail("a count of " + std::to_string(count) + " " + std::string(what) + " with " +
             std::to_string(remaining()) + " bytes left",
         "at most " + std::to_string(remaining() / element_bytes));
  }
  return static_cast<std::size_t>(count);
}

void ByteReader::fail(const std::string& found, const std::string& expected) const {
  throw DataError(file_, "byte " + std::to_string(position_), found, expected);
}

}  // namespace atelier
