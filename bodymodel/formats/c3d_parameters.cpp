#include "bodymodel/formats/c3d_parameters.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace atelier {
namespace {

constexpr std::uint64_t kBlock = 512;
constexpr int kMagic = 0x50;
constexpr std::size_t kMaxFindings = 10;

int signed_byte(ByteReader& in, std::string_view what) {
  const int byte = in.little<std::uint8_t>(what);
  return byte < 128 ? byte : byte - 256;
}

std::string upper(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  }
  return result;
}

std::string trimmed(std::string_view text) {
  while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) {
    text.remove_suffix(1);
  }
  while (!text.empty() && text.front() == ' ') {
    text.remove_prefix(1);
  }
  return std::string(text);
}

}  // namespace

double C3dNumbers::real(std::string_view what) {
  if (processor_ != C3dProcessor::Dec) {
    return static_cast<double>(next<float>(what));
  }
  // Two words, the high one first; the exponent counts from 2 less than IEEE's, 0 is zero.
  const std::uint32_t high = reader_.little<std::uint16_t>(what);
  const std::uint32_t low = reader_.little<std::uint16_t>(what);
  const std::uint32_t bits = high << 16 | low;
  return (bits & 0x7F800000U) == 0 ? 0 : static_cast<double>(std::bit_cast<float>(bits)) / 4;
}

C3dFile::C3dFile(std::span<const std::byte> bytes, const std::string& file)
    : bytes_(bytes), file_(file) {
  ByteReader start(bytes, file);
  const int block = start.little<std::uint8_t>("the block of the parameters");
  if (start.little<std::uint8_t>("the key") != kMagic || block < 2) {
    start.fail("no key of a C3D file", "a C3D file");
  }
  const std::uint64_t parameters_at = (static_cast<std::uint64_t>(block) - 1) * kBlock;
  start.seek(parameters_at + 3, "the processor type");
  const int processor = start.little<std::uint8_t>("the processor type");
  if (processor < 84 || processor > 86) {
    start.fail("processor type " + std::to_string(processor), "84 (Intel), 85 (DEC) or 86 (MIPS)");
  }
  processor_ = static_cast<C3dProcessor>(processor);
  read_header();
  read_parameters(parameters_at);
}

void C3dFile::read_header() {
  C3dNumbers numbers(bytes_, file_, processor_);
  ByteReader& in = numbers.reader();
  in.seek(2, "the header");
  header_.points = numbers.next<std::uint16_t>("the number of points");
  header_.analog = numbers.next<std::uint16_t>("the number of analog values");
  header_.first = numbers.next<std::uint16_t>("the first frame");
  header_.last = numbers.next<std::uint16_t>("the last frame");
  in.skip(2, "the longest gap");
  header_.scale = numbers.real("the scale");
  const int block = numbers.next<std::uint16_t>("the block of the data");
  header_.analog_samples = numbers.next<std::uint16_t>("analog samples a frame");
  header_.fps = numbers.real("the frame rate");
  if (block < 2) {
    in.fail("data in block " + std::to_string(block), "a block behind the header");
  }
  header_.data = (static_cast<std::uint64_t>(block) - 1) * kBlock;
}

namespace {

// Walks over the entries of the parameter section: groups have negative ids, parameters the
// positive id of their group.
class C3dEntries {
 public:
  C3dEntries(C3dNumbers& numbers, const std::string& file) : numbers_(numbers), file_(file) {}

  // False behind the last one. An entry ends behind its description, and says again how far the
  // next one is; of the two the one counts where an entry stands. What follows an entry that leads
  // nowhere is left out.
  bool next(int& id, std::string& word, C3dParameter& parameter, std::vector<Finding>& findings) {
    if (look(reader().position()) != Place::Entry) {
      return false;
    }
    const int letters = std::abs(signed_byte(reader(), "a parameter's name"));
    id = signed_byte(reader(), "a parameter's group");
    word = upper(reader().text(static_cast<std::size_t>(letters), "a name"));
    const std::uint64_t at = reader().position();
    const std::int64_t offset = numbers_.next<std::int16_t>("an offset");
    const bool whole = id < 0 || read_content(parameter);
    const std::uint64_t content_end = reader().position();
    std::uint64_t own_end = content_end;
    if (whole && reader().remaining() > 0) {
      own_end += 1 + std::uint64_t{reader().little<std::uint8_t>("a description")};
    }
    const std::uint64_t said = offset > 0 ? at + static_cast<std::uint64_t>(offset) : at;
    const bool inside = whole && said < content_end;
    const bool follows_said = !inside && said > at && look(said) == Place::Entry;
    if (offset == 0 || (!inside && said > at && look(said) == Place::End &&
                        (!whole || look(own_end) != Place::Entry))) {
      reader().seek(end(), "the end");
    } else if (follows_said) {
      reader().seek(said, "the next parameter");
    } else {
      if (findings.size() < kMaxFindings) {
        findings.push_back({Severity::Warning, "c3d-parameters", file_,
                            "the offset behind parameter " + word.substr(0, 40) + " is " +
                                std::to_string(offset) + ", where no other begins",
                            "the parameters are read on behind its own end"});
      }
      reader().seek(whole && own_end <= end() ? own_end : end(), "the next parameter");
    }
    if (!whole) {
      word.clear();
    }
    return true;
  }

