#include "core/io/fbx_records.h"

#include <algorithm>
#include <type_traits>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/text_scanner.h"

namespace atelier {
namespace {

constexpr std::string_view kBinaryHead("Kaydara FBX Binary  \0\x1a\0", 23);
constexpr std::uint32_t kWideOffsets = 7500;  // version from which records count in 64 bits
constexpr std::size_t kMaxValues = 1 << 20;

FbxValue value_of(std::int64_t integer) {
  FbxValue value;
  value.integer = integer;
  value.number = static_cast<double>(integer);
  return value;
}

FbxValue value_of(double number) {
  FbxValue value;
  value.number = number;
  return value;
}

template <class Number>
void append_array(ByteReader& in, std::vector<FbxValue>& values) {
  const std::uint64_t count = in.little<std::uint32_t>("a count");
  const bool compressed = in.little<std::uint32_t>("an encoding") != 0;
  const auto bytes = in.little<std::uint32_t>("a length");
  if (compressed) {
    in.skip(bytes, "an array");
    return;
  }
  const std::size_t paid = in.paid(count, sizeof(Number), "an array");
  for (std::size_t i = 0; i < paid; ++i) {
    const Number number = in.little<Number>("a number");
    if (values.size() < kMaxValues) {
      if constexpr (std::is_integral_v<Number>) {
        values.push_back(value_of(std::int64_t{number}));
      } else {
        values.push_back(value_of(double{number}));
      }
    }
  }
}

/// One property of a binary record; false for a type that is not known.
bool append_property(ByteReader& in, std::vector<FbxValue>& values) {
  switch (in.text(1, "a type")[0]) {
    case 'C':
      values.push_back(value_of(std::int64_t{in.little<std::uint8_t>("a flag")}));
      return true;
    case 'Y':
      values.push_back(value_of(std::int64_t{in.little<std::int16_t>("a number")}));
      return true;
    case 'I':
      values.push_back(value_of(std::int64_t{in.little<std::int32_t>("a number")}));
      return true;
    case 'L':
      values.push_back(value_of(in.little<std::int64_t>("a number")));
      return true;
    case 'F':
      values.push_back(value_of(double{in.little<float>("a number")}));
      return true;
    case 'D':
      values.push_back(value_of(in.little<double>("a number")));
      return true;
    case 'S': {
      FbxValue value;
      value.is_text = true;
      value.text = in.text(in.little<std::uint32_t>("a length"), "a text");
      values.push_back(value);
      return true;
    }
    case 'R':
      in.skip(in.little<std::uint32_t>("a length"), "bytes");
      return true;
    case 'b':
      append_array<std::int8_t>(in, values);
      return true;
    case 'i':
      append_array<std::int32_t>(in, values);
      return true;
    case 'l':
      append_array<std::int64_t>(in, values);
      return true;
    case 'f':
      append_array<float>(in, values);
      return true;
    case 'd':
      append_array<double>(in, values);
      return true;
    default:
      return false;
  }
}

/// Records one after the other: a record's children follow its properties, and an empty record ends
/// them.
void read_binary(std::span<const std::byte> bytes, std::span<const std::string_view> names,
                 const std::function<void(const FbxRecord&)>& on_record) {
  ByteReader in(bytes, "");
  in.skip(kBinaryHead.size(), "the head");
  const bool wide = in.little<std::uint32_t>("the version") >= kWideOffsets;
  const auto word = [&] {
    return wide ? in.little<std::uint64_t>("an offset")
                : std::uint64_t{in.little<std::uint32_t>("an offset")};
  };
  const std::size_t head = wide ? 25 : 13;
  while (in.remaining() >= head) {
    word();  // where the record ends
    const std::uint64_t properties = word();
    const std::uint64_t length = word();
    FbxRecord record;
    record.name = in.text(in.little<std::uint8_t>("a length"), "a name");
    const std::size_t begin = in.position();
    if (length > in.remaining()) {
      return;
    }
    if (std::find(names.begin(), names.end(), record.name) != names.end()) {
      std::uint64_t left = properties;
      while (left > 0 && record.values.size() < kMaxValues && append_property(in, record.values)) {
        --left;
      }
      on_record(record);
    }
    in.seek(begin + length, "the next record");
  }
}

/// The values of a line of text behind its colon: numbers and texts in quotes between commas, up to
/// a brace.
void append_values(std::string_view rest, std::vector<FbxValue>& values) {
  while (values.size() < kMaxValues) {
    rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r,"), rest.size()));
    if (rest.empty() || rest[0] == '{' || rest[0] == '}' || rest[0] == ';') {
      return;
    }
    FbxValue value;
    std::size_t end = 0;
    if (rest[0] == '"') {
      end = std::min(rest.find('"', 1), rest.size());
      value.is_text = true;
      value.text = rest.substr(1, end - 1);
      end = std::min(end + 1, rest.size());
    } else {
      end = std::min(rest.find_first_of(" \t\r,{}"), rest.size());
      const std::string_view word = rest.substr(0, end);
      if (parse_integer(word, value.integer)) {
        value.number = static_cast<double>(value.integer);
      } else if (!parse_number(word, value.number)) {
        value.is_text = true;  // a letter, or the count of an array: "*16"
        value.text = word;
      }
    }
    values.push_back(value);
    rest.remove_prefix(end);
  }
}

/// Lines one after the other. An array is `Name: *N {`, then `a: ` and its numbers, which go on
/// over lines up to the brace.
class TextRecords {
 public:
  TextRecords(std::span<const std::string_view> names,
              const std::function<void(const FbxRecord&)>& on_record)
      : names_(names), on_record_(on_record) {}

  void add(std::string_view line) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    if (in_array_) {
      if (line.starts_with("a:")) {
        line.remove_prefix(2);
      }
      append_values(line, record_.values);
      if (line.find('}') != std::string_view::npos) {
        end();
      }
      return;
    }
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos ||
        std::find(names_.begin(), names_.end(), line.substr(0, colon)) == names_.end()) {
      return;
    }
    record_ = {};
    record_.name = line.substr(0, colon);
    append_values(line.substr(colon + 1), record_.values);
    in_array_ = record_.values.size() == 1 && record_.values[0].is_text &&
                record_.values[0].text.starts_with('*');
    if (in_array_) {
      record_.values.clear();
    } else {
      end();
    }
  }

 private:
  void end() {
    in_array_ = false;
    on_record_(record_);
  }

  std::span<const std::string_view> names_;
  const std::function<void(const FbxRecord&)>& on_record_;
  FbxRecord record_;
  bool in_array_ = false;
};

}  // namespace

void read_fbx_records(std::span<const std::byte> bytes, std::span<const std::string_view> names,
                      const std::function<void(const FbxRecord&)>& on_record) {
  std::string_view text = as_text(bytes);
  if (text.starts_with(kBinaryHead)) {
    try {
      read_binary(bytes, names, on_record);
    } catch (const DataError&) {
      // the footer, or what libassimp did not mind
    }
    return;
  }
  TextRecords records(names, on_record);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    records.add(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

std::string_view fbx_object_name(std::string_view text) {
  constexpr std::string_view kBetween = "::";
  if (const std::size_t zero = text.find('\0'); zero != std::string_view::npos) {
    return text.substr(0, zero);
  }
  const std::size_t colons = text.find(kBetween);
  return colons == std::string_view::npos ? text : text.substr(colons + kBetween.size());
}

}  // namespace atelier
