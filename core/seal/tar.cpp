#include "core/seal/tar.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/utf8.h"

namespace atelier {
namespace {

constexpr std::int64_t kTarBlock = 512;
constexpr std::int64_t kMaxEntries = 4'000'000;
constexpr std::int64_t kMaxExtended = 16'384;             ///< bytes of an extended header
constexpr std::int64_t kMaxSize = std::int64_t{1} << 50;  ///< bytes of a file
constexpr std::int64_t kMaxOctal = 077777777777;          ///< what 11 octal digits say
constexpr std::string_view kCurrent = "current";

using Block = std::array<std::uint8_t, kTarBlock>;

/// Where a field lies in a header.
struct Field {
  std::size_t offset;
  std::size_t size;
};
constexpr Field kName{0, 100};
constexpr Field kMode{100, 8};
constexpr Field kOwner{108, 8};
constexpr Field kTarGroup{116, 8};
constexpr Field kSize{124, 12};
constexpr Field kTime{136, 12};
constexpr Field kSum{148, 8};
constexpr std::size_t kType = 156;
constexpr Field kTarget{157, 100};
constexpr Field kTarMagic{257, 6};
constexpr Field kVersion{263, 2};
constexpr Field kPathPrefix{345, 155};

void put_text(Block& block, Field field, std::string_view text) {
  std::copy_n(text.begin(), std::min(text.size(), field.size),
              block.begin() + static_cast<std::ptrdiff_t>(field.offset));
}

void put_octal(Block& block, Field field, std::int64_t value) {
  std::string digits(field.size - 1, '0');
  for (std::size_t i = digits.size(); i-- > 0; value >>= 3) {
    digits[i] = static_cast<char>('0' + (value & 7));
  }
  put_text(block, field, digits);
}

std::string field_text(Bytes block, Field field) {
  const Bytes bytes = block.subspan(field.offset, field.size);
  const auto end = std::find(bytes.begin(), bytes.end(), 0);
  return {bytes.begin(), end};
}

/// Octal digits up to a space or a zero; nothing for anything else.
std::optional<std::int64_t> octal_at(Bytes block, Field field) {
  std::string text = field_text(block, field);
  text.erase(0, text.find_first_not_of(' '));
  text.erase(text.find_last_not_of(' ') + 1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 8);
  const bool whole = error == std::errc() && end == text.data() + text.size() && value >= 0;
  return whole ? std::optional(value) : std::nullopt;
}

/// The sum of a header's bytes, with spaces in the place of the sum.
std::int64_t sum_of(Bytes block) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < block.size(); ++i) {
    const bool in_sum = i >= kSum.offset && i < kSum.offset + kSum.size;
    sum += in_sum ? ' ' : block[i];
  }
  return sum;
}

std::int64_t to_block(std::int64_t size) {
  return (kTarBlock - size % kTarBlock) % kTarBlock;
}

/// A path in the two fields of a header: prefix and name; nothing where it does not fit.
std::optional<std::pair<std::string, std::string>> split_path(const std::string& path) {
  if (path.size() <= kName.size) {
    return std::pair<std::string, std::string>("", path);
  }
  const std::size_t slash = path.find('/', path.size() - kName.size - 1);
  if (slash == std::string::npos || slash > kPathPrefix.size || slash + 1 == path.size()) {
    return std::nullopt;
  }
  return std::pair(path.substr(0, slash), path.substr(slash + 1));
}

Block tar_header(char type, const std::pair<std::string, std::string>& path, std::int64_t size,
                 const std::string& target) {
  Block block{};
  put_text(block, kPathPrefix, path.first);
  put_text(block, kName, path.second);
  put_octal(block, kMode, type == '5' ? 0700 : 0600);
  put_octal(block, kOwner, 0);
  put_octal(block, kTarGroup, 0);
  put_octal(block, kSize, size);
  put_octal(block, kTime, 0);
  block[kType] = static_cast<std::uint8_t>(type);
  put_text(block, kTarget, target);
  put_text(block, kTarMagic, "ustar");  // and a zero
  put_text(block, kVersion, "00");
  const std::int64_t sum = sum_of(block);
  put_octal(block, {kSum.offset, 7}, sum);  // a zero, then a space
  block[kSum.offset + 7] = ' ';
  return block;
}

/// "LENGTH key=value\n", where LENGTH counts itself.
std::string record(const std::string& key, const std::string& value) {
  const std::string rest = " " + key + "=" + value + "\n";
  std::size_t length = rest.size() + 1;
  while (std::to_string(length).size() + rest.size() != length) {
    ++length;
  }
  return std::to_string(length) + rest;
}

}  // namespace

