#include "core/io/npy.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <optional>

#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/utf8.h"

namespace atelier {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr std::size_t kLongestHeader = 64 << 10;

struct Header {
  std::string type;
  bool fortran_order = false;
  std::vector<std::int64_t> shape;
};

/// Parses the Python dictionary of an npy header: three keys, each once, nothing else.
class HeaderParser {
 public:
  HeaderParser(std::string_view text, const std::string& file, const Limits& limits)
      : text_(text), file_(file), limits_(limits) {}

  Header parse() {
    expect('{');
    std::optional<std::string> type;
    std::optional<bool> fortran_order;
    std::optional<std::vector<std::int64_t>> shape;
    while (!accept('}')) {
      const std::string key = quoted();
      expect(':');
      if (key == "descr" && !type) {
        type = type_text();
      } else if (key == "fortran_order" && !fortran_order) {
        fortran_order = boolean();
      } else if (key == "shape" && !shape) {
        shape = tuple();
      } else {
        fail("the key '" + key + "'", "descr, fortran_order and shape, each once");
      }
      if (!accept(',')) {
        expect('}');
        break;
      }
    }
    skip_space();
    if (at_ != text_.size()) {
      fail("text after the dictionary", "only spaces and a line end");
    }
    if (!type || !fortran_order || !shape) {
      fail("a key is missing", "descr, fortran_order and shape");
    }
    return {*type, *fortran_order, *shape};
  }

 private:
  void skip_space() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n' || text_[at_] == '\t')) {
      ++at_;
    }
  }

  bool accept(char c) {
    skip_space();
    if (at_ < text_.size() && text_[at_] == c) {
      ++at_;
      return true;
    }
    return false;
  }

  void expect(char c) {
    if (!accept(c)) {
      fail(rest(), std::string("'") + c + "'");
    }
  }

  std::string quoted() {
    skip_space();
    if (at_ >= text_.size() || (text_[at_] != '\'' && text_[at_] != '"')) {
      fail(rest(), "a quoted string");
    }
    const std::size_t begin = at_ + 1;
    const std::size_t end = text_.find(text_[at_], begin);
    if (end == std::string_view::npos || end - begin > 256 ||
        text_.substr(begin, end - begin).find('\\') != std::string_view::npos) {
      fail(rest(), "a short quoted string without escapes");
    }
    at_ = end + 1;
    return std::string(text_.substr(begin, end - begin));
  }

  std::string type_text() {
    skip_space();
    if (at_ < text_.size() && text_[at_] == '[') {
      fail("a structured type", "one plain type per array");
    }
    return quoted();
  }

  bool boolean() {
    skip_space();
    for (const bool value : {true, false}) {
      const std::string_view word = value ? "True" : "False";
      if (text_.substr(at_).starts_with(word)) {
        at_ += word.size();
        return value;
      }
    }
    fail(rest(), "True or False");
  }

  std::vector<std::int64_t> tuple() {
    std::vector<std::int64_t> sizes;
    expect('(');
    while (!accept(')')) {
      if (static_cast<std::int64_t>(sizes.size()) == limits_.tensor_rank) {
        fail("more than " + std::to_string(limits_.tensor_rank) + " dimensions", "fewer");
      }
      sizes.push_back(size());
      if (!accept(',')) {
        // In Python (3) is a number; only (3,) is a tuple.
        if (sizes.size() == 1) {
          fail(rest(), "a comma after the only dimension");
        }
        expect(')');
        break;
      }
    }
    return sizes;
  }

  std::int64_t size() {
    skip_space();
    std::int64_t value = 0;
    const auto [end, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error != std::errc() || value < 0) {
      fail(rest(), "a size");
    }
    at_ = static_cast<std::size_t>(end - text_.data());
    if (at_ < text_.size() && text_[at_] == 'L') {
      ++at_;  // Python 2 on Windows
    }
    return value;
  }

  std::string rest() const {
    return at_ >= text_.size() ? "the end of the header"
                               : "\"" + std::string(text_.substr(at_, 24)) + "\"";
  }

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw DataError(file_, "npy header, character " + std::to_string(at_), found, expected);
  }

  std::string_view text_;
  const std::string& file_;
  const Limits& limits_;
  std::size_t at_ = 0;
};

/// Meaning of a type string such as "<f8".
struct ItemType {
  ElementType type = ElementType::Float64;
  std::size_t bytes = 0;   ///< of one item, in the file
  std::size_t number = 0;  ///< bytes whose order is swapped together
  bool big_endian = false;
  bool unicode = false;  ///< Text: UTF-32 rather than bytes
};

