#include "core/io/safetensors.h"

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/atomic_file.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"

namespace atelier {
namespace {

constexpr const char* kMetadata = "__metadata__";

constexpr std::array<std::pair<const char*, ElementType>, 13> kElementTypes = {{
    {"BOOL", ElementType::Bool},
    {"I8", ElementType::Int8},
    {"I16", ElementType::Int16},
    {"I32", ElementType::Int32},
    {"I64", ElementType::Int64},
    {"U8", ElementType::UInt8},
    {"U16", ElementType::UInt16},
    {"U32", ElementType::UInt32},
    {"U64", ElementType::UInt64},
    {"F16", ElementType::Float16},
    {"BF16", ElementType::BFloat16},
    {"F32", ElementType::Float32},
    {"F64", ElementType::Float64},
}};

/// One tensor as the header tells it.
struct TensorEntry {
  std::string name;
  ElementType type = ElementType::Float32;
  std::vector<std::int64_t> shape;
  std::uint64_t begin = 0;  ///< bytes from the end of the header
  std::uint64_t end = 0;
};

/// Reads the entries of a header.
class HeaderReader {
 public:
  HeaderReader(const std::string& file, const Limits& limits) : file_(file), limits_(limits) {}

  TensorEntry entry(const std::string& name, const nlohmann::json& value) const {
    if (!value.is_object() || value.size() != 3) {
      fail(name, "not exactly three fields", "dtype, shape and data_offsets");
    }
    TensorEntry entry;
    entry.name = name;
    entry.type = type(name, field(name, value, "dtype"));
    const nlohmann::json& shape = field(name, value, "shape");
    if (!shape.is_array() || static_cast<std::int64_t>(shape.size()) > limits_.tensor_rank) {
      fail(name, "a shape that is no list or has too many dimensions",
           "at most " + std::to_string(limits_.tensor_rank) + " sizes");
    }
    for (const nlohmann::json& size : shape) {
      entry.shape.push_back(
          static_cast<std::int64_t>(natural(name, size, std::numeric_limits<std::int64_t>::max())));
    }
    const nlohmann::json& offsets = field(name, value, "data_offsets");
    if (!offsets.is_array() || offsets.size() != 2) {
      fail(name, "data_offsets that are no two numbers", "[begin, end]");
    }
    entry.begin = natural(name, offsets[0], std::numeric_limits<std::uint64_t>::max());
    entry.end = natural(name, offsets[1], std::numeric_limits<std::uint64_t>::max());
    const auto item = static_cast<std::int64_t>(element_bytes(entry.type));
    const auto count = element_count(entry.shape, limits_.tensor_bytes / item);
    if (!count) {
      fail(name, "shape " + shape_text(entry.shape),
           "at most " + std::to_string(limits_.tensor_bytes) + " bytes");
    }
    if (entry.end < entry.begin ||
        entry.end - entry.begin != static_cast<std::uint64_t>(*count * item)) {
      fail(name, "bytes " + std::to_string(entry.begin) + " to " + std::to_string(entry.end),
           std::to_string(*count * item) + " bytes for " + element_type_name(entry.type) + " " +
               shape_text(entry.shape));
    }
    return entry;
  }

  std::map<std::string, std::string> metadata(const nlohmann::json& value) const {
    std::map<std::string, std::string> texts;
    if (!value.is_object()) {
      fail(kMetadata, "not an object", "texts by name");
    }
    for (const auto& [key, text] : value.items()) {
      if (!text.is_string()) {
        fail(kMetadata, "\"" + key.substr(0, 40) + "\" is no text", "texts only");
      }
      texts.emplace(key, text.get<std::string>());
    }
    return texts;
  }

  [[noreturn]] void fail(const std::string& name, const std::string& found,
                         const std::string& expected) const {
    throw DataError(file_, "tensor " + name.substr(0, 200), found, expected);
  }