bool is_safe_tar_path(std::string_view path) {
  constexpr std::size_t kMaxPath = 1024;
  constexpr std::size_t kMaxPart = 255;
  constexpr int kMaxParts = 32;
  if (path.size() > kMaxPath || !is_printable_utf8(path)) {
    return false;
  }
  int parts = 0;
  while (true) {
    const std::size_t end = std::min(path.find('/'), path.size());
    const std::string_view part = path.substr(0, end);
    if (part.empty() || part == "." || part == ".." || part.size() > kMaxPart ||
        ++parts > kMaxParts) {
      return false;
    }
    if (end == path.size()) {
      return true;
    }
    path.remove_prefix(end + 1);
  }
}

bool is_safe_tar_link(std::string_view path, std::string_view target) {
  constexpr std::size_t kKey = 16;
  return is_safe_tar_path(path) && path.substr(path.rfind('/') + 1) == kCurrent &&
         target.size() == kKey &&
         target.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

std::int64_t padded_size(std::int64_t size) {
  if (size < 2) {
    return size;
  }
  const std::size_t exponent = std::bit_width(static_cast<std::uint64_t>(size)) - 1;
  const std::size_t kept = std::bit_width(exponent);
  const std::int64_t mask = (std::int64_t{1} << (exponent - std::min(exponent, kept))) - 1;
  return (size + mask) & ~mask;
}

TarWriter::TarWriter(ByteSink sink) : sink_(std::move(sink)) {}

void TarWriter::emit(Bytes bytes) {
  sink_(bytes);
  written_ += static_cast<std::int64_t>(bytes.size());
}

void TarWriter::pad() {
  static constexpr Block kZeros{};
  emit(Bytes(kZeros).first(static_cast<std::size_t>(to_block(written_))));
}

void TarWriter::add(const TarEntry& entry) {
  const bool folder = entry.kind == TarEntry::Kind::Folder;
  const bool link = entry.kind == TarEntry::Kind::Link;
  ATELIER_CHECK(left_ == 0, "an entry that is not whole");
  ATELIER_CHECK(is_safe_tar_path(entry.path), "no path for an archive: " + entry.path);
  ATELIER_CHECK(!link || is_safe_tar_link(entry.path, entry.target),
                "no link for an archive: " + entry.path);
  auto path = split_path(entry.path + (folder ? "/" : ""));
  const std::int64_t size = folder || link ? 0 : entry.size;
  std::string extended;
  if (!path) {
    extended += record("path", entry.path);
    path.emplace("", entry.path.substr(entry.path.size() - kName.size));
  }
  if (size > kMaxOctal) {
    extended += record("size", std::to_string(size));
  }
  if (!extended.empty()) {
    emit(tar_header('x', {"", "extended"}, static_cast<std::int64_t>(extended.size()), ""));
    emit(bytes_of(extended));
    pad();
  }
  emit(tar_header(folder ? '5' : link ? '2' : '0', *path, std::min(size, kMaxOctal), entry.target));
  left_ = size;
}

void TarWriter::write(Bytes bytes) {
  ATELIER_CHECK(static_cast<std::int64_t>(bytes.size()) <= left_, "more bytes than the entry has");
  emit(bytes);
  left_ -= static_cast<std::int64_t>(bytes.size());
  if (left_ == 0) {
    pad();
  }
}

void TarWriter::finish() {
  ATELIER_CHECK(left_ == 0, "an entry that is not whole");
  static constexpr std::array<std::uint8_t, 65'536> kZeros{};
  const std::int64_t all = padded_size(written_ + 2 * kTarBlock);
  const std::int64_t blocks = all + to_block(all);
  while (written_ < blocks) {
    const std::int64_t count = std::min(blocks - written_, std::ssize(kZeros));
    emit(Bytes(kZeros).first(static_cast<std::size_t>(count)));
  }
}

TarReader::TarReader(ByteSource source, std::string file)
    : source_(std::move(source)), file_(std::move(file)) {}

void TarReader::fail(const std::string& found, const std::string& expected) const {
  throw DataError(file_, "entry " + std::to_string(entries_), found, expected);
}

void TarReader::read_block(std::span<std::uint8_t> block) {
  if (source_(block) < block.size()) {
    fail("an archive that ends too early", "all of it");
  }
}

void TarReader::skip(std::int64_t bytes) {
  std::array<std::uint8_t, 65'536> nowhere;
  while (bytes > 0) {
    const std::int64_t count = std::min(bytes, std::ssize(nowhere));
    read_block(std::span(nowhere).first(static_cast<std::size_t>(count)));
    bytes -= count;
  }
}

void TarReader::read_end() {
  std::array<std::uint8_t, 65'536> rest;
  for (std::size_t got = rest.size(); got == rest.size();) {
    got = source_(rest);
    if (std::any_of(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(got),
                    [](std::uint8_t byte) { return byte != 0; })) {
      fail("bytes behind the end of the archive", "zeros");
    }
  }
  ended_ = true;
}

void TarReader::read_extended(std::int64_t size) {
  if (size > kMaxExtended) {
    fail("an extended header of " + std::to_string(size) + " bytes", "at most 16384");
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size + to_block(size)));
  read_block(bytes);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()),
                        static_cast<std::size_t>(size));
  while (!text.empty()) {
    std::size_t length = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), length);
    const auto digits = static_cast<std::size_t>(end - text.data());
    if (error != std::errc() || length > text.size() || length < digits + 3 ||
        text[digits] != ' ' || text[length - 1] != '\n') {
      fail("a damaged extended header", "records of 'LENGTH key=value'");
    }
    const std::string_view line = text.substr(digits + 1, length - digits - 2);
    const std::size_t equals = line.find('=');
    const std::string_view key = line.substr(0, equals);
    const std::string_view value =
        equals == std::string_view::npos ? std::string_view() : line.substr(equals + 1);
    if (key == "path") {
      long_path_ = value;
    } else if (key == "size") {
      std::int64_t number = -1;
      const auto [stop, wrong] = std::from_chars(value.data(), value.data() + value.size(), number);
      if (wrong != std::errc() || stop != value.data() + value.size() || number < 0) {
        fail("a size that is no number", "bytes of a file");
      }
      large_size_ = number;
    } else if (key != "mtime" && key != "atime" && key != "ctime") {
      fail("an extended header '" + std::string(key.substr(0, 40)) + "'", "path and size alone");
    }
    text.remove_prefix(length);
  }
}

