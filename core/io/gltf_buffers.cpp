#include "core/io/gltf_buffers.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/gltf_meshopt.h"
#include "core/io/text_scanner.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr std::int64_t kMost = std::int64_t{1} << 40;
constexpr std::int64_t kFreeNumbers = 8 << 20;  // decoded numbers that nobody asks about
constexpr std::int64_t kDecodedPerByte = 64;    // of compressed views, as meshopt at its densest
constexpr std::int64_t kNumbersPerByte = 32;    // above that: shared views read again and again

enum ComponentType { Byte = 5120, UnsignedByte, Short, UnsignedShort, UnsignedInt = 5125, Float };

std::size_t component_size(int type) {
  switch (type) {
    case Byte:
    case UnsignedByte:
      return 1;
    case Short:
    case UnsignedShort:
      return 2;
    default:
      return 4;
  }
}

int component_type(const JsonPlace& owner) {
  const JsonPlace place = owner.at("componentType");
  const int type = static_cast<int>(place.integer(Byte, Float));
  if (type == 5124) {
    place.fail("5124", "5120 to 5123, 5125 or 5126");
  }
  return type;
}

/// Numbers of one element. MAT2 and MAT3, whose columns may be padded, are never asked for.
int components_of(const JsonPlace& type) {
  static constexpr std::pair<std::string_view, int> kTypes[] = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
  for (const auto& [name, components] : kTypes) {
    if (type.text() == name) {
      return components;
    }
  }
  type.fail(in_quotes(type.text()), "SCALAR, VEC2, VEC3, VEC4 or MAT4");
}

template <class T>
double loaded(const std::byte* at) {
  std::byte ordered[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    ordered[i] = at[std::endian::native == std::endian::little ? i : sizeof(T) - 1 - i];
  }
  T value;
  std::memcpy(&value, ordered, sizeof(T));
  return static_cast<double>(value);
}

double component_at(const std::byte* at, int type, bool normalized) {
  switch (type) {
    case Byte: {
      const double value = loaded<std::int8_t>(at);
      return normalized ? std::max(value / 127, -1.0) : value;
    }
    case UnsignedByte:
      return loaded<std::uint8_t>(at) / (normalized ? 255 : 1);
    case Short: {
      const double value = loaded<std::int16_t>(at);
      return normalized ? std::max(value / 32'767, -1.0) : value;
    }
    case UnsignedShort:
      return loaded<std::uint16_t>(at) / (normalized ? 65'535 : 1);
    case UnsignedInt:
      return loaded<std::uint32_t>(at);
    default:
      return loaded<float>(at);
  }
}

/// `bytes` holds `count` elements from `offset` on, `stride` apart (0: packed). Returns the stride.
std::size_t check_fits(const JsonPlace& owner, std::span<const std::byte> bytes, std::size_t offset,
                       std::size_t stride, std::size_t count, std::size_t element) {
  const std::size_t step = stride == 0 ? element : stride;
  if (stride != 0 && stride < element) {
    owner.fail("a stride of " + std::to_string(stride) + " bytes",
               "at least " + std::to_string(element));
  }
  const bool fits = count == 0 || (offset <= bytes.size() && bytes.size() - offset >= element &&
                                   (count - 1) <= (bytes.size() - offset - element) / step);
  if (!fits) {
    owner.fail(std::to_string(count) + " elements of " + std::to_string(element) +
                   " bytes from byte " + std::to_string(offset) + " in a view of " +
                   std::to_string(bytes.size()),
               "fewer elements or a larger view");
  }
  return step;
}

int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') {
    return c - 'A';
  }
  if (c >= 'a' && c <= 'z') {
    return c - 'a' + 26;
  }
  if (c >= '0' && c <= '9') {
    return c - '0' + 52;
  }
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') {
    return c - '0';
  }
  const char lower = static_cast<char>(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

std::string percent_decoded(const JsonPlace& uri) {
  const std::string& text = uri.text();
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    const int high = i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
    const int low = i + 2 < text.size() ? hex_digit(text[i + 2]) : -1;
    if (high < 0 || low < 0) {
      uri.fail(in_quotes(text), "two hexadecimal digits behind '%'");
    }
    decoded += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return decoded;
}

}  // namespace

