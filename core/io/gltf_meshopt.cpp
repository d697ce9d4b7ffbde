#include "core/io/gltf_meshopt.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "core/io/text_scanner.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr std::size_t kGroup = 16;         // bytes that are packed alike
constexpr std::size_t kBlockBytes = 8192;  // of elements that are packed together
constexpr std::size_t kMaxBlock = 256;     // elements
constexpr std::size_t kMinTail = 32;       // bytes behind the attributes
constexpr std::size_t kTableBytes = 16;    // behind triangles
constexpr std::size_t kPadding = 4;        // bytes behind index sequences
constexpr std::size_t kMaxRatio = 64;      // of decoded bytes: four modes a byte, of 16 zeros each
constexpr std::size_t kFreeBytes = 65'536;

// Bytes one after the other up to an end.
class PackedBytes {
 public:
  PackedBytes(const JsonPlace& view, std::span<const std::byte> bytes)
      : view_(view), bytes_(bytes) {}

  std::uint32_t next() {
    if (at_ >= bytes_.size()) {
      view_.fail("compressed data that end early", "all of " + view_.where());
    }
    return std::to_integer<std::uint32_t>(bytes_[at_++]);
  }
  std::span<const std::byte> take(std::size_t count) {
    if (bytes_.size() - at_ < count) {
      view_.fail("compressed data that end early", "all of " + view_.where());
    }
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }
  /// Groups of seven bits, the low ones first; at most five.
  std::uint32_t variable() {
    std::uint32_t value = 0;
    for (unsigned shift = 0; shift < 35; shift += 7) {
      const std::uint32_t group = next();
      value |= (group & 127U) << shift;
      if (group < 128) {
        break;
      }
    }
    return value;
  }
  void require_end() const {
    if (at_ != bytes_.size()) {
      view_.fail(std::to_string(bytes_.size() - at_) + " bytes behind the compressed data", "none");
    }
  }

 private:
  const JsonPlace& view_;
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

/// 0, 1, 2, 3, 4 as 0, -1, 1, -2, 2.
std::uint32_t unzigzag(std::uint32_t value) {
  return (value >> 1) ^ (0U - (value & 1U));
}

/// Sixteen bytes of `bits` each; the largest value says that the byte follows behind them.
void unpack_group(PackedBytes& in, unsigned bits, std::array<std::uint8_t, kGroup>& bytes) {
  if (bits == 0) {
    bytes.fill(0);
    return;
  }
  if (bits == 8) {
    for (std::uint8_t& byte : bytes) {
      byte = static_cast<std::uint8_t>(in.next());
    }
    return;
  }
  const std::span<const std::byte> packed = in.take(kGroup * bits / 8);
  const std::uint32_t escape = (1U << bits) - 1;
  for (std::size_t i = 0; i < kGroup; ++i) {
    const std::size_t bit = i * bits;
    const auto byte = std::to_integer<std::uint32_t>(packed[bit / 8]);
    const std::uint32_t value = (byte >> (8 - bits - bit % 8)) & escape;
    bytes[i] = static_cast<std::uint8_t>(value == escape ? in.next() : value);
  }
}

std::vector<std::byte> decode_attributes(const JsonPlace& view, std::span<const std::byte> source,
                                         std::size_t count, std::size_t stride) {
  const std::size_t tail = std::max(stride, kMinTail);
  if (source.size() < 1 + tail || source[0] != std::byte{0xA0}) {
    view.fail("attributes of another version or without an end", "version 0 (0xA0)");
  }
  PackedBytes in(view, source.subspan(1, source.size() - 1 - tail));
  const std::span<const std::byte> first = source.last(stride);
  std::vector<std::uint8_t> before(stride);
  std::transform(first.begin(), first.end(), before.begin(),
                 [](std::byte b) { return std::to_integer<std::uint8_t>(b); });
  const std::size_t block = std::min(kBlockBytes / stride & ~(kGroup - 1), kMaxBlock);
  std::vector<std::byte> decoded(count * stride);
  for (std::size_t begin = 0; begin < count; begin += block) {
    const std::size_t elements = std::min(block, count - begin);
    const std::size_t groups = (elements + kGroup - 1) / kGroup;
    for (std::size_t k = 0; k < stride; ++k) {
      const std::span<const std::byte> modes = in.take((groups + 3) / 4);
      std::array<std::uint8_t, kGroup> bytes = {};
      for (std::size_t g = 0; g < groups; ++g) {
        const auto mode = std::to_integer<unsigned>(modes[g / 4]) >> (2 * (g % 4)) & 3U;
        unpack_group(in, mode == 0 ? 0 : 1U << mode, bytes);
        for (std::size_t i = 0; i < kGroup && g * kGroup + i < elements; ++i) {
          before[k] = static_cast<std::uint8_t>(before[k] + unzigzag(bytes[i]));
          decoded[(begin + g * kGroup + i) * stride + k] = std::byte{before[k]};
        }
      }
    }
  }
  in.require_end();
  return decoded;
}

void put_index(std::uint32_t index, std::size_t place, std::size_t stride,
               std::vector<std::byte>& decoded) {
  for (std::size_t b = 0; b < stride; ++b) {
    decoded[place * stride + b] = static_cast<std::byte>(index >> (8 * b) & 0xFFU);
  }
}

/// The vertices and edges seen last, by which triangles name what they share.
class TriangleMemory {
 public:
  void vertex(std::uint32_t v, bool keep = true) {
    vertices_[vertex_] = v;
    vertex_ = (vertex_ + (keep ? 1 : 0)) & 15;
  }
  void edge(std::uint32_t a, std::uint32_t b) {
    edges_[edge_] = {a, b};
    edge_ = (edge_ + 1) & 15;
  }
  std::uint32_t vertex_before(std::size_t back) const { return vertices_[(vertex_ - back) & 15]; }
  std::array<std::uint32_t, 2> edge_before(std::size_t back) const {
    return edges_[(edge_ - back) & 15];
  }