std::optional<TarEntry> TarReader::parse(Bytes block) {
  const auto sum = octal_at(block, kSum);
  const auto size = octal_at(block, kSize);
  if (!sum || *sum != sum_of(block) || field_text(block, kTarMagic).substr(0, 5) != "ustar") {
    fail("no header of a tar archive", "what atelier seal packs");
  }
  if (!size) {
    fail("a size that is no number", "octal digits");
  }
  const char type = static_cast<char>(block[kType]);
  if (type == 'x') {
    read_extended(*size);
    return std::nullopt;
  }
  TarEntry entry;
  const std::string prefix = field_text(block, kPathPrefix);
  entry.path = !long_path_.empty()
                   ? std::exchange(long_path_, "")
                   : (prefix.empty() ? "" : prefix + "/") + field_text(block, kName);
  entry.size = large_size_ ? *std::exchange(large_size_, std::nullopt) : *size;
  entry.target = field_text(block, kTarget);
  switch (type) {
    case '0':
    case '\0':
      break;
    case '5':
      entry.kind = TarEntry::Kind::Folder;
      entry.path.erase(entry.path.find_last_not_of('/') + 1);
      break;
    case '2':
      entry.kind = TarEntry::Kind::Link;
      break;
    default:
      fail(type == '1'                  ? "a hard link"
           : type >= '3' && type <= '6' ? "a device or a pipe"
                                        : "an entry of another type",
           "files and folders");
  }
  if (!is_safe_tar_path(entry.path)) {
    fail("an unsafe path '" + entry.path.substr(0, 80) + "'", "a path inside of the archive");
  }
  if (entry.kind == TarEntry::Kind::Link && !is_safe_tar_link(entry.path, entry.target)) {
    fail("a link '" + entry.path.substr(0, 80) + "'", "no link but a stage's 'current'");
  }
  if (entry.size > kMaxSize || (entry.kind != TarEntry::Kind::File && entry.size != 0)) {
    fail("a size of " + std::to_string(entry.size), "what a file can have");
  }
  return entry;
}

std::optional<TarEntry> TarReader::next() {
  if (ended_) {
    return std::nullopt;
  }
  skip(std::exchange(left_, 0));
  skip(std::exchange(padding_, 0));
  while (true) {
    Block block{};
    read_block(block);
    if (std::all_of(block.begin(), block.end(), [](std::uint8_t byte) { return byte == 0; })) {
      if (!long_path_.empty() || large_size_) {
        fail("an extended header without its entry", "the entry");
      }
      read_end();
      return std::nullopt;
    }
    if (++entries_ > kMaxEntries) {
      fail("more than 4 million entries", "fewer");
    }
    if (auto entry = parse(block)) {
      left_ = entry->size;
      padding_ = to_block(entry->size);
      return entry;
    }
  }
}

std::size_t TarReader::read(std::span<std::uint8_t> buffer) {
  const auto count =
      static_cast<std::size_t>(std::min(left_, static_cast<std::int64_t>(buffer.size())));
  read_block(buffer.first(count));
  left_ -= static_cast<std::int64_t>(count);
  return count;
}

}  // namespace atelier