GltfChunks split_glb(std::span<const std::byte> bytes, const std::string& name) {
  GltfChunks chunks;
  if (bytes.empty()) {
    throw DataError(name, "", "an empty file", "glTF 2.0");
  }
  if (!as_text(bytes).starts_with("glTF")) {
    chunks.json = as_text(bytes);
    return chunks;
  }
  ByteReader reader(bytes, name);
  reader.skip(4, "magic");
  const auto version = reader.little<std::uint32_t>("version");
  if (version != 2) {
    reader.fail("GLB version " + std::to_string(version), "2");
  }
  const auto length = reader.little<std::uint32_t>("length");
  if (length != bytes.size()) {
    reader.fail("a length of " + std::to_string(length) + " in a file of " +
                    std::to_string(bytes.size()) + " bytes",
                "the same");
  }
  bool first = true;
  while (reader.remaining() > 0) {
    const auto size = reader.little<std::uint32_t>("chunk length");
    const auto type = reader.little<std::uint32_t>("chunk type");
    const std::span<const std::byte> chunk = reader.take(size, "chunk");
    constexpr std::uint32_t kJson = 0x4E4F534A;
    constexpr std::uint32_t kBinary = 0x004E4942;
    if (first != (type == kJson)) {
      reader.fail(first ? "another chunk" : "a second JSON chunk", "one chunk JSON, first");
    }
    if (first) {
      chunks.json = as_text(chunk);
    } else if (type == kBinary && !chunks.binary) {
      chunks.binary = chunk;
    }
    first = false;
  }
  if (first) {
    reader.fail("no chunk", "a chunk JSON");
  }
  return chunks;
}

std::vector<std::byte> decode_data_uri(const JsonPlace& uri) {
  const std::string& text = uri.text();
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos || !std::string_view(text).substr(0, comma).ends_with(";base64")) {
    uri.fail(in_quotes(text), "data:...;base64,...");
  }
  std::string_view digits = std::string_view(text).substr(comma + 1);
  for (int padding = 0; padding < 2 && digits.ends_with('='); ++padding) {
    digits.remove_suffix(1);
  }
  std::vector<std::byte> bytes;
  bytes.reserve(digits.size() * 3 / 4);
  std::uint32_t held = 0;
  int bits = 0;
  for (const char c : digits) {
    const int digit = base64_digit(c);
    if (digit < 0) {
      uri.fail(in_quotes(std::string_view(&c, 1)), "the digits of base64");
    }
    held = held << 6 | static_cast<std::uint32_t>(digit);
    bits += 6;
    if (bits >= 8) {
      bits -= 8;
      bytes.push_back(static_cast<std::byte>(held >> bits & 0xFF));
    }
  }
  return bytes;
}

std::filesystem::path file_below(const std::filesystem::path& folder, const JsonPlace& uri) {
  const std::string decoded = percent_decoded(uri);
  const std::filesystem::path relative(decoded);
  const bool plain =
      !decoded.empty() && relative.is_relative() &&
      decoded.find_first_of(std::string_view("\\:\0", 3)) == std::string::npos &&
      std::none_of(relative.begin(), relative.end(), [](const auto& part) { return part == ".."; });
  if (!plain) {
    uri.fail(in_quotes(decoded), "a relative path without \"..\", to a file beside this one");
  }
  // A link may not lead out either.
  std::error_code failed;
  const std::filesystem::path root =
      std::filesystem::canonical(folder.empty() ? std::filesystem::path(".") : folder, failed);
  std::filesystem::path path =
      failed ? std::filesystem::path() : std::filesystem::canonical(root / relative, failed);
  if (failed) {
    uri.fail(in_quotes(decoded) + " (" + failed.message() + ")", "a file beside this one");
  }
  if (std::mismatch(root.begin(), root.end(), path.begin(), path.end()).first != root.end()) {
    uri.fail(in_quotes(decoded) + ", a link out of the folder", "a file below the folder");
  }
  return path;
}

namespace {

/// What EXT_meshopt_compression, or KHR's of the same bitstreams, says of a buffer or a view.
std::optional<JsonPlace> meshopt_of(const JsonPlace& place) {
  const std::optional<JsonPlace> extensions = place.find("extensions");
  for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
    if (std::optional<JsonPlace> found = extensions ? extensions->find(name) : std::nullopt) {
      return found;
    }
  }
  return std::nullopt;
}

bool is_fallback(const JsonPlace& buffer) {
  const std::optional<JsonPlace> meshopt = meshopt_of(buffer);
  return meshopt && meshopt->boolean_or("fallback", false);
}

}  // namespace