 private:
  std::array<std::uint32_t, 16> vertices_ = {};
  std::array<std::array<std::uint32_t, 2>, 16> edges_ = {};
  std::size_t vertex_ = 0;
  std::size_t edge_ = 0;
};

class TriangleDecoder {
 public:
  TriangleDecoder(const JsonPlace& view, std::span<const std::byte> source, std::size_t triangles)
      : table_(source.last(kTableBytes)),
        in_(view, source.subspan(1 + triangles, source.size() - 1 - triangles - kTableBytes)),
        first_free_((source[0] & std::byte{0x0F}) == std::byte{0} ? 15 : 13) {}

  std::array<std::uint32_t, 3> next(unsigned code) {
    return code < 0xF0 ? on_edge(code) : alone(code);
  }
  void require_end() const { in_.require_end(); }

 private:
  std::uint32_t free_index() { return last_ += unzigzag(in_.variable()); }

  /// A triangle on an edge that was seen, and a third vertex: new, seen, or beside the last free.
  std::array<std::uint32_t, 3> on_edge(unsigned code) {
    const auto [a, b] = memory_.edge_before(1 + (code >> 4));
    const unsigned third = code & 15;
    std::uint32_t c = 0;
    if (third == 0) {
      c = next_++;
    } else if (third < first_free_) {
      c = memory_.vertex_before(1 + third);
    } else {
      c = third == 15 ? free_index() : last_ += third == 13 ? 0xFFFFFFFFU : 1U;
    }
    if (third == 0 || third >= first_free_) {
      memory_.vertex(c);
    }
    memory_.edge(c, b);
    memory_.edge(a, c);
    return {a, b, c};
  }

  /// A triangle of which no edge was seen.
  std::array<std::uint32_t, 3> alone(unsigned code) {
    const unsigned pair = code < 0xFE ? std::to_integer<unsigned>(table_[code & 15]) : in_.next();
    if (code >= 0xFE && pair == 0) {
      next_ = 0;
    }
    const unsigned second = pair >> 4;
    const unsigned third = pair & 15;
    const bool free_first = code == 0xFF;
    std::uint32_t a = free_first ? 0 : next_++;
    std::uint32_t b = second == 0 ? next_++ : memory_.vertex_before(second);
    std::uint32_t c = third == 0 ? next_++ : memory_.vertex_before(third);
    a = free_first ? free_index() : a;
    b = second == 15 && code >= 0xFE ? free_index() : b;
    c = third == 15 && code >= 0xFE ? free_index() : c;
    memory_.vertex(a);
    if (second == 0 || second == 15) {
      memory_.vertex(b);
    }
    if (third == 0 || third == 15) {
      memory_.vertex(c);
    }
    memory_.edge(b, a);
    memory_.edge(c, b);
    memory_.edge(a, c);
    return {a, b, c};
  }

