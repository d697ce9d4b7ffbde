#include "core/archive_index.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/sha256.h"

namespace atelier {
namespace {

constexpr std::size_t kLongestName = 255;

std::string percent_encoded(std::string_view text) {
  static constexpr char kDigits[] = "0123456789ABCDEF";
  std::string encoded;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte > 0x20 && byte < 0x7F && byte != '%') {
      encoded += c;
    } else {
      encoded += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    }
  }
  return encoded;
}

std::string number_text(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

/// Walks over the lines and words of an index.
class IndexParser {
 public:
  IndexParser(std::string_view block, const std::string& file, const Limits& limits)
      : rest_(block), file_(file), limits_(limits) {}

  ArchiveIndex parse(std::uint64_t file_bytes) {
    ArchiveIndex index;
    first_line();
    index.block_bytes = only<std::uint64_t>("block");
    index.file_bytes = only<std::uint64_t>("size");
    if (index.file_bytes != file_bytes) {
      fail("a file of " + std::to_string(file_bytes) + " bytes",
           std::to_string(index.file_bytes) + " bytes, as its index says");
    }
    open("schema");
    index.head.schema = name(false);
    index.head.version = number<int>();
    close();
    open("units");
    index.head.units = name(false);
    close();
    open("up");
    index.head.up_axis = word();
    if (index.head.up_axis != "x" && index.head.up_axis != "y" && index.head.up_axis != "z") {
      fail("the up axis " + index.head.up_axis, "x, y or z");
    }
    close();
    while (next_is("number")) {
      open("number");
      const std::string key = name(false);
      if (!index.head.numbers.emplace(key, finite()).second) {
        fail("the number " + key + " twice", "each name once");
      }
      close();
    }
    while (next_is("text")) {
      open("text");
      const std::string key = name(false);
      if (!index.head.texts.emplace(key, percent_decoded()).second) {
        fail("the text " + key + " twice", "each name once");
      }
      close();
    }
    while (next_is("dataset")) {
      index.datasets.push_back(dataset());
    }
    open("end");
    close();
    if (std::any_of(rest_.begin(), rest_.end(), [](char c) { return c != '\0'; })) {
      fail("text after the end of the index", "zeros");
    }
    check_extents(index);
    return index;
  }

  std::uint64_t block_bytes() {
    first_line();
    const auto bytes = only<std::uint64_t>("block");
    if (!std::has_single_bit(bytes) || bytes < 512 || bytes > kArchiveBlockMax) {
      fail("a user block of " + std::to_string(bytes) + " bytes",
           "a power of two from 512 to " + std::to_string(kArchiveBlockMax));
    }
    return bytes;
  }

 private:
  void first_line() {
    if (rest_.size() < kArchiveFirstLine || !rest_.starts_with(kArchiveMagic) ||
        rest_[kArchiveFirstLine - 1] != '\n' ||
        !digest_from_hex(rest_.substr(kArchiveMagic.size(), 64))) {
      throw DataError(file_, "byte 0", "no archive of Atelier", "ATELIER-ARCHIVE 1 <SHA-256>");
    }
    rest_.remove_prefix(kArchiveFirstLine);
    line_ = 1;
  }

  bool next_is(std::string_view key) const {
    return rest_.starts_with(key) && rest_.size() > key.size() && rest_[key.size()] == ' ';
  }

  /// Enters the next line, which must begin with this word.
  void open(std::string_view key) {
    ++line_;
    const std::size_t end = rest_.find('\n');
    if (end == std::string_view::npos) {
      fail("the index ends", std::string(key));
    }
    line_text_ = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    if (word() != key) {
      fail("\"" + std::string(line_text_.substr(0, 40)) + "\"",
           "a line \"" + std::string(key) + "\"");
    }
  }

  /// Leaves the line, which must have been read whole.
  void close() {
    if (!line_text_.empty()) {
      fail("\"" + std::string(line_text_.substr(0, 40)) + "\"", "the end of the line");
    }
  }

  std::string word() {
    const std::size_t end = std::min(line_text_.find(' '), line_text_.size());
    std::string text(line_text_.substr(0, end));
    line_text_.remove_prefix(std::min(end + 1, line_text_.size()));
    return text;
  }

  template <class T>
  T number_of(std::string_view text) const {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
      fail("\"" + std::string(text.substr(0, 40)) + "\"", "a number");
    }
    return value;
  }

  template <class T>
  T number() {
    return number_of<T>(word());
  }

  double finite() {
    const auto value = number<double>();
    if (!std::isfinite(value)) {
      fail("a number that is not finite", "a finite number");
    }
    return value;
  }

  template <class T>
  T only(std::string_view key) {
    open(key);
    const T value = number<T>();
    close();
    return value;
  }

  std::string name(bool slashes) {
    std::string text = word();
    if (!is_archive_name(text, slashes)) {
      fail("the name \"" + text.substr(0, 40) + "\"", "letters, digits, \"_\", \"-\" and \".\"");
    }
    return text;
  }

  std::string percent_decoded() {
    const std::string encoded = word();
    if (static_cast<std::int64_t>(encoded.size()) > 3 * limits_.text_string_bytes) {
      fail("a text of " + std::to_string(encoded.size()) + " bytes", "a shorter one");
    }
    std::string text;
    for (std::size_t i = 0; i < encoded.size(); ++i) {
      if (encoded[i] != '%') {
        text += encoded[i];
        continue;
      }
      unsigned value = 0;
      const char* begin = encoded.data() + i + 1;
      if (encoded.size() - i < 3 || std::from_chars(begin, begin + 2, value, 16).ptr != begin + 2) {
        fail("a bad percent code", "% and two hexadecimal digits");
      }
      text += static_cast<char>(value);
      i += 2;
    }
    return text;
  }

  std::vector<std::int64_t> shape() {
    const std::string text = word();
    std::vector<std::int64_t> sizes;
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(',', begin), text.size());
      if (static_cast<std::int64_t>(sizes.size()) == limits_.tensor_rank) {
        fail("more than " + std::to_string(limits_.tensor_rank) + " dimensions", "fewer");
      }
      sizes.push_back(number_of<std::int64_t>(std::string_view(text).substr(begin, end - begin)));
      begin = end + 1;
    }
    return sizes;
  }

  ArchivedDataset dataset() {
    open("dataset");
    ArchivedDataset entry;
    entry.name = name(true);
    std::string type = word();
    if (type.starts_with("text:")) {
      entry.text_bytes = number_of<std::size_t>(std::string_view(type).substr(5));
      type = "text";
      if (entry.text_bytes == 0 ||
          static_cast<std::int64_t>(entry.text_bytes) > limits_.text_string_bytes) {
        fail("strings of " + std::to_string(entry.text_bytes) + " bytes",
             "1 to " + std::to_string(limits_.text_string_bytes));
      }
    }
    const auto known = element_type_of(type);
    if (!known || !is_archive_type(*known) ||
        (*known == ElementType::Text) != (entry.text_bytes > 0)) {
      fail("elements of type \"" + type + "\"", "a type that archives hold");
    }
    entry.type = *known;
    entry.shape = shape();
    const auto item = static_cast<std::int64_t>(entry.item_bytes());
    const std::int64_t most = entry.type == ElementType::Text
                                  ? std::min(limits_.text_values, limits_.tensor_bytes / item)
                                  : limits_.tensor_bytes / item;
    const auto count = element_count(entry.shape, most);
    if (!count) {
      fail("shape " + shape_text(entry.shape) + " of " + entry.name,
           "at most " + std::to_string(limits_.tensor_bytes) + " bytes");
    }
    entry.chunk_rows = number<std::int64_t>();
    const std::int64_t rows = entry.shape[0];
    if (*count == 0 ? entry.chunk_rows != 0 : (entry.chunk_rows < 1 || entry.chunk_rows > rows)) {
      fail("chunks of " + std::to_string(entry.chunk_rows) + " rows",
           "1 to " + std::to_string(rows));
    }
    const std::int64_t chunks = *count == 0 ? 0 : (rows - 1) / entry.chunk_rows + 1;
    // Each offset takes two characters of the line at least.
    if (chunks > static_cast<std::int64_t>(line_text_.size() + 1) / 2) {
      fail("too few offsets", std::to_string(chunks));
    }
    for (std::int64_t i = 0; i < chunks; ++i) {
      entry.offsets.push_back(number<std::uint64_t>());
    }
    close();
    return entry;
  }

  /// Every chunk lies after the user block, inside the file, and apart from all others.
  void check_extents(const ArchiveIndex& index) const {
    struct Extent {
      std::uint64_t begin, end;
    };
    std::vector<Extent> extents;
    for (std::size_t i = 0; i < index.datasets.size(); ++i) {
      const ArchivedDataset& entry = index.datasets[i];
      if (i > 0 && !(index.datasets[i - 1].name < entry.name)) {
        fail("the dataset " + entry.name + " out of order", "sorted names, each once");
      }
      if (entry.offsets.empty()) {
        continue;
      }
      // The product is at most the dataset's bytes, which have a ceiling.
      std::uint64_t chunk_bytes = static_cast<std::uint64_t>(entry.chunk_rows) * entry.item_bytes();
      for (std::size_t d = 1; d < entry.shape.size(); ++d) {
        chunk_bytes *= static_cast<std::uint64_t>(entry.shape[d]);
      }
      for (const std::uint64_t offset : entry.offsets) {
        if (offset < index.block_bytes || offset > index.file_bytes ||
            index.file_bytes - offset < chunk_bytes) {
          fail(entry.name + " at byte " + std::to_string(offset) + ", outside of the data",
               std::to_string(index.block_bytes) + " to " + std::to_string(index.file_bytes));
        }
        extents.push_back({offset, offset + chunk_bytes});
      }
    }
    std::sort(extents.begin(), extents.end(),
              [](const Extent& a, const Extent& b) { return a.begin < b.begin; });
    for (std::size_t i = 1; i < extents.size(); ++i) {
      if (extents[i].begin < extents[i - 1].end) {
        fail("two chunks that overlap at byte " + std::to_string(extents[i].begin),
             "chunks apart from each other");
      }
    }
  }

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw DataError(file_, "index, line " + std::to_string(line_), found, expected);
  }

  std::string_view rest_;
  std::string_view line_text_;
  const std::string& file_;
  const Limits& limits_;
  int line_ = 0;
};

}  // namespace