GltfBuffers::GltfBuffers(const JsonPlace& root,
                         const std::optional<std::span<const std::byte>>& binary,
                         const std::optional<std::filesystem::path>& folder, const Limits& limits)
    : views_(root.items("bufferViews")),
      decoded_(views_.size()),
      accessors_(root.items("accessors")) {
  std::int64_t total = 0;
  for (const JsonPlace& buffer : root.items("buffers")) {
    const auto length =
        static_cast<std::size_t>(buffer.at("byteLength").integer(0, limits.mesh_file_bytes));
    const std::optional<JsonPlace> uri = buffer.find("uri");
    std::span<const std::byte> bytes;
    if (!uri && is_fallback(buffer)) {
      buffers_.emplace_back();  // of those who cannot read the compressed one
      continue;
    }
    if (!uri) {
      if (!binary || !buffers_.empty()) {
        buffer.fail("no \"uri\"", "one, but for the first buffer of a GLB file with a BIN chunk");
      }
      bytes = *binary;
    } else {
      if (uri->text().starts_with("data:")) {
        owned_.push_back(decode_data_uri(*uri));
      } else if (folder) {
        owned_.push_back(
            read_file_bytes(file_below(*folder, *uri), limits.mesh_file_bytes - total));
      } else {
        uri->fail(in_quotes(uri->text()) + " while reading from memory", "a data URI");
      }
      bytes = owned_.back();
    }
    if (bytes.size() < length) {
      buffer.fail(std::to_string(bytes.size()) + " bytes", std::to_string(length));
    }
    buffers_.push_back(bytes.first(length));
    total += static_cast<std::int64_t>(length);
    if (total > limits.mesh_file_bytes) {
      buffer.fail("buffers of more than " + std::to_string(limits.mesh_file_bytes) + " bytes",
                  "less");
    }
  }
  budget_ = kFreeNumbers + kNumbersPerByte * total;
  to_decode_ = std::min(limits.mesh_file_bytes, kFreeNumbers + kDecodedPerByte * total);
}

GltfBuffers::View GltfBuffers::view(const JsonPlace& index) {
  const std::int64_t last = std::ssize(views_) - 1;
  const auto number = static_cast<std::size_t>(index.integer(0, last));
  const std::optional<JsonPlace> meshopt = meshopt_of(views_[number]);
  std::span<const std::byte> bytes;
  if (meshopt) {
    std::optional<std::vector<std::byte>>& decoded = decoded_[number];
    if (!decoded) {
      decoded = decode_meshopt(*meshopt, stored_bytes(*meshopt), to_decode_);
      to_decode_ -= std::ssize(*decoded);
      budget_ += std::ssize(*decoded);
    }
    bytes = *decoded;
  } else {
    bytes = stored_bytes(views_[number]);
  }
  return {bytes, static_cast<std::size_t>(views_[number].integer_or("byteStride", 0, 4, 252))};
}

std::span<const std::byte> GltfBuffers::stored_bytes(const JsonPlace& place) const {
  const std::int64_t buffer = place.at("buffer").integer(0, std::ssize(buffers_) - 1);
  const std::span<const std::byte> bytes = buffers_[static_cast<std::size_t>(buffer)];
  const auto offset = static_cast<std::size_t>(place.integer_or("byteOffset", 0, 0, kMost));
  const auto length = static_cast<std::size_t>(place.at("byteLength").integer(0, kMost));
  if (offset > bytes.size() || length > bytes.size() - offset) {
    place.fail("bytes " + std::to_string(offset) + " to " + std::to_string(offset + length) +
                   " of a buffer of " + std::to_string(bytes.size()),
               "bytes inside the buffer");
  }
  return bytes.subspan(offset, length);
}

const JsonPlace& GltfBuffers::accessor(const JsonPlace& place) const {
  return accessors_[static_cast<std::size_t>(place.integer(0, std::ssize(accessors_) - 1))];
}

bool GltfBuffers::has_numbers(const JsonPlace& place) const {
  const JsonPlace& found = accessor(place);
  return found.has("bufferView") || found.has("sparse");
}

void GltfBuffers::pay(const JsonPlace& accessor, std::int64_t count, std::int64_t components) {
  if (count > budget_ / components) {
    accessor.fail(std::to_string(count) + " elements, too many for the bytes of the buffers",
                  "accessors that do not read the same bytes again and again");
  }
  budget_ -= count * components;
}