 private:
  enum class Place { Nothing, End, Entry };

  ByteReader& reader() { return numbers_.reader(); }
  std::uint64_t end() { return reader().position() + reader().remaining(); }

  // What stands at a byte: an entry has a name of printable letters.
  Place look(std::uint64_t place) {
    const std::uint64_t back = reader().position();
    if (place + 2 > end()) {
      return place <= end() ? Place::End : Place::Nothing;
    }
    const std::uint64_t last = end();
    reader().seek(place, "a parameter");
    const auto letters = static_cast<std::size_t>(std::abs(signed_byte(reader(), "a name")));
    const int id = signed_byte(reader(), "a group");
    Place found = letters == 0 || id == 0 ? Place::End : Place::Nothing;
    if (found == Place::Nothing && place + 4 + letters <= last) {
      const std::string_view name = reader().text(letters, "a name");
      const bool printable =
          std::all_of(name.begin(), name.end(), [](char c) { return c >= ' ' && c <= '~'; });
      found = printable ? Place::Entry : Place::Nothing;
    }
    reader().seek(back, "a parameter");
    return found;
  }

  // False where the section ends inside it.
  bool read_content(C3dParameter& parameter) {
    if (reader().remaining() < 2) {
      return false;
    }
    parameter = {};
    parameter.type = signed_byte(reader(), "a type");
    const std::size_t rank = reader().little<std::uint8_t>("a number of dimensions");
    if (reader().remaining() < rank) {
      return false;
    }
    std::size_t bytes = static_cast<std::size_t>(std::max(1, std::abs(parameter.type)));
    for (std::size_t d = 0; d < rank; ++d) {
      parameter.sizes.push_back(reader().little<std::uint8_t>("a dimension"));
      bytes = bytes > reader().remaining() ? bytes : bytes * parameter.sizes.back();
    }
    if (bytes > reader().remaining()) {
      return false;
    }
    parameter.data = reader().take(bytes, "a parameter");
    return true;
  }

  C3dNumbers& numbers_;
  const std::string& file_;
};

}  // namespace

void C3dFile::read_parameters(std::uint64_t offset) {
  const bool data_behind = header_.data > offset && header_.data < bytes_.size();
  C3dNumbers numbers(data_behind ? bytes_.first(header_.data) : bytes_, file_, processor_);
  numbers.reader().seek(offset + 4, "parameters");
  C3dEntries entries(numbers, file_);
  std::map<int, std::string> groups;
  std::vector<std::pair<int, std::pair<std::string, C3dParameter>>> found;
  int id = 0;
  std::string word;
  C3dParameter parameter;
  while (entries.next(id, word, parameter, findings_)) {
    if (id < 0) {
      groups[-id] = word;
    } else if (!word.empty()) {
      found.push_back({id, {word, parameter}});
    }
  }
  for (auto& [group, named] : found) {
    parameters_.emplace(groups[group] + ":" + named.first, named.second);
  }
}

int C3dFile::type(const std::string& name) const {
  const auto found = parameters_.find(name);
  return found == parameters_.end() ? 0 : found->second.type;
}

std::vector<double> C3dFile::numbers(const std::string& name) const {
  std::vector<double> result;
  const int width = type(name);
  if (width != 1 && width != 2 && width != 4) {
    return result;
  }
  const std::span<const std::byte> data = parameters_.at(name).data;
  C3dNumbers numbers(data, file_, processor_);
  for (std::size_t i = 0; i < data.size() / static_cast<std::size_t>(width); ++i) {
    result.push_back(width == 4   ? numbers.real(name)
                     : width == 2 ? numbers.next<std::uint16_t>(name)
                                  : numbers.next<std::uint8_t>(name));
  }
  return result;
}

std::optional<double> C3dFile::number(const std::string& name) const {
  const std::vector<double> all = numbers(name);
  return all.empty() ? std::nullopt : std::optional(all[0]);
}

std::vector<std::string> C3dFile::texts(const std::string& name) const {
  std::vector<std::string> result;
  for (int part = 1;; ++part) {
    const auto found = parameters_.find(part == 1 ? name : name + std::to_string(part));
    if (found == parameters_.end() || found->second.type != -1 || found->second.sizes.empty()) {
      return result;
    }
    const std::size_t length = found->second.sizes[0];
    const std::string_view all(reinterpret_cast<const char*>(found->second.data.data()),
                               found->second.data.size());
    for (std::size_t at = 0; length > 0 && at + length <= all.size(); at += length) {
      result.push_back(trimmed(all.substr(at, length)));
    }
  }
}

}  // namespace atelier