ItemType item_type(const std::string& text, const std::string& file, const Limits& limits) {
  const auto refuse = [&](const std::string& found) -> ItemType {
    throw DataError(file, "npy header, descr", found,
                    "bool, integers, float16 to float64, complex or strings");
  };
  if (text.find('O') != std::string::npos) {
    return refuse("an array of Python objects ('" + text +
                  "'): it would have to be unpickled, which runs code");
  }
  if (text.size() < 3 || (text[0] != '<' && text[0] != '>' && text[0] != '|')) {
    return refuse("'" + text + "'");
  }
  std::size_t size = 0;
  const auto [end, error] = std::from_chars(text.data() + 2, text.data() + text.size(), size);
  if (error != std::errc() || end != text.data() + text.size()) {
    return refuse("'" + text + "'");
  }
  ItemType item{ElementType::Text, size, size, text[0] == '>', false};
  if (text[1] == 'S' || text[1] == 'a' || text[1] == 'U') {
    if (static_cast<std::int64_t>(size) > limits.text_string_bytes) {
      return refuse("strings of " + std::to_string(size) + " characters");
    }
    item.unicode = text[1] == 'U';
    item.bytes = item.unicode ? 4 * size : size;
    item.number = item.unicode ? 4 : 1;
    return item;
  }
  const std::string kind = text.substr(1);
  static constexpr std::pair<const char*, ElementType> kKinds[] = {
      {"b1", ElementType::Bool},       {"?1", ElementType::Bool},
      {"i1", ElementType::Int8},       {"i2", ElementType::Int16},
      {"i4", ElementType::Int32},      {"i8", ElementType::Int64},
      {"u1", ElementType::UInt8},      {"u2", ElementType::UInt16},
      {"u4", ElementType::UInt32},     {"u8", ElementType::UInt64},
      {"f2", ElementType::Float16},    {"f4", ElementType::Float32},
      {"f8", ElementType::Float64},    {"c8", ElementType::Complex64},
      {"c16", ElementType::Complex128}};
  const auto* found = std::find_if(std::begin(kKinds), std::end(kKinds),
                                   [&](const auto& candidate) { return kind == candidate.first; });
  if (found == std::end(kKinds) || (text[0] == '|' && size > 1)) {
    return refuse("'" + text + "'");
  }
  item.type = found->second;
  if (text[1] == 'c') {
    item.number = size / 2;
  }
  return item;
}

/// Copies items so that they come out row-major.
void copy_row_major(std::span<const std::byte> source, const Header& header, std::size_t item_bytes,
                    std::byte* target) {
  const std::vector<std::int64_t>& shape = header.shape;
  if (source.empty()) {
    return;
  }
  if (!header.fortran_order || shape.size() < 2) {
    std::memcpy(target, source.data(), source.size());
    return;
  }
  std::vector<std::size_t> strides(shape.size(), item_bytes);
  for (std::size_t d = 1; d < shape.size(); ++d) {
    strides[d] = strides[d - 1] * static_cast<std::size_t>(shape[d - 1]);
  }
  std::vector<std::int64_t> index(shape.size(), 0);
  std::size_t offset = 0;
  for (std::size_t done = 0; done < source.size(); done += item_bytes) {
    std::memcpy(target + done, source.data() + offset, item_bytes);
    for (std::size_t d = shape.size(); d-- > 0;) {
      offset += strides[d];
      if (++index[d] < shape[d]) {
        break;
      }
      offset -= strides[d] * static_cast<std::size_t>(shape[d]);
      index[d] = 0;
    }
  }
}

void swap_bytes(std::vector<std::byte>& data, std::size_t number) {
  for (std::size_t i = 0; i + number <= data.size(); i += number) {
    std::reverse(data.begin() + static_cast<std::ptrdiff_t>(i),
                 data.begin() + static_cast<std::ptrdiff_t>(i + number));
  }
}

void append_utf8(std::string& text, std::uint32_t code) {
  if (code < 0x80) {
    text += static_cast<char>(code);
  } else if (code < 0x800) {
    text += static_cast<char>(0xC0 | (code >> 6));
    text += static_cast<char>(0x80 | (code & 0x3F));
  } else if (code < 0x10000) {
    text += static_cast<char>(0xE0 | (code >> 12));
    text += static_cast<char>(0x80 | ((code >> 6) & 0x3F));
    text += static_cast<char>(0x80 | (code & 0x3F));
  } else {
    text += static_cast<char>(0xF0 | (code >> 18));
    text += static_cast<char>(0x80 | ((code >> 12) & 0x3F));
    text += static_cast<char>(0x80 | ((code >> 6) & 0x3F));
    text += static_cast<char>(0x80 | (code & 0x3F));
  }
}