  std::span<const std::byte> table_;
  PackedBytes in_;
  unsigned first_free_;
  TriangleMemory memory_;
  std::uint32_t next_ = 0;
  std::uint32_t last_ = 0;
};

std::vector<std::byte> decode_triangles(const JsonPlace& view, std::span<const std::byte> source,
                                        std::size_t count, std::size_t stride) {
  const std::size_t triangles = count / 3;
  if (count % 3 != 0 || source.size() < 1 + triangles + kTableBytes ||
      (source[0] != std::byte{0xE0} && source[0] != std::byte{0xE1})) {
    view.fail("triangles of another version, without an end or not in threes",
              "version 0 or 1 (0xE0, 0xE1)");
  }
  std::vector<std::byte> decoded(count * stride);
  TriangleDecoder decoder(view, source, triangles);
  for (std::size_t t = 0; t < triangles; ++t) {
    const std::array<std::uint32_t, 3> corners =
        decoder.next(std::to_integer<unsigned>(source[1 + t]));
    for (std::size_t i = 0; i < 3; ++i) {
      put_index(corners[i], 3 * t + i, stride, decoded);
    }
  }
  decoder.require_end();
  return decoded;
}

std::vector<std::byte> decode_indices(const JsonPlace& view, std::span<const std::byte> source,
                                      std::size_t count, std::size_t stride) {
  if (source.size() < 1 + count + kPadding ||
      (source[0] != std::byte{0xD0} && source[0] != std::byte{0xD1})) {
    view.fail("indices of another version or without an end", "version 0 or 1 (0xD0, 0xD1)");
  }
  std::vector<std::byte> decoded(count * stride);
  PackedBytes in(view, source.subspan(1, source.size() - 1 - kPadding));
  std::array<std::uint32_t, 2> last = {};
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t value = in.variable();
    std::uint32_t& base = last[value & 1U];
    base += unzigzag(value >> 1);
    put_index(base, i, stride, decoded);
  }
  in.require_end();
  return decoded;
}

template <class T>
T number_at(const std::byte* at) {
  std::array<std::byte, sizeof(T)> bytes;
  std::memcpy(bytes.data(), at, sizeof(T));
  if constexpr (std::endian::native == std::endian::big) {
    std::reverse(bytes.begin(), bytes.end());
  }
  return std::bit_cast<T>(bytes);
}

template <class T>
void put_number(T value, std::byte* at) {
  auto bytes = std::bit_cast<std::array<std::byte, sizeof(T)>>(value);
  if constexpr (std::endian::native == std::endian::big) {
    std::reverse(bytes.begin(), bytes.end());
  }
  std::memcpy(at, bytes.data(), sizeof(T));
}

/// A unit vector from two coordinates on an octahedron; the third number is what 1 is.
template <class T>
void unfold_octahedron(std::byte* at) {
  constexpr double kLargest = static_cast<double>((1 << (8 * sizeof(T) - 1)) - 1);
  double x = number_at<T>(at);
  double y = number_at<T>(at + sizeof(T));
  const double z =
      static_cast<double>(number_at<T>(at + 2 * sizeof(T))) - std::abs(x) - std::abs(y);
  const double fold = std::min(z, 0.0);
  x += x >= 0 ? fold : -fold;
  y += y >= 0 ? fold : -fold;
  const double length = std::sqrt(x * x + y * y + z * z);
  const double scale = length > 0 ? kLargest / length : 0;
  put_number(saturating_cast<T>(std::round(x * scale)), at);
  put_number(saturating_cast<T>(std::round(y * scale)), at + sizeof(T));
  put_number(saturating_cast<T>(std::round(z * scale)), at + 2 * sizeof(T));
}

