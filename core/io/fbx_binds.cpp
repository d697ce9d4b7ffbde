#include "core/io/fbx_binds.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/text_scanner.h"

namespace atelier {
namespace {

constexpr std::string_view kBinaryHead("Kaydara FBX Binary  \0\x1a\0", 23);
constexpr std::uint32_t kWideOffsets = 7500;  // version from which records count in 64 bits
constexpr std::size_t kNumbers = 16;

using MatrixNumbers = std::array<double, kNumbers>;

/// A matrix, by columns as the file has it, of the cluster that is being read.
class BindList {
 public:
  void add(std::string_view name, const MatrixNumbers& numbers) {
    const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix4d>(numbers.data());
    if (name == "Transform") {
      transform_ = matrix;
    } else if (transform_ && matrix.allFinite() && transform_->allFinite()) {
      binds_.push_back({*transform_, matrix});
      transform_.reset();
    }
  }
  std::vector<FbxBind> taken() { return std::move(binds_); }

 private:
  std::optional<Eigen::Matrix4d> transform_;
  std::vector<FbxBind> binds_;
};

bool is_bind_name(std::string_view name) {
  return name == "Transform" || name == "TransformLink";
}

/// Sixteen numbers: an array that is not compressed, or one after the other.
std::optional<MatrixNumbers> record_numbers(ByteReader& in, std::uint64_t properties) {
  MatrixNumbers numbers = {};
  const char type = in.text(1, "a type")[0];
  if (properties == 1 && type == 'd') {
    const auto count = in.little<std::uint32_t>("a count");
    const auto encoding = in.little<std::uint32_t>("an encoding");
    in.skip(4, "a length");
    if (count != kNumbers || encoding != 0) {
      return std::nullopt;
    }
    for (double& number : numbers) {
      number = in.little<double>("a number");
    }
    return numbers;
  }
  if (properties != kNumbers || type != 'D') {
    return std::nullopt;
  }
  numbers[0] = in.little<double>("a number");
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    if (in.text(1, "a type")[0] != 'D') {
      return std::nullopt;
    }
    numbers[i] = in.little<double>("a number");
  }
  return numbers;
}

/// Records one after the other: a record's children follow its properties, and an empty record ends
/// them.
void read_binary(std::span<const std::byte> bytes, BindList& binds) {
  ByteReader in(bytes, "");
  in.skip(kBinaryHead.size(), "the head");
  const bool wide = in.little<std::uint32_t>("the version") >= kWideOffsets;
  const auto word = [&] {
    return wide ? in.little<std::uint64_t>("an offset")
                : std::uint64_t{in.little<std::uint32_t>("an offset")};
  };
  const std::size_t head = wide ? 25 : 13;
  while (in.remaining() >= head) {
    const std::uint64_t end = word();
    const std::uint64_t properties = word();
    const std::uint64_t length = word();
    const std::string_view name = in.text(in.little<std::uint8_t>("a length"), "a name");
    if (end == 0 && properties == 0 && length == 0 && name.empty()) {
      continue;
    }
    const std::size_t begin = in.position();
    if (length > 0 && is_bind_name(name)) {
      if (const std::optional<MatrixNumbers> numbers = record_numbers(in, properties)) {
        binds.add(name, *numbers);
      }
    }
    in.seek(begin + length, "the next record");
  }
}

/// "Transform: *16 {\n a: 1,0,...}" (7.x) or "Transform: 1,0,..." (6.1).
void read_text(std::string_view text, BindList& binds) {
  constexpr std::string_view kName = "Transform";
  for (std::size_t at = text.find(kName); at != std::string_view::npos;
       at = text.find(kName, at + 1)) {
    const std::size_t colon = text.find(':', at);
    if (colon == std::string_view::npos || !is_bind_name(text.substr(at, colon - at))) {
      continue;
    }
    const std::string_view name = text.substr(at, colon - at);
    std::size_t from = text.find_first_not_of(" \t\r\n", colon + 1);
    if (from != std::string_view::npos && text[from] == '*') {
      from = text.find("a:", from);
      from = from == std::string_view::npos ? from : from + 2;
    }
    MatrixNumbers numbers = {};
    bool all = from != std::string_view::npos;
    for (std::size_t i = 0; all && i < numbers.size(); ++i) {
      from = text.find_first_not_of(" \t\r\n,", from);
      const std::size_t end =
          from == std::string_view::npos ? from : text.find_first_of(" \t\r\n,}", from);
      all =
          end != std::string_view::npos && parse_number(text.substr(from, end - from), numbers[i]);
      from = end;
    }
    if (all) {
      binds.add(name, numbers);
    }
  }
}

}  // namespace

std::vector<FbxBind> fbx_binds(std::span<const std::byte> bytes) {
  BindList binds;
  if (as_text(bytes).starts_with(kBinaryHead)) {
    try {
      read_binary(bytes, binds);
    } catch (const DataError&) {
      // the footer, or what libassimp did not mind
    }
  } else {
    read_text(as_text(bytes), binds);
  }
  return binds.taken();
}

}  // namespace atelier
