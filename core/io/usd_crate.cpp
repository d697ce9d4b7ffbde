#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/lz4_block.h"
#include "core/io/usd_stage.h"
#include "core/printable.h"

namespace atelier {
namespace {

constexpr std::string_view kCrateMagic = "PXR-USDC";

/// Types of values (crateDataTypes.h of OpenUSD) that meshes and their places are made of.
enum class CrateType {
  Bool = 1,
  UChar = 2,
  Int = 3,
  UInt = 4,
  Int64 = 5,
  UInt64 = 6,
  Half = 7,
  Float = 8,
  Double = 9,
  String = 10,
  Token = 11,
  Matrix4d = 15,
  Quatd = 16,
  Quatf = 17,
  Quath = 18,
  Vec2d = 19,
  Vec2f = 20,
  Vec2h = 21,
  Vec3d = 23,
  Vec3f = 24,
  Vec3h = 25,
  TokenVector = 41,
  Specifier = 42,
  TimeSamples = 46,
  DoubleVector = 48
};

/// What an element of a type is made of: so many numbers of one kind.
struct Element {
  CrateType scalar = CrateType::Double;
  std::size_t count = 1;
};

std::optional<Element> element_of(CrateType type) {
  switch (type) {
    case CrateType::Matrix4d:
      return Element{CrateType::Double, 16};
    case CrateType::Quatd:
      return Element{CrateType::Double, 4};
    case CrateType::Quatf:
      return Element{CrateType::Float, 4};
    case CrateType::Quath:
      return Element{CrateType::Half, 4};
    case CrateType::Vec2d:
      return Element{CrateType::Double, 2};
    case CrateType::Vec2f:
      return Element{CrateType::Float, 2};
    case CrateType::Vec2h:
      return Element{CrateType::Half, 2};
    case CrateType::Vec3d:
      return Element{CrateType::Double, 3};
    case CrateType::Vec3f:
      return Element{CrateType::Float, 3};
    case CrateType::Vec3h:
      return Element{CrateType::Half, 3};
    case CrateType::DoubleVector:
      return Element{CrateType::Double, 1};
    case CrateType::Bool:
    case CrateType::UChar:
    case CrateType::Int:
    case CrateType::UInt:
    case CrateType::Int64:
    case CrateType::UInt64:
    case CrateType::Half:
    case CrateType::Float:
    case CrateType::Double:
      return Element{type, 1};
    default:
      return std::nullopt;
  }
}

std::size_t bytes_of(CrateType scalar) {
  switch (scalar) {
    case CrateType::Bool:
    case CrateType::UChar:
      return 1;
    case CrateType::Half:
      return 2;
    case CrateType::Int:
    case CrateType::UInt:
    case CrateType::Float:
      return 4;
    default:
      return 8;
  }
}

double half_value(std::uint16_t bits) {
  const int exponent = bits >> 10 & 31;
  const int fraction = bits & 1023;
  const double size = exponent == 0    ? std::ldexp(fraction, -24)
                      : exponent == 31 ? (fraction == 0 ? std::numeric_limits<double>::infinity()
                                                        : std::numeric_limits<double>::quiet_NaN())
                                       : std::ldexp(1024 + fraction, exponent - 25);
  return (bits & 0x8000) != 0 ? -size : size;
}

double scalar_of(ByteReader& reader, CrateType scalar) {
  constexpr std::string_view kWhat = "a value";
  switch (scalar) {
    case CrateType::Bool:
    case CrateType::UChar:
      return reader.little<std::uint8_t>(kWhat);
    case CrateType::Half:
      return half_value(reader.little<std::uint16_t>(kWhat));
    case CrateType::Int:
      return reader.little<std::int32_t>(kWhat);
    case CrateType::UInt:
      return reader.little<std::uint32_t>(kWhat);
    case CrateType::Int64:
      return static_cast<double>(reader.little<std::int64_t>(kWhat));
    case CrateType::UInt64:
      return static_cast<double>(reader.little<std::uint64_t>(kWhat));
    case CrateType::Float:
      return static_cast<double>(reader.little<float>(kWhat));
    default:
      return reader.little<double>(kWhat);
  }
}

/// A value or where it stands: type, flags and 48 bits.
struct ValueRep {
  std::uint64_t bits = 0;