/// A unit quaternion from its three smaller parts; the fourth number says which part is the
/// largest and what 1 is.
void complete_quaternion(std::byte* at) {
  std::array<double, 4> parts = {};
  const int said = number_at<std::int16_t>(at + 6);
  const double scale = std::sqrt(0.5) / (said | 3);
  double square = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    parts[i + 1] = scale * number_at<std::int16_t>(at + 2 * i);
    square += parts[i + 1] * parts[i + 1];
  }
  parts[0] = std::sqrt(std::max(0.0, 1 - square));
  for (std::size_t i = 0; i < 4; ++i) {
    const double value = std::clamp(32'767 * parts[i], -32'767.0, 32'767.0);
    put_number(saturating_cast<std::int16_t>(std::round(value)),
               at + 2 * ((static_cast<std::size_t>(said & 3) + i) % 4));
  }
}

/// A float from a mantissa of 24 bits and an exponent of 8, both signed.
void expand_exponent(std::byte* at) {
  const auto bits = number_at<std::int32_t>(at);
  const auto mantissa = static_cast<std::int32_t>(static_cast<std::uint32_t>(bits) << 8) >> 8;
  put_number(std::ldexp(static_cast<float>(mantissa), bits >> 24), at);
}

void undo_filter(const JsonPlace& view, std::size_t stride, std::vector<std::byte>& decoded) {
  const std::string filter = view.text_or("filter", "NONE");
  const auto each = [&](std::size_t step, auto&& undo) {
    for (std::size_t at = 0; at < decoded.size(); at += step) {
      undo(decoded.data() + at);
    }
  };
  if (filter == "OCTAHEDRAL" && stride == 4) {
    each(stride, unfold_octahedron<std::int8_t>);
  } else if (filter == "OCTAHEDRAL" && stride == 8) {
    each(stride, unfold_octahedron<std::int16_t>);
  } else if (filter == "QUATERNION" && stride == 8) {
    each(stride, complete_quaternion);
  } else if (filter == "EXPONENTIAL" && stride % 4 == 0) {
    each(4, expand_exponent);
  } else if (filter != "NONE") {
    view.fail(
        "filter " + in_quotes(filter) + " of elements of " + std::to_string(stride) + " bytes",
        "NONE, OCTAHEDRAL (4 or 8 bytes), QUATERNION (8) or EXPONENTIAL (4, 8, ...)");
  }
}

}  // namespace

std::vector<std::byte> decode_meshopt(const JsonPlace& view, std::span<const std::byte> source,
                                      std::int64_t most) {
  const std::string& mode = view.at("mode").text();
  const bool attributes = mode == "ATTRIBUTES";
  if (!attributes && mode != "TRIANGLES" && mode != "INDICES") {
    view.at("mode").fail(in_quotes(mode), "ATTRIBUTES, TRIANGLES or INDICES");
  }
  const auto stride = static_cast<std::size_t>(view.at("byteStride").integer(1, 256));
  const auto count = static_cast<std::size_t>(
      view.at("count").integer(0, std::max<std::int64_t>(0, most) / static_cast<int>(stride)));
  if (attributes ? stride % 4 != 0 : stride != 2 && stride != 4) {
    view.at("byteStride").fail(std::to_string(stride), attributes ? "4, 8, ... 256" : "2 or 4");
  }
  // Before memory is taken for them.
  if (count > (kFreeBytes + kMaxRatio * source.size()) / stride) {
    view.at("count").fail(std::to_string(count) + " elements of " + std::to_string(stride) +
                              " bytes from " + std::to_string(source.size()),
                          "as many as the compressed bytes can hold");
  }
  std::vector<std::byte> decoded;
  if (attributes) {
    decoded = decode_attributes(view, source, count, stride);
    undo_filter(view, stride, decoded);
  } else if (mode == "TRIANGLES") {
    decoded = decode_triangles(view, source, count, stride);
  } else {
    decoded = decode_indices(view, source, count, stride);
  }
  return decoded;
}

}  // namespace atelier