 private:
  const nlohmann::json& field(const std::string& name, const nlohmann::json& value,
                              const char* key) const {
    const auto found = value.find(key);
    if (found == value.end()) {
      fail(name, std::string("no ") + key, "dtype, shape and data_offsets");
    }
    return *found;
  }

  std::uint64_t natural(const std::string& name, const nlohmann::json& value,
                        std::uint64_t largest) const {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > largest) {
      fail(name, value.dump().substr(0, 40), "a size");
    }
    return value.get<std::uint64_t>();
  }

  ElementType type(const std::string& name, const nlohmann::json& value) const {
    // Text with text: JSON compared with text makes a value of it where nothing may throw.
    const auto* word = value.get_ptr<const std::string*>();
    for (const auto& [text, type] : kElementTypes) {
      if (word != nullptr && *word == text) {
        return type;
      }
    }
    fail(name, "dtype " + value.dump().substr(0, 40), "BOOL, I8 to U64, F16, BF16, F32 or F64");
  }

  const std::string& file_;
  const Limits& limits_;
};

const char* type_text(ElementType type) {
  for (const auto& [text, candidate] : kElementTypes) {
    if (candidate == type) {
      return text;
    }
  }
  throw LogicError(std::string("safetensors cannot hold ") + element_type_name(type));
}

void append_header(std::vector<std::byte>& bytes, std::string_view text) {
  const auto view = std::as_bytes(std::span(text));
  bytes.insert(bytes.end(), view.begin(), view.end());
}

/// Size of a whole file, by its beginning.
struct TensorFileLayout {
  std::map<std::string, std::string> metadata;
  std::vector<TensorEntry> entries;  ///< sorted; the file's bytes from `data_at` on, without a gap
  std::size_t data_at = 0;
};

/// @param start  the file, or so much of it that the longest header is in it
TensorFileLayout tensor_file_layout(std::span<const std::byte> start, std::uint64_t file_bytes,
                                    const std::string& file, const Limits& limits) {
  ByteReader reader(start, file);
  const auto header_bytes = reader.little<std::uint64_t>("the header's length");
  if (header_bytes > static_cast<std::uint64_t>(limits.safetensors_header_bytes)) {
    reader.fail("a header of " + std::to_string(header_bytes) + " bytes",
                "at most " + std::to_string(limits.safetensors_header_bytes));
  }
  const std::string_view text = reader.text(static_cast<std::size_t>(header_bytes), "the header");
  // The format asks for this: no byte order mark, no space in front.
  if (!text.starts_with('{')) {
    reader.fail("a header that does not begin with {", "a JSON object");
  }
  const nlohmann::json header = parse_json(text, file, limits);
  if (static_cast<std::int64_t>(header.size()) > limits.safetensors_entries) {
    reader.fail(std::to_string(header.size()) + " tensors",
                "at most " + std::to_string(limits.safetensors_entries));
  }
  TensorFileLayout layout;
  std::vector<TensorEntry>& entries = layout.entries;
  const HeaderReader header_reader(file, limits);
  for (const auto& [name, value] : header.items()) {
    if (name == kMetadata) {
      layout.metadata = header_reader.metadata(value);
    } else {
      entries.push_back(header_reader.entry(name, value));
    }
  }
  std::sort(entries.begin(), entries.end(), [](const TensorEntry& a, const TensorEntry& b) {
    return std::pair(a.begin, a.end) < std::pair(b.begin, b.end);
  });
  layout.data_at = start.size() - reader.remaining();
  const std::uint64_t data_bytes = file_bytes - layout.data_at;
  std::uint64_t at = 0;
  for (const TensorEntry& entry : entries) {
    // Also for tensors of no bytes: they may not point just anywhere.
    if (entry.begin != at) {
      header_reader.fail(entry.name,
                         std::string(entry.begin < at ? "an overlap" : "a gap") + " before byte " +
                             std::to_string(entry.begin),
                         "data from byte " + std::to_string(at));
    }
    if (entry.end > data_bytes) {
      header_reader.fail(entry.name, "data to byte " + std::to_string(entry.end),
                         std::to_string(data_bytes) + " bytes, as there are");
    }
    at = entry.end;
  }
  if (at != data_bytes) {
    throw DataError(file, "", std::to_string(data_bytes - at) + " bytes after the last tensor",
                    "none");
  }
  return layout;
}

}  // namespace