Eigen::MatrixXd GltfBuffers::read(const JsonPlace& place,
                                  std::initializer_list<std::string_view> types,
                                  std::int64_t max_count) {
  const JsonPlace& accessor = this->accessor(place);
  const JsonPlace type = accessor.at("type");
  if (std::find(types.begin(), types.end(), type.text()) == types.end()) {
    type.fail(in_quotes(type.text()) + " for " + place.where(), std::string(*types.begin()));
  }
  const std::int64_t count = accessor.at("count").integer(0, max_count);
  const int component = component_type(accessor);
  const bool normalized = accessor.boolean_or("normalized", false);
  const std::size_t size = component_size(component);
  const std::int64_t components = components_of(type);
  pay(accessor, count, components);
  const std::optional<JsonPlace> view_index = accessor.find("bufferView");
  std::size_t step = 0;
  std::span<const std::byte> bytes;
  if (view_index) {
    const View view = this->view(*view_index);
    const auto offset = static_cast<std::size_t>(accessor.integer_or("byteOffset", 0, 0, kMost));
    step = check_fits(accessor, view.bytes, offset, view.stride, static_cast<std::size_t>(count),
                      size * components);
    bytes = count > 0 ? view.bytes.subspan(offset) : std::span<const std::byte>();
  }
  // Only now, when the bytes are known to be there.
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(count, components);
  for (std::int64_t i = 0; view_index && i < count; ++i) {
    for (std::int64_t c = 0; c < components; ++c) {
      values(i, c) = component_at(bytes.data() + step * i + size * c, component, normalized);
    }
  }
  fill_sparse(accessor, component, normalized, values);
  if (!values.allFinite()) {
    accessor.fail("NaN or infinity", "finite numbers");
  }
  return values;
}

void GltfBuffers::fill_sparse(const JsonPlace& accessor, int component, bool normalized,
                              Eigen::MatrixXd& values) {
  const std::optional<JsonPlace> sparse = accessor.find("sparse");
  if (!sparse) {
    return;
  }
  const auto count = static_cast<std::size_t>(sparse->at("count").integer(0, values.rows()));
  const JsonPlace where = sparse->at("indices");
  const int index_type = component_type(where);
  if (index_type != UnsignedByte && index_type != UnsignedShort && index_type != UnsignedInt) {
    where.fail("signed or floating-point indices", "unsigned ones");
  }
  const std::span<const std::byte> indices = view(where.at("bufferView")).bytes;
  const auto index_offset = static_cast<std::size_t>(where.integer_or("byteOffset", 0, 0, kMost));
  const std::size_t index_step =
      check_fits(where, indices, index_offset, 0, count, component_size(index_type));
  const JsonPlace what = sparse->at("values");
  const std::span<const std::byte> data = view(what.at("bufferView")).bytes;
  const auto data_offset = static_cast<std::size_t>(what.integer_or("byteOffset", 0, 0, kMost));
  const std::size_t size = component_size(component);
  const auto components = static_cast<std::size_t>(values.cols());
  const std::size_t data_step = check_fits(what, data, data_offset, 0, count, size * components);
  double before = -1;
  for (std::size_t i = 0; i < count; ++i) {
    const double row =
        component_at(indices.data() + index_offset + i * index_step, index_type, false);
    if (row <= before || row >= static_cast<double>(values.rows())) {
      where.fail("index " + std::to_string(saturating_cast<std::int64_t>(row)),
                 "increasing indices below " + std::to_string(values.rows()));
    }
    before = row;
    for (std::size_t c = 0; c < components; ++c) {
      values(saturating_cast<Eigen::Index>(row), static_cast<Eigen::Index>(c)) =
          component_at(data.data() + data_offset + i * data_step + size * c, component, normalized);
    }
  }
}

Eigen::MatrixXi GltfBuffers::read_integers(const JsonPlace& place, std::string_view type,
                                           std::int64_t max_count) {
  const int component = component_type(accessor(place));
  if (component == Float) {
    accessor(place).fail("floating-point numbers for " + place.where(), "whole numbers");
  }
  const Eigen::MatrixXd values = read(place, {type}, max_count);
  if (values.size() > 0 && (values.maxCoeff() > 2'147'483'647.0 || values.minCoeff() < 0)) {
    accessor(place).fail("a number beyond 0 to 2^31", "indices");
  }
  return values.cast<int>();
}

}  // namespace atelier