/// One item as text; NumPy pads with zeros at the end.
std::string text_item(std::span<const std::byte> item, bool unicode, const std::string& file,
                      std::size_t i) {
  std::string text;
  if (!unicode) {
    text.assign(reinterpret_cast<const char*>(item.data()), item.size());
    text.erase(text.find_last_not_of('\0') + 1);
    if (std::any_of(text.begin(), text.end(), [](char c) { return c <= 0; })) {
      throw DataError(file, "string " + std::to_string(i), "a byte that is no ASCII character",
                      "ASCII in a byte string (or a unicode array)");
    }
    return text;
  }
  for (std::size_t at = 0; at < item.size(); at += 4) {
    std::uint32_t code = 0;
    std::memcpy(&code, item.data() + at, 4);
    if (code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) {
      throw DataError(file, "string " + std::to_string(i), "the code point " + std::to_string(code),
                      "Unicode");
    }
    append_utf8(text, code);
  }
  text.erase(text.find_last_not_of('\0') + 1);
  return text;
}

/// Size of a whole file, by its beginning.
struct Layout {
  Header header;
  ItemType item;
  std::size_t count = 0;       ///< items
  std::size_t data_at = 0;     ///< byte where the items begin
  std::size_t data_bytes = 0;  ///< up to the end of the file
};

/// @param start  the file, or so much of it that the longest header is in it
Layout layout_of(std::span<const std::byte> start, std::uint64_t file_bytes,
                 const std::string& file, const Limits& limits) {
  ByteReader reader(start, file);
  if (reader.remaining() < kMagic.size() || reader.text(kMagic.size(), "magic") != kMagic) {
    throw DataError(file, "byte 0", "not an npy file", "\\x93NUMPY");
  }
  const auto major = reader.little<std::uint8_t>("version");
  const auto minor = reader.little<std::uint8_t>("version");
  if (major < 1 || major > 3 || minor != 0) {
    reader.fail("npy version " + std::to_string(major) + "." + std::to_string(minor),
                "1.0, 2.0 or 3.0");
  }
  const std::size_t header_bytes = major == 1 ? reader.little<std::uint16_t>("header length")
                                              : reader.little<std::uint32_t>("header length");
  if (header_bytes > kLongestHeader) {
    reader.fail("a header of " + std::to_string(header_bytes) + " bytes",
                "at most " + std::to_string(kLongestHeader));
  }
  const Header header =
      HeaderParser(reader.text(header_bytes, "the npy header"), file, limits).parse();
  const ItemType item = item_type(header.type, file, limits);

  // An item of no bytes is paid for as if it had one.
  const std::int64_t most =
      item.type == ElementType::Text
          ? limits.text_values
          : limits.tensor_bytes / static_cast<std::int64_t>(std::max<std::size_t>(item.bytes, 1));
  const auto count = element_count(header.shape, most);
  if (!count) {
    reader.fail("shape " + shape_text(header.shape) + " of " + header.type,
                "at most " + std::to_string(most) + " elements");
  }
  const std::size_t data_bytes = static_cast<std::size_t>(*count) * item.bytes;
  const std::size_t data_at = start.size() - reader.remaining();
  if (data_bytes != file_bytes - data_at) {
    reader.fail(
        std::to_string(file_bytes - data_at) + " bytes of data",
        std::to_string(data_bytes) + " bytes for " + header.type + " " + shape_text(header.shape));
  }
  return {header, item, static_cast<std::size_t>(*count), data_at, data_bytes};
}

}  // namespace

Tensor parse_npy(std::span<const std::byte> bytes, const std::string& file, const Limits& limits) {
  static_assert(std::endian::native == std::endian::little);
  const auto [header, item, count, data_at, data_bytes] =
      layout_of(bytes, bytes.size(), file, limits);
  Tensor tensor{item.type, header.shape, {}, {}};
  std::vector<std::byte> data(data_bytes);
  copy_row_major(bytes.subspan(data_at), header, item.bytes, data.data());
  if (item.big_endian && item.number > 1) {
    swap_bytes(data, item.number);
  }
  if (item.type == ElementType::Text) {
    tensor.strings.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      tensor.strings.push_back(
          text_item(std::span<const std::byte>(data).subspan(i * item.bytes, item.bytes),
                    item.unicode, file, i));
    }
    return tensor;
  }
  if (item.type == ElementType::Bool &&
      std::any_of(data.begin(), data.end(), [](std::byte b) { return b > std::byte{1}; })) {
    throw DataError(file, "data", "a bool that is neither 0 nor 1", "0 or 1");
  }
  tensor.data = std::move(data);
  return tensor;
}