  bool array() const { return (bits >> 63 & 1) != 0; }
  bool inlined() const { return (bits >> 62 & 1) != 0; }
  bool compressed() const { return (bits >> 61 & 1) != 0; }
  CrateType type() const { return static_cast<CrateType>(bits >> 48 & 255); }
  std::uint64_t payload() const { return bits & 0xFFFF'FFFF'FFFF; }
};

class CrateReader {
 public:
  CrateReader(std::span<const std::byte> bytes, const std::string& file, const Limits& limits)
      : bytes_(bytes), file_(file), limits_(limits), reader_(bytes, file) {}

  UsdStage read() {
    read_head();
    read_tokens();
    read_strings();
    read_fields();
    read_field_sets();
    read_paths();
    read_specs();
    return std::move(stage_);
  }

 private:
  struct Field {
    std::uint32_t token = 0;
    ValueRep value;
  };
  struct Path {
    int parent = -1;
    std::string name;
    bool property = false;
    int prim = -1;  ///< of the stage
  };

  void read_head();
  void go_to(const char* section);
  void read_tokens();
  void read_strings();
  void read_fields();
  void read_field_sets();
  void read_paths();
  void read_specs();
  void add_prim(Path& path, const std::map<std::string, ValueRep>& fields);
  void add_attribute(const Path& path, const std::map<std::string, ValueRep>& fields);
  void set_layer(const std::map<std::string, ValueRep>& fields);

  std::vector<std::byte> unpacked(std::span<const std::byte> packed, std::size_t most);
  std::vector<std::int64_t> integers(std::size_t count, std::size_t bytes_each);
  std::vector<double> packed_floats(std::size_t count);
  const std::string& token(std::uint64_t index) const;
  UsdValue value_of(ValueRep rep);
  void inlined_value(ValueRep rep, UsdValue& value);
  void array_value(ValueRep rep, UsdValue& value);
  void read_samples(ValueRep rep, UsdAttribute& attribute);
  std::size_t array_count();
  void take_numbers(std::size_t count) {
    numbers_ += count;
    if (std::cmp_greater(numbers_, limits_.tensor_bytes / 8)) {
      reader_.fail("more numbers than the limits allow", "fewer frames or smaller meshes");
    }
  }

