#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "core/io/byte_reader.h"
#include "core/io/ply_header.h"
#include "core/io/text_scanner.h"
#include "core/io/text_writer.h"
#include "core/limits.h"

// The data after a PLY header, as a sequence of numbers: the reader of meshes (mesh_ply_read.cpp)
// is the same for both kinds of file. All in the header, so that the reader's loops have it inline.

namespace atelier {

/// Is it a float or a double?
inline bool is_floating(PlyType type) {
  return type == PlyType::Float32 || type == PlyType::Float64;
}

/// Least and greatest value of an integer type.
inline std::pair<std::int64_t, std::int64_t> range_of(PlyType type) {
  switch (type) {
    case PlyType::Int8:
      return {-128, 127};
    case PlyType::UInt8:
      return {0, 255};
    case PlyType::Int16:
      return {-32'768, 32'767};
    case PlyType::UInt16:
      return {0, 65'535};
    case PlyType::Int32:
      return {std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()};
    default:
      return {0, std::numeric_limits<std::uint32_t>::max()};
  }
}

/// The numbers of an ascii body, a row on each line. Both sources refuse what is none, by DataError
/// with the place.
class AsciiSource {
 public:
  AsciiSource(std::span<const std::byte> bytes, const PlyHeader& header, const std::string& name,
              const Limits& limits)
      : scanner_(as_text(bytes), name, limits.line_bytes) {
    for (std::int64_t line = 0; line < header.lines; ++line) {
      scanner_.next_line();
    }
  }

  /// A number and the blank behind it.
  static std::size_t min_bytes(PlyType) { return 2; }
  std::size_t bytes_left() const { return scanner_.bytes_left() + 1; }

  void begin_row() {
    do {
      if (!scanner_.next_line()) {
        scanner_.fail("the file ends", "another row");
      }
      TextScanner ahead = scanner_;
      row_is_blank_ = ahead.rest().empty();
    } while (row_is_blank_);
  }
  void end_row() {
    if (!scanner_.rest().empty()) {
      scanner_.fail("more numbers than the header says", "the end of the line");
    }
  }
  void end() {
    while (scanner_.next_line()) {
      if (!scanner_.rest().empty()) {
        scanner_.fail("more lines than the header says", "the end of the file");
      }
    }
  }

  double value(PlyType type) {
    if (is_floating(type)) {
      const double value = scanner_.number("a number");
      return type == PlyType::Float32 ? to_float(value) : value;
    }
    const std::int64_t value = scanner_.integer("a number");
    const auto [least, greatest] = range_of(type);
    if (value < least || value > greatest) {
      scanner_.fail(std::to_string(value),
                    std::to_string(least) + " to " + std::to_string(greatest));
    }
    return static_cast<double>(value);
  }
  void skip(PlyType type, std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      value(type);
    }
  }
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    scanner_.fail(found, expected);
  }

 private:
  double to_float(double value) const {
    const float rounded = static_cast<float>(value);
    if (!std::isfinite(rounded)) {
      scanner_.fail(number_text(value), "a number that a float holds");
    }
    return static_cast<double>(rounded);
  }

  TextScanner scanner_;
  bool row_is_blank_ = false;
};

/// The numbers of a binary body; as AsciiSource.
class BinarySource {
 public:
  BinarySource(std::span<const std::byte> bytes, const PlyHeader& header, const std::string& name)
      : reader_(bytes, name), big_(header.format == PlyFormat::BinaryBigEndian) {
    reader_.skip(header.bytes, "header");
  }

  static std::size_t min_bytes(PlyType type) { return size_of(type); }
  std::size_t bytes_left() const { return reader_.remaining(); }
  void begin_row() {}
  void end_row() {}
  void end() {
    if (reader_.remaining() > 0) {
      reader_.fail(std::to_string(reader_.remaining()) + " bytes more than the header says",
                   "the end of the file");
    }
  }

  double value(PlyType type) {
    switch (type) {
      case PlyType::Int8:
        return number<std::int8_t>();
      case PlyType::UInt8:
        return number<std::uint8_t>();
      case PlyType::Int16:
        return number<std::int16_t>();
      case PlyType::UInt16:
        return number<std::uint16_t>();
      case PlyType::Int32:
        return number<std::int32_t>();
      case PlyType::UInt32:
        return number<std::uint32_t>();
      case PlyType::Float32:
        return static_cast<double>(number<float>());
      case PlyType::Float64:
        return number<double>();
    }
    return 0;
  }
  void skip(PlyType type, std::uint64_t count) {
    reader_.skip(reader_.paid(count, size_of(type), "list") * size_of(type), "list");
  }
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    reader_.fail(found, expected);
  }

 private:
  template <class T>
  T number() {
    return big_ ? reader_.big<T>("number") : reader_.little<T>("number");
  }

  ByteReader reader_;
  bool big_;
};

}  // namespace atelier