Tensor read_npy(const std::filesystem::path& path, const Limits& limits) {
  constexpr std::int64_t kStart = 12 + static_cast<std::int64_t>(kLongestHeader);
  const FileStart start = read_file_start(path, kStart, limits.tensor_bytes);
  layout_of(start.bytes, start.file_bytes, path.string(), limits);
  return parse_npy(read_file_bytes(path, limits.tensor_bytes), path.string(), limits);
}

namespace {

/// The code points of a text, for NumPy's unicode arrays: names in byte arrays are found by nobody
/// who looks for a str.
std::vector<std::uint32_t> code_points(const std::string& text) {
  ATELIER_CHECK(
      find_malformed_utf8(text) == std::string::npos && text.find('\0') == std::string::npos,
      "only UTF-8 without NUL is written: " + text);
  std::vector<std::uint32_t> codes;
  for (const char c : text) {
    const auto byte = static_cast<std::uint8_t>(c);
    if (byte < 0x80) {
      codes.push_back(byte);
    } else if (byte < 0xC0) {
      codes.back() = (codes.back() << 6) | (byte & 0x3Fu);
    } else {
      codes.push_back(byte & (byte < 0xE0 ? 0x1Fu : byte < 0xF0 ? 0x0Fu : 0x07u));
    }
  }
  return codes;
}

std::string npy_type(const Tensor& tensor) {
  switch (tensor.type) {
    case ElementType::Bool:
      return "|b1";
    case ElementType::Int8:
      return "|i1";
    case ElementType::UInt8:
      return "|u1";
    case ElementType::Int16:
      return "<i2";
    case ElementType::Int32:
      return "<i4";
    case ElementType::Int64:
      return "<i8";
    case ElementType::UInt16:
      return "<u2";
    case ElementType::UInt32:
      return "<u4";
    case ElementType::UInt64:
      return "<u8";
    case ElementType::Float16:
      return "<f2";
    case ElementType::Float32:
      return "<f4";
    case ElementType::Float64:
      return "<f8";
    case ElementType::Complex64:
      return "<c8";
    case ElementType::Complex128:
      return "<c16";
    case ElementType::BFloat16:
    case ElementType::Text:
      break;
  }
  ATELIER_CHECK(tensor.type == ElementType::Text, "NumPy has no bfloat16");
  std::size_t longest = 1;
  for (const std::string& text : tensor.strings) {
    longest = std::max(longest, code_points(text).size());
  }
  return "<U" + std::to_string(longest);
}

void append(std::vector<std::byte>& bytes, std::string_view text) {
  const auto view = std::as_bytes(std::span(text));
  bytes.insert(bytes.end(), view.begin(), view.end());
}

}  // namespace

std::vector<std::byte> npy_bytes(const Tensor& tensor) {
  check_tensor(tensor);
  const std::string type = npy_type(tensor);
  std::string shape;
  for (const std::int64_t size : tensor.shape) {
    shape += std::to_string(size) + ", ";
  }
  std::string header =
      "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
  // Magic, version and length are 10 bytes; data start at a multiple of 64.
  header.append(63 - (10 + header.size()) % 64, ' ');
  header += '\n';
  std::vector<std::byte> bytes;
  append(bytes, kMagic);
  append(bytes, std::string_view("\x01\x00", 2));
  bytes.push_back(static_cast<std::byte>(header.size() & 0xFF));
  bytes.push_back(static_cast<std::byte>(header.size() >> 8));
  append(bytes, header);
  if (tensor.type != ElementType::Text) {
    bytes.insert(bytes.end(), tensor.data.begin(), tensor.data.end());
    return bytes;
  }
  const std::size_t width = std::stoul(type.substr(2));
  for (const std::string& text : tensor.strings) {
    std::vector<std::uint32_t> padded = code_points(text);
    padded.resize(width, 0);
    const auto view = std::as_bytes(std::span(padded));
    bytes.insert(bytes.end(), view.begin(), view.end());
  }
  return bytes;
}

}  // namespace atelier