bool is_archive_type(ElementType type) {
  return type <= ElementType::UInt64 || type == ElementType::Float32 ||
         type == ElementType::Float64 || type == ElementType::Text;
}

bool is_archive_name(std::string_view name, bool slashes) {
  if (name.empty() || name.size() > kLongestName || name.front() == '/' || name.back() == '/' ||
      name.find("//") != std::string_view::npos) {
    return false;
  }
  // "." and ".." mean something in HDF5 paths.
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find('/', begin), name.size());
    const std::string_view part = name.substr(begin, end - begin);
    if (part == "." || part == "..") {
      return false;
    }
    begin = end + 1;
  }
  return std::all_of(name.begin(), name.end(), [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.' || (slashes && c == '/');
  });
}

std::string archive_index_text(const ArchiveIndex& index) {
  std::string text = "block " + std::to_string(index.block_bytes) + "\nsize " +
                     std::to_string(index.file_bytes) + "\nschema " + index.head.schema + " " +
                     std::to_string(index.head.version) + "\nunits " + index.head.units + "\nup " +
                     index.head.up_axis + "\n";
  for (const auto& [name, value] : index.head.numbers) {
    text += "number " + name + " " + number_text(value) + "\n";
  }
  for (const auto& [name, value] : index.head.texts) {
    text += "text " + name + " " + percent_encoded(value) + "\n";
  }
  for (const ArchivedDataset& entry : index.datasets) {
    text += "dataset " + entry.name + " " + element_type_name(entry.type);
    if (entry.type == ElementType::Text) {
      text += ":" + std::to_string(entry.text_bytes);
    }
    for (std::size_t d = 0; d < entry.shape.size(); ++d) {
      text += (d == 0 ? " " : ",") + std::to_string(entry.shape[d]);
    }
    text += " " + std::to_string(entry.chunk_rows);
    for (const std::uint64_t offset : entry.offsets) {
      text += " " + std::to_string(offset);
    }
    text += "\n";
  }
  return text + "end\n";
}

std::uint64_t archive_block_bytes(std::string_view prefix, const std::string& file) {
  return IndexParser(prefix, file, {}).block_bytes();
}

ArchiveIndex parse_archive_index(std::string_view block, std::uint64_t file_bytes,
                                 const std::string& file, const Limits& limits) {
  ArchiveIndex index = IndexParser(block, file, limits).parse(file_bytes);
  ATELIER_CHECK(index.block_bytes == block.size(), "the block has been found by its own size");
  return index;
}

}  // namespace atelier
