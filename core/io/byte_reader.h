#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace atelier {

/// Walks over the bytes of a hostile file. Nothing is read past the end: every call names what it
/// wants, and where the bytes do not suffice DataError names file, byte offset, what was wanted,
/// and how many bytes were left.
class ByteReader {
 public:
  /// @param file  name for errors
  ByteReader(std::span<const std::byte> bytes, std::string file)
      : bytes_(bytes), file_(std::move(file)) {}

  std::size_t position() const { return position_; }
  std::size_t remaining() const { return bytes_.size() - position_; }
  const std::string& file() const { return file_; }

  /// A number (integer or floating point) stored little-endian.
  template <class T>
  T little(std::string_view what) {
    return number<T, std::endian::little>(what);
  }

  /// A number stored big-endian.
  template <class T>
  T big(std::string_view what) {
    return number<T, std::endian::big>(what);
  }

  /// The next `count` bytes.
  std::span<const std::byte> take(std::size_t count, std::string_view what);

  /// The next `count` bytes as text; a view into the file.
  std::string_view text(std::size_t count, std::string_view what);

  void skip(std::size_t count, std::string_view what) { take(count, what); }

  /// Goes to a byte offset of the file.
  void seek(std::uint64_t offset, std::string_view what);

  /// `count` as a size, once `count` elements of at least `element_bytes` (> 0) each have been seen
  /// to fit into the bytes that remain. Ask this before taking memory for a count from a file.
  std::size_t paid(std::uint64_t count, std::size_t element_bytes, std::string_view what) const;

  /// DataError at the current place.
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const;

 private:
  template <class T, std::endian Order>
  T number(std::string_view what) {
    static_assert(std::is_arithmetic_v<T>);
    const std::span<const std::byte> source = take(sizeof(T), what);
    std::byte ordered[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      ordered[i] = source[std::endian::native == Order ? i : sizeof(T) - 1 - i];
    }
    T value;
    std::memcpy(&value, ordered, sizeof(T));
    return value;
  }

  std::span<const std::byte> bytes_;
  std::string file_;
  std::size_t position_ = 0;
};

}  // namespace atelier