  std::span<const std::byte> bytes_;
  const std::string& file_;
  const Limits& limits_;
  ByteReader reader_;
  int version_ = 0;  ///< minor
  std::map<std::string, std::uint64_t> sections_;
  std::vector<std::string> tokens_;
  std::vector<std::uint32_t> strings_;
  std::vector<Field> fields_;
  std::vector<std::uint32_t> field_sets_;
  std::vector<Path> paths_;
  UsdStage stage_;
  std::size_t numbers_ = 0;  ///< that were read: samples may share their bytes
};

void CrateReader::read_head() {
  if (reader_.remaining() < kCrateMagic.size() ||
      reader_.text(kCrateMagic.size(), "magic") != kCrateMagic) {
    throw DataError(file_, "byte 0", "no binary USD", "PXR-USDC");
  }
  const auto major = reader_.little<std::uint8_t>("version");
  version_ = reader_.little<std::uint8_t>("version");
  reader_.skip(6, "version");
  constexpr int kOldest = 4;
  constexpr int kNewest = 13;
  if (major != 0 || version_ < kOldest || version_ > kNewest) {
    reader_.fail("version " + std::to_string(major) + "." + std::to_string(version_),
                 "0.4 to 0.13; usdcat FILE -o FILE.usda writes it as text");
  }
  reader_.seek(reader_.little<std::uint64_t>("table of sections"), "table of sections");
  const std::uint64_t count = reader_.little<std::uint64_t>("number of sections");
  constexpr std::size_t kSectionBytes = 32;
  for (std::size_t i = reader_.paid(count, kSectionBytes, "sections"); i > 0; --i) {
    std::string name(reader_.text(16, "section"));
    name.resize(std::min(name.find('\0'), name.size()));
    sections_[name] = reader_.little<std::uint64_t>("section");
    reader_.skip(8, "section");
  }
}

void CrateReader::go_to(const char* section) {
  const auto found = sections_.find(section);
  if (found == sections_.end()) {
    throw DataError(file_, "sections", std::string("no section ") + section, "every section");
  }
  reader_.seek(found->second, section);
}

/// TfFastCompression: a number of chunks, 0 for one alone.
std::vector<std::byte> CrateReader::unpacked(std::span<const std::byte> packed, std::size_t most) {
  ByteReader chunks(packed, file_);
  const auto count = chunks.little<std::uint8_t>("chunks");
  const std::string place = "byte " + std::to_string(packed.data() - bytes_.data());
  if (count == 0) {
    return lz4_block(packed.subspan(1), most, file_, place);
  }
  std::vector<std::byte> all;
  for (int i = 0; i < count; ++i) {
    const auto size = chunks.little<std::uint32_t>("chunk");
    const std::vector<std::byte> part =
        lz4_block(chunks.take(size, "chunk"), most - all.size(), file_, place);
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

/// Usd_IntegerCompression: the most frequent difference, two bits for each number, and what they
/// leave to say.
std::vector<std::int64_t> CrateReader::integers(std::size_t count, std::size_t bytes_each) {
  const auto size = reader_.little<std::uint64_t>("compressed integers");
  const std::span<const std::byte> packed =
      reader_.take(reader_.paid(size, 1, "compressed integers"), "compressed integers");
  if (count == 0) {
    return {};
  }
  // LZ4 makes 255 bytes of one at most, and two bits are a number.
  constexpr std::size_t kMostNumbers = 4 * 255;
  if (count / kMostNumbers > packed.size()) {
    reader_.fail(std::to_string(count) + " integers in " + std::to_string(packed.size()) + " bytes",
                 "fewer integers");
  }
  const std::size_t codes = (2 * count + 7) / 8;
  const std::vector<std::byte> plain = unpacked(packed, bytes_each + codes + count * bytes_each);
  ByteReader head(plain, file_);
  const std::int64_t common = bytes_each == 4 ? head.little<std::int32_t>("integers")
                                              : head.little<std::int64_t>("integers");
  const std::span<const std::byte> code = head.take(codes, "codes of integers");
  std::vector<std::int64_t> values(count);
  std::uint64_t before = 0;  // wraps round, as the writer's did
  for (std::size_t i = 0; i < count; ++i) {
    std::int64_t step = common;
    const bool wide = bytes_each == 8;
    switch (static_cast<int>(code[i / 4]) >> 2 * (i % 4) & 3) {
      case 1:
        step = wide ? head.little<std::int16_t>("integer") : head.little<std::int8_t>("integer");
        break;
      case 2:
        step = wide ? head.little<std::int32_t>("integer") : head.little<std::int16_t>("integer");
        break;
      case 3:
        step = wide ? head.little<std::int64_t>("integer") : head.little<std::int32_t>("integer");
        break;
      default:
        break;
    }
    before += static_cast<std::uint64_t>(step);
    values[i] = wide ? static_cast<std::int64_t>(before)
                     : static_cast<std::int32_t>(static_cast<std::uint32_t>(before));
  }
  return values;
}

void CrateReader::read_tokens() {
  go_to("TOKENS");
  const auto count = reader_.little<std::uint64_t>("number of tokens");
  const auto plain_bytes = reader_.little<std::uint64_t>("bytes of tokens");
  const auto packed_bytes = reader_.little<std::uint64_t>("compressed tokens");
  const std::size_t packed = reader_.paid(packed_bytes, 1, "tokens");
  constexpr std::uint64_t kRatio = 256;
  if (plain_bytes > kRatio * packed || count > plain_bytes) {
    reader_.fail(std::to_string(count) + " tokens of " + std::to_string(plain_bytes) + " bytes",
                 "what " + std::to_string(packed) + " compressed bytes hold");
  }
  const std::vector<std::byte> plain =
      unpacked(reader_.take(packed, "tokens"), static_cast<std::size_t>(plain_bytes));
  const std::string_view text(reinterpret_cast<const char*>(plain.data()), plain.size());
  for (std::size_t at = 0; at < text.size() && tokens_.size() < count;) {
    const std::size_t end = std::min(text.find('\0', at), text.size());
    tokens_.emplace_back(text.substr(at, end - at));
    at = end + 1;
  }
  if (tokens_.size() != count) {
    reader_.fail(std::to_string(tokens_.size()) + " tokens", std::to_string(count));
  }
}

void CrateReader::read_strings() {
  go_to("STRINGS");
  const auto count = reader_.little<std::uint64_t>("number of strings");
  for (std::size_t i = reader_.paid(count, 4, "strings"); i > 0; --i) {
    strings_.push_back(reader_.little<std::uint32_t>("string"));
  }
}

const std::string& CrateReader::token(std::uint64_t index) const {
  if (index >= tokens_.size()) {
    reader_.fail("token " + std::to_string(index), "one of " + std::to_string(tokens_.size()));
  }
  return tokens_[static_cast<std::size_t>(index)];
}

void CrateReader::read_fields() {
  go_to("FIELDS");
  const auto count = static_cast<std::size_t>(reader_.little<std::uint64_t>("number of fields"));
  const std::vector<std::int64_t> names = integers(count, 4);
  const auto size = reader_.little<std::uint64_t>("compressed fields");
  const std::span<const std::byte> packed = reader_.take(reader_.paid(size, 1, "fields"), "fields");
  const std::vector<std::byte> plain = unpacked(packed, 8 * count);
  ByteReader reps(plain, file_);
  for (const std::int64_t name : names) {
    fields_.push_back({static_cast<std::uint32_t>(name), {reps.little<std::uint64_t>("field")}});
  }
}

void CrateReader::read_field_sets() {
  go_to("FIELDSETS");
  const auto count = reader_.little<std::uint64_t>("number of field sets");
  for (const std::int64_t field : integers(static_cast<std::size_t>(count), 4)) {
    field_sets_.push_back(static_cast<std::uint32_t>(field));
  }
}

/// A tree in depth-first order: each path's element, and how far its next sibling is away.
void CrateReader::read_paths() {
  go_to("PATHS");
  const auto count = reader_.little<std::uint64_t>("number of paths");
  const auto encoded = static_cast<std::size_t>(reader_.little<std::uint64_t>("encoded paths"));
  const std::vector<std::int64_t> indices = integers(encoded, 4);
  const std::vector<std::int64_t> elements = integers(encoded, 4);
  const std::vector<std::int64_t> jumps = integers(encoded, 4);
  if (encoded > count || count > 4 * 255 * bytes_.size()) {
    reader_.fail(std::to_string(encoded) + " encoded of " + std::to_string(count) + " paths",
                 "as many");
  }
  // Paths that are only referred to have numbers too, and no names.
  const std::size_t numbered =
      std::max(encoded, static_cast<std::size_t>(std::min<std::uint64_t>(count, bytes_.size())));
  paths_.resize(numbered);
  std::vector<char> seen(encoded, 0);
  std::vector<std::pair<std::size_t, int>> pending;  // siblings that come later, and their parents
  if (encoded > 0) {
    pending.emplace_back(0, -1);
  }
  while (!pending.empty()) {
    auto [at, parent] = pending.back();
    pending.pop_back();
    for (bool more = true; more;) {
      if (at >= encoded || seen[at] != 0) {
        reader_.fail("a path that leads nowhere or twice to one place", "a tree of paths");
      }
      seen[at] = 1;
      const std::int64_t index = indices[at];
      if (index < 0 || index >= static_cast<std::int64_t>(numbered)) {
        reader_.fail("path " + std::to_string(index), "one of " + std::to_string(numbered));
      }
      Path& path = paths_[static_cast<std::size_t>(index)];
      path.parent = parent;
      if (parent >= 0) {
        path.property = elements[at] < 0;
        path.name = token(static_cast<std::uint64_t>(std::abs(elements[at])));
      }
      const std::int64_t jump = jumps[at];
      const bool child = jump > 0 || jump == -1;
      const bool sibling = jump >= 0;
      if (child && sibling) {
        pending.emplace_back(at + static_cast<std::size_t>(jump), parent);
      }
      parent = child ? static_cast<int>(index) : parent;
      more = child || sibling;
      ++at;
    }
  }
}

std::size_t CrateReader::array_count() {
  if (version_ < 5) {
    reader_.skip(4, "rank of an array");
  }
  const std::uint64_t count = version_ < 7 ? reader_.little<std::uint32_t>("length of an array")
                                           : reader_.little<std::uint64_t>("length of an array");
  if (std::cmp_greater(count, limits_.tensor_bytes / 8)) {
    reader_.fail("an array of " + std::to_string(count), "what the limits allow");
  }
  return static_cast<std::size_t>(count);
}

/// Floats as integers, or as places in a table of few values.
std::vector<double> CrateReader::packed_floats(std::size_t count) {
  const auto code = reader_.little<std::uint8_t>("code of compressed numbers");
  std::vector<double> values;
  if (code == 'i') {
    const std::vector<std::int64_t> whole = integers(count, 4);
    values.assign(whole.begin(), whole.end());
    return values;
  }
  if (code != 't') {
    reader_.fail("code " + std::to_string(code) + " of compressed numbers", "'i' or 't'");
  }
  return values;
}

void CrateReader::array_value(ValueRep rep, UsdValue& value) {
  if (rep.payload() == 0) {
    return;  // of no elements
  }
  reader_.seek(rep.payload(), "a value");
  const CrateType type = rep.type();
  const std::size_t count = array_count();
  if (type == CrateType::Token || type == CrateType::String) {
    for (std::size_t i = reader_.paid(count, 4, "tokens"); i > 0; --i) {
      const auto index = reader_.little<std::uint32_t>("token");
      const bool string = type == CrateType::String;
      if (string && index >= strings_.size()) {
        reader_.fail("string " + std::to_string(index), "one of the file's");
      }
      value.texts.push_back(token(string ? strings_[index] : index));
    }
    return;
  }
  const std::optional<Element> element = element_of(type);
  if (!element) {
    return;  // of a type that no mesh has
  }
  constexpr std::size_t kShortestCompressed = 16;
  if (rep.compressed() && count >= kShortestCompressed && element->count == 1) {
    const CrateType scalar = element->scalar;
    if (scalar == CrateType::Int || scalar == CrateType::UInt || scalar == CrateType::Int64 ||
        scalar == CrateType::UInt64) {
      const std::vector<std::int64_t> whole = integers(count, bytes_of(scalar));
      take_numbers(count);
      for (const std::int64_t one : whole) {
        value.numbers.push_back(scalar == CrateType::UInt
                                    ? static_cast<double>(static_cast<std::uint32_t>(one))
                                    : static_cast<double>(one));
      }
      return;
    }
    const std::size_t here = reader_.position();
    value.numbers = packed_floats(count);
    if (value.numbers.empty()) {  // a table
      reader_.seek(here + 1, "a table of numbers");
      const auto size = reader_.little<std::uint32_t>("size of a table");
      std::vector<double> table(reader_.paid(size, bytes_of(scalar), "a table of numbers"));
      for (double& one : table) {
        one = scalar_of(reader_, scalar);
      }
      for (const std::int64_t place : integers(count, 4)) {
        if (place < 0 || place >= std::ssize(table)) {
          reader_.fail("number " + std::to_string(place) + " of a table",
                       "one of " + std::to_string(table.size()));
        }
        value.numbers.push_back(table[static_cast<std::size_t>(place)]);
      }
    }
    take_numbers(count);
    return;
  }
  const std::size_t bytes = bytes_of(element->scalar) * element->count;
  const std::size_t numbers = reader_.paid(count, bytes, "an array") * element->count;
  take_numbers(numbers);
  value.numbers.reserve(numbers);
  for (std::size_t i = 0; i < numbers; ++i) {
    value.numbers.push_back(scalar_of(reader_, element->scalar));
  }
}

/// Whatever fits into four bytes stands there itself: vectors of whole numbers as signed bytes,
/// matrices that are diagonal the same.
void CrateReader::inlined_value(ValueRep rep, UsdValue& value) {
  const auto bits = static_cast<std::uint32_t>(rep.payload());
  const auto signed_byte = [&](std::size_t i) {
    return static_cast<double>(static_cast<std::int8_t>(bits >> 8 * i & 255));
  };
  switch (rep.type()) {
    case CrateType::Token:
      value.texts = {token(bits)};
      return;
    case CrateType::String:
      if (bits >= strings_.size()) {
        reader_.fail("string " + std::to_string(bits), "one of the file's");
      }
      value.texts = {token(strings_[bits])};
      return;
    case CrateType::Bool:
    case CrateType::UChar:
    case CrateType::Specifier:
      value.numbers = {static_cast<double>(bits & 255)};
      return;
    case CrateType::Int:
    case CrateType::Int64:
      value.numbers = {static_cast<double>(static_cast<std::int32_t>(bits))};
      return;
    case CrateType::UInt:
    case CrateType::UInt64:
      value.numbers = {static_cast<double>(bits)};
      return;
    case CrateType::Half:
      value.numbers = {half_value(static_cast<std::uint16_t>(bits))};
      return;
    case CrateType::Float:
    case CrateType::Double:
      value.numbers = {static_cast<double>(std::bit_cast<float>(bits))};
      return;
    case CrateType::Matrix4d:
      value.numbers.assign(16, 0);
      for (std::size_t i = 0; i < 4; ++i) {
        value.numbers[5 * i] = signed_byte(i);
      }
      return;
    default:
      break;
  }
  if (const std::optional<Element> element = element_of(rep.type());
      element && element->count > 1 && element->count <= 4) {
    for (std::size_t i = 0; i < element->count; ++i) {
      value.numbers.push_back(signed_byte(i));
    }
  }
}

UsdValue CrateReader::value_of(ValueRep rep) {
  UsdValue value;
  if (rep.array()) {
    array_value(rep, value);
  } else if (rep.inlined()) {
    inlined_value(rep, value);
  } else if (rep.type() == CrateType::TokenVector || rep.type() == CrateType::DoubleVector) {
    reader_.seek(rep.payload(), "a value");
    const auto count = reader_.little<std::uint64_t>("length of a vector");
    const bool tokens = rep.type() == CrateType::TokenVector;
    for (std::size_t i = reader_.paid(count, tokens ? 4 : 8, "a vector"); i > 0; --i) {
      if (tokens) {
        value.texts.push_back(token(reader_.little<std::uint32_t>("token")));
      } else {
        value.numbers.push_back(reader_.little<double>("number"));
      }
    }
  } else if (const std::optional<Element> element = element_of(rep.type())) {
    reader_.seek(rep.payload(), "a value");
    for (std::size_t i = 0; i < element->count; ++i) {
      value.numbers.push_back(scalar_of(reader_, element->scalar));
    }
  }
  return value;
}

/// Times, then values: each behind a jump, since the writer puts shared times elsewhere.
void CrateReader::read_samples(ValueRep rep, UsdAttribute& attribute) {
  reader_.seek(rep.payload(), "time samples");
  const auto jump = [&]() {
    const std::size_t here = reader_.position();
    const auto by = reader_.little<std::int64_t>("time samples");
    reader_.seek(here + static_cast<std::uint64_t>(by), "time samples");
  };
  jump();
  const ValueRep times{reader_.little<std::uint64_t>("times")};
  const std::size_t behind = reader_.position();
  attribute.times = value_of(times).numbers;
  reader_.seek(behind, "time samples");
  jump();
  const auto count = reader_.little<std::uint64_t>("number of samples");
  if (count != attribute.times.size() || std::cmp_greater(count, limits_.frames)) {
    reader_.fail(std::to_string(count) + " samples",
                 "one for each of " + std::to_string(attribute.times.size()) + " times");
  }
  std::vector<ValueRep> reps;
  for (std::size_t i = reader_.paid(count, 8, "samples"); i > 0; --i) {
    reps.push_back({reader_.little<std::uint64_t>("sample")});
  }
  for (const ValueRep& one : reps) {
    attribute.samples.push_back(value_of(one));
  }
}

void CrateReader::set_layer(const std::map<std::string, ValueRep>& fields) {
  const auto number = [&](const char* name, double& target) {
    if (const auto found = fields.find(name); found != fields.end()) {
      const std::vector<double> numbers = value_of(found->second).numbers;
      if (numbers.size() != 1 || !(numbers[0] > 0) || !std::isfinite(numbers[0])) {
        throw DataError(file_, name, "no number above 0", "one");
      }
      target = numbers[0];
    }
  };
  number("metersPerUnit", stage_.metres_per_unit);
  number("framesPerSecond", stage_.fps);
  number("timeCodesPerSecond", stage_.fps);
  if (const auto found = fields.find("upAxis"); found != fields.end()) {
    const std::vector<std::string> texts = value_of(found->second).texts;
    if (texts != std::vector<std::string>{"Y"} && texts != std::vector<std::string>{"Z"}) {
      throw DataError(file_, "upAxis", "neither Y nor Z", "Y or Z");
    }
    stage_.up = texts[0] == "Z" ? 'z' : 'y';
  }
  stage_.sublayers = fields.contains("subLayers");
}

void CrateReader::add_prim(Path& path, const std::map<std::string, ValueRep>& fields) {
  UsdPrim prim;
  prim.name = path.name;
  prim.parent = path.parent >= 0 ? paths_[static_cast<std::size_t>(path.parent)].prim : -1;
  if (const auto found = fields.find("typeName"); found != fields.end()) {
    const std::vector<std::string> texts = value_of(found->second).texts;
    prim.type = texts.empty() ? "" : texts[0];
  }
  if (const auto found = fields.find("specifier"); found != fields.end()) {
    prim.defined = value_of(found->second).numbers == std::vector<double>{0};
  }
  if (const auto found = fields.find("active"); found != fields.end()) {
    prim.defined = prim.defined && value_of(found->second).numbers != std::vector<double>{0};
  }
  for (const char* name : {"references", "payload", "inheritPaths", "specializes",
                           "variantSetNames", "variantSelection"}) {
    prim.refers = prim.refers || fields.contains(name);
  }
  path.prim = static_cast<int>(stage_.prims.size());
  stage_.prims.push_back(std::move(prim));
}

void CrateReader::add_attribute(const Path& path, const std::map<std::string, ValueRep>& fields) {
  const int owner = path.parent >= 0 ? paths_[static_cast<std::size_t>(path.parent)].prim : -1;
  const auto type = fields.find("typeName");
  const std::vector<std::string> types =
      type == fields.end() ? std::vector<std::string>() : value_of(type->second).texts;
  // Texture coordinates have any name ("primvars:UVMap" of Blender); their type tells.
  const bool uvs = path.name.starts_with("primvars:") &&
                   (path.name.ends_with(":indices") ||
                    (!types.empty() && types.front().starts_with("texCoord2")));
  if (owner >= 0 && path.name == "primvars:skel:jointIndices") {
    stage_.prims[static_cast<std::size_t>(owner)].skinned = true;
  }
  if (owner < 0 || (!uvs && !is_usd_mesh_attribute(path.name))) {
    return;
  }
  UsdAttribute attribute;
  if (const auto found = fields.find("default"); found != fields.end()) {
    attribute.value = value_of(found->second);
    attribute.has_value = true;
  }
  if (const auto found = fields.find("timeSamples"); found != fields.end()) {
    read_samples(found->second, attribute);
  }
  if (const auto found = fields.find("interpolation"); found != fields.end()) {
    const std::vector<std::string> texts = value_of(found->second).texts;
    attribute.interpolation = texts.empty() ? "" : texts[0];
  }
  stage_.prims[static_cast<std::size_t>(owner)].attributes[path.name] = std::move(attribute);
}

void CrateReader::read_specs() {
  go_to("SPECS");
  const auto count = static_cast<std::size_t>(reader_.little<std::uint64_t>("number of specs"));
  const std::vector<std::int64_t> of_path = integers(count, 4);
  const std::vector<std::int64_t> of_fields = integers(count, 4);
  const std::vector<std::int64_t> types = integers(count, 4);
  std::vector<std::size_t> spec_of(paths_.size(), count);
  for (std::size_t s = 0; s < count; ++s) {
    const std::int64_t path = of_path[s];
    if (path < 0 || path >= std::ssize(paths_) || of_fields[s] < 0 ||
        of_fields[s] >= std::ssize(field_sets_)) {
      reader_.fail(
          "a spec of path " + std::to_string(path) + " and fields " + std::to_string(of_fields[s]),
          "those of the file");
    }
    spec_of[static_cast<std::size_t>(path)] = s;
  }
  constexpr std::int64_t kAttribute = 1;
  constexpr std::int64_t kPrim = 6;
  constexpr std::int64_t kPseudoRoot = 7;
  // Parents first: a path's number says nothing of its place in the tree.
  std::vector<std::vector<std::size_t>> children(paths_.size());
  std::vector<std::size_t> order;
  for (std::size_t p = 0; p < paths_.size(); ++p) {
    if (paths_[p].parent < 0) {
      order.push_back(p);
    } else {
      children[static_cast<std::size_t>(paths_[p].parent)].push_back(p);
    }
  }
  for (std::size_t next = 0; next < order.size(); ++next) {
    const std::vector<std::size_t>& below = children[order[next]];
    order.insert(order.end(), below.begin(), below.end());
  }
  for (const std::size_t p : order) {
    const std::size_t spec = spec_of[p];
    if (spec == count) {
      continue;
    }
    std::map<std::string, ValueRep> fields;
    for (auto at = static_cast<std::size_t>(of_fields[spec]);
         at < field_sets_.size() && field_sets_[at] != UINT32_MAX; ++at) {
      if (field_sets_[at] >= fields_.size()) {
        reader_.fail("field " + std::to_string(field_sets_[at]),
                     "one of " + std::to_string(fields_.size()));
      }
      const Field& field = fields_[field_sets_[at]];
      fields.emplace(token(field.token), field.value);
    }
    if (types[spec] == kPseudoRoot) {
      set_layer(fields);
    } else if (types[spec] == kPrim) {
      add_prim(paths_[p], fields);
    } else if (types[spec] == kAttribute) {
      add_attribute(paths_[p], fields);
    }
  }
}

}  // namespace

bool is_usd_mesh_attribute(const std::string& name) {
  constexpr std::array kNames = {"points",  "faceVertexCounts", "faceVertexIndices", "visibility",
                                 "purpose", "orientation",      "xformOpOrder"};
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end() ||
         name.starts_with("xformOp:") || name == "primvars:st" || name == "primvars:st:indices";
}

UsdStage read_usd_crate(std::span<const std::byte> bytes, const std::string& file,
                        const Limits& limits) {
  return CrateReader(bytes, file, limits).read();
}

}  // namespace atelier
