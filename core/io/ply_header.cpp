#include "core/io/ply_header.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/error.h"
#include "core/io/text_scanner.h"

namespace atelier {
namespace {

constexpr std::size_t kMaxElements = 256;
constexpr std::size_t kMaxProperties = 1024;

struct TypeName {
  std::string_view name;
  PlyType type;
};

constexpr TypeName kTypes[] = {
    {"char", PlyType::Int8},      {"int8", PlyType::Int8},       {"uchar", PlyType::UInt8},
    {"uint8", PlyType::UInt8},    {"short", PlyType::Int16},     {"int16", PlyType::Int16},
    {"ushort", PlyType::UInt16},  {"uint16", PlyType::UInt16},   {"int", PlyType::Int32},
    {"int32", PlyType::Int32},    {"uint", PlyType::UInt32},     {"uint32", PlyType::UInt32},
    {"float", PlyType::Float32},  {"float32", PlyType::Float32}, {"double", PlyType::Float64},
    {"float64", PlyType::Float64}};

PlyType read_type(TextScanner& scanner) {
  const std::string_view word = scanner.next_word();
  for (const TypeName& type : kTypes) {
    if (type.name == word) {
      return type.type;
    }
  }
  scanner.fail("type " + in_quotes(word), "char, uchar, short, ushort, int, uint, float or double");
}

std::string read_name(TextScanner& scanner) {
  const std::string name(scanner.next_word());
  if (name.empty()) {
    scanner.fail("no name", "a name");
  }
  return name;
}

template <class Named>
void check_new(const std::vector<Named>& all, const std::string& name, TextScanner& scanner) {
  if (std::any_of(all.begin(), all.end(), [&](const Named& one) { return one.name == name; })) {
    scanner.fail(in_quotes(name) + " for the second time", "each name once");
  }
}

PlyFormat read_format(TextScanner& scanner) {
  const std::string_view word = scanner.next_word();
  const std::string_view version = scanner.next_word();
  if (version != "1.0") {
    scanner.fail("PLY version " + in_quotes(version), "1.0");
  }
  if (word == "ascii") {
    return PlyFormat::Ascii;
  }
  if (word == "binary_little_endian") {
    return PlyFormat::BinaryLittleEndian;
  }
  if (word == "binary_big_endian") {
    return PlyFormat::BinaryBigEndian;
  }
  scanner.fail("format " + in_quotes(word), "ascii, binary_little_endian or binary_big_endian");
}

PlyElement read_element(TextScanner& scanner) {
  PlyElement element;
  element.name = read_name(scanner);
  const std::int64_t count = scanner.integer("count");
  if (count < 0) {
    scanner.fail("count " + std::to_string(count), "0 or more");
  }
  element.count = static_cast<std::uint64_t>(count);
  return element;
}

PlyProperty read_property(TextScanner& scanner) {
  PlyProperty property;
  TextScanner ahead = scanner;
  if (ahead.next_word() == "list") {
    scanner.next_word();
    property.is_list = true;
    property.count_type = read_type(scanner);
    if (property.count_type == PlyType::Float32 || property.count_type == PlyType::Float64) {
      scanner.fail("a list whose length is a floating-point number", "an integer type");
    }
  }
  property.type = read_type(scanner);
  property.name = read_name(scanner);
  return property;
}

/// True for a word that may be a keyword cut short.
bool begins_keyword(std::string_view word) {
  constexpr std::array<std::string_view, 6> kKeywords = {"format",  "element",  "property",
                                                         "comment", "obj_info", "end_header"};
  return std::any_of(kKeywords.begin(), kKeywords.end(), [&](std::string_view keyword) {
    return keyword.size() > word.size() && keyword.starts_with(word);
  });
}

}  // namespace

std::size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::Int8:
    case PlyType::UInt8:
      return 1;
    case PlyType::Int16:
    case PlyType::UInt16:
      return 2;
    case PlyType::Int32:
    case PlyType::UInt32:
    case PlyType::Float32:
      return 4;
    case PlyType::Float64:
      return 8;
  }
  return 0;
}

PlyHeader read_ply_header(std::span<const std::byte> bytes, const std::string& name,
                          const Limits& limits) {
  TextScanner scanner(as_text(bytes), name, limits.line_bytes);
  PlyHeader header;
  if (!as_text(bytes).starts_with("ply") || !scanner.next_line() || scanner.next_word() != "ply" ||
      !scanner.rest().empty()) {
    throw DataError(name, "line 1", bytes.empty() ? "an empty file, no PLY file" : "no PLY file",
                    "a first line \"ply\"");
  }
  bool has_format = false;
  std::size_t properties = 0;
  while (true) {
    if (!scanner.next_line()) {
      scanner.fail("the file ends in its header", "end_header");
    }
    const std::string_view word = scanner.next_word();
    if (word == "comment") {
      read_convention(std::string(scanner.rest()), header.convention);
      continue;
    }
    if (word == "obj_info") {
      continue;
    }
    if (word == "format" && !has_format) {
      header.format = read_format(scanner);
      has_format = true;
    } else if (word == "element" && has_format) {
      const PlyElement element = read_element(scanner);
      check_new(header.elements, element.name, scanner);
      header.elements.push_back(element);
    } else if (word == "property" && !header.elements.empty()) {
      const PlyProperty property = read_property(scanner);
      check_new(header.elements.back().properties, property.name, scanner);
      header.elements.back().properties.push_back(property);
      ++properties;
    } else if (word == "end_header" && has_format) {
      break;
    } else if (scanner.bytes_left() == 0 && begins_keyword(word)) {
      scanner.fail("the file ends in its header, behind " + in_quotes(word), "end_header");
    } else {
      scanner.fail(in_quotes(word), has_format ? "element, property, comment or end_header"
                                               : "a line \"format ...\" first");
    }
    if (!scanner.rest().empty()) {
      scanner.fail("more words than the line should have", "one thing a line");
    }
    if (header.elements.size() > kMaxElements || properties > kMaxProperties) {
      scanner.fail("too many elements or properties", "at most " + std::to_string(kMaxElements) +
                                                          " and " + std::to_string(kMaxProperties));
    }
  }
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty() && element.count > 0) {
      scanner.fail("element " + in_quotes(element.name) + " has rows but no property",
                   "a property for each element");
    }
  }
  header.bytes = bytes.size() - scanner.bytes_left();
  header.lines = scanner.line();
  return header;
}

}  // namespace atelier