Safetensors parse_safetensors(std::span<const std::byte> bytes, const std::string& file,
                              const Limits& limits) {
  const TensorFileLayout layout = tensor_file_layout(bytes, bytes.size(), file, limits);
  Safetensors content;
  content.metadata = layout.metadata;
  for (const TensorEntry& entry : layout.entries) {
    Tensor tensor{entry.type, entry.shape, {}, {}};
    const auto data = bytes.subspan(layout.data_at + static_cast<std::size_t>(entry.begin),
                                    static_cast<std::size_t>(entry.end - entry.begin));
    if (entry.type == ElementType::Bool &&
        std::any_of(data.begin(), data.end(), [](std::byte b) { return b > std::byte{1}; })) {
      HeaderReader(file, limits).fail(entry.name, "a bool that is neither 0 nor 1", "0 or 1");
    }
    tensor.data.assign(data.begin(), data.end());
    content.tensors.emplace(entry.name, std::move(tensor));
  }
  return content;
}

Safetensors read_safetensors(const std::filesystem::path& path, const Limits& limits) {
  const FileStart start =
      read_file_start(path, 8 + limits.safetensors_header_bytes, limits.tensor_bytes);
  tensor_file_layout(start.bytes, start.file_bytes, path.string(), limits);
  return parse_safetensors(read_file_bytes(path, limits.tensor_bytes), path.string(), limits);
}

std::vector<std::byte> safetensors_bytes(const Safetensors& content) {
  std::vector<const std::pair<const std::string, Tensor>*> order;
  for (const auto& entry : content.tensors) {
    check_tensor(entry.second);
    type_text(entry.second.type);
    ATELIER_CHECK(entry.first != kMetadata, "a tensor may not be named __metadata__");
    ATELIER_CHECK(entry.second.shape.size() <= 8, entry.first + " has too many dimensions");
    order.push_back(&entry);
  }
  std::stable_sort(order.begin(), order.end(), [](const auto* a, const auto* b) {
    return element_bytes(a->second.type) > element_bytes(b->second.type);
  });
  nlohmann::json header = nlohmann::json::object();
  if (!content.metadata.empty()) {
    header[kMetadata] = content.metadata;
  }
  std::uint64_t at = 0;
  for (const auto* entry : order) {
    const Tensor& tensor = entry->second;
    header[entry->first] = {{"dtype", type_text(tensor.type)},
                            {"shape", tensor.shape},
                            {"data_offsets", {at, at + tensor.data.size()}}};
    at += tensor.data.size();
  }
  std::string text = header.dump(-1, ' ', true);
  text.append((8 - text.size() % 8) % 8, ' ');
  const Limits limits;
  ATELIER_CHECK(static_cast<std::int64_t>(text.size()) <= limits.safetensors_header_bytes &&
                    static_cast<std::int64_t>(header.size()) <= limits.safetensors_entries,
                "too many tensors or too long names for one file");
  std::vector<std::byte> bytes;
  bytes.reserve(8 + text.size() + static_cast<std::size_t>(at));
  for (int shift = 0; shift < 64; shift += 8) {
    bytes.push_back(static_cast<std::byte>(text.size() >> shift));
  }
  append_header(bytes, text);
  for (const auto* entry : order) {
    bytes.insert(bytes.end(), entry->second.data.begin(), entry->second.data.end());
  }
  return bytes;
}

void write_safetensors(const std::filesystem::path& path, const Safetensors& content) {
  AtomicFile file(path);
  file.write(safetensors_bytes(content));
  file.commit();
}

}  // namespace atelier
