#include "bodymodel/formats/motion_c3d.h"

#include <cmath>
#include <map>
#include <set>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/polygon_mesh.h"

namespace atelier {
namespace {

constexpr std::uint64_t kBlock = 512;
constexpr int kMagic = 0x50;
constexpr int kIntel = 84;
constexpr int kMips = 86;

// One parameter as it stands in the file.
struct C3dParameter {
  int type = 0;  // -1 text, 1 byte, 2 integer, 4 real
  std::vector<std::size_t> sizes;
  std::span<const std::byte> data;
};
using Parameters = std::map<std::string, C3dParameter>;  // "POINT:LABELS"

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

// Numbers in the file's own order of bytes.
class Numbers {
 public:
  Numbers(std::span<const std::byte> bytes, const std::string& file, bool big)
      : reader_(bytes, file), big_(big) {}

  template <class T>
  T next(std::string_view what) {
    return big_ ? reader_.big<T>(what) : reader_.little<T>(what);
  }
  ByteReader& reader() { return reader_; }

 private:
  ByteReader reader_;
  bool big_;
};

// The parameter section: groups have negative ids, parameters the positive id of their group.
Parameters read_parameters(std::span<const std::byte> bytes, const std::string& file,
                           std::uint64_t offset, bool big) {
  Numbers numbers(bytes, file, big);
  ByteReader& in = numbers.reader();
  in.seek(offset + 4, "parameters");
  std::map<int, std::string> groups;
  std::vector<std::pair<int, std::pair<std::string, C3dParameter>>> found;
  while (in.remaining() > 2) {
    const int letters = std::abs(signed_byte(in, "a parameter's name"));
    const int id = signed_byte(in, "a parameter's group");
    if (letters == 0 || id == 0) {
      break;
    }
    const std::string word = upper(in.text(static_cast<std::size_t>(letters), "a name"));
    const std::size_t at = in.position();
    const int next = numbers.next<std::int16_t>("an offset");
    if (id < 0) {
      groups[-id] = word;
    } else {
      C3dParameter parameter;
      parameter.type = signed_byte(in, "a type");
      const int rank = in.little<std::uint8_t>("a number of dimensions");
      std::size_t count = 1;
      for (int d = 0; d < rank; ++d) {
        parameter.sizes.push_back(in.little<std::uint8_t>("a dimension"));
        count = count > in.remaining() ? count : count * parameter.sizes.back();
      }
      const std::size_t width = static_cast<std::size_t>(std::max(1, std::abs(parameter.type)));
      parameter.data = in.take(in.paid(count, width, word) * width, word);
      found.push_back({id, {word, parameter}});
    }
    if (next == 0) {
      break;
    }
    if (next < 0) {
      in.fail("an offset of " + std::to_string(next), "parameters that follow each other");
    }
    in.seek(at + static_cast<std::size_t>(next), "the next parameter");
  }
  Parameters parameters;
  for (auto& [id, named] : found) {
    parameters.emplace(groups[id] + ":" + named.first, named.second);
  }
  return parameters;
}

std::vector<std::string> texts(const Parameters& parameters, const std::string& name) {
  const auto found = parameters.find(name);
  std::vector<std::string> result;
  if (found == parameters.end() || found->second.type != -1 || found->second.sizes.empty()) {
    return result;
  }
  const C3dParameter& parameter = found->second;
  const std::size_t length = parameter.sizes[0];
  const std::string_view all(reinterpret_cast<const char*>(parameter.data.data()),
                             parameter.data.size());
  for (std::size_t at = 0; length > 0 && at + length <= all.size(); at += length) {
    result.push_back(trimmed(all.substr(at, length)));
  }
  return result;
}

double real(const Parameters& parameters, const std::string& name, const std::string& file,
            bool big, double otherwise) {
  const auto found = parameters.find(name);
  if (found == parameters.end() || found->second.type != 4 || found->second.data.size() < 4) {
    return otherwise;
  }
  return static_cast<double>(Numbers(found->second.data, file, big).next<float>(name));
}

// LABELS, LABELS2, ... hold 255 names each.
std::vector<std::string> labels(const Parameters& parameters) {
  std::vector<std::string> all = texts(parameters, "POINT:LABELS");
  for (int more = 2;; ++more) {
    const std::vector<std::string> next = texts(parameters, "POINT:LABELS" + std::to_string(more));
    if (next.empty()) {
      return all;
    }
    all.insert(all.end(), next.begin(), next.end());
  }
}

// "Subject:" before every name says nothing.
void drop_common_prefix(std::vector<std::string>& names) {
  std::string prefix;
  for (const std::string& name : names) {
    const std::size_t colon = name.find(':');
    const std::string before = colon == std::string::npos ? "" : name.substr(0, colon + 1);
    if (before.empty() || (!prefix.empty() && before != prefix)) {
      return;
    }
    prefix = before;
  }
  for (std::string& name : names) {
    name = name.substr(prefix.size());
  }
}

struct Header {
  int points = 0;
  int analog = 0;  // numbers a frame
  int first = 0;
  std::int64_t frames = 0;
  double scale = 0;  // below 0: coordinates are real numbers
  double fps = 0;
  std::uint64_t data = 0;  // byte
};

Header read_header(Numbers& numbers) {
  ByteReader& in = numbers.reader();
  in.seek(2, "the header");
  Header header;
  header.points = numbers.next<std::uint16_t>("the number of points");
  header.analog = numbers.next<std::uint16_t>("the number of analog values");
  header.first = numbers.next<std::uint16_t>("the first frame");
  const int last = numbers.next<std::uint16_t>("the last frame");
  header.frames = std::int64_t{last} - header.first + 1;
  in.skip(2, "the longest gap");
  header.scale = static_cast<double>(numbers.next<float>("the scale"));
  const int block = numbers.next<std::uint16_t>("the block of the data");
  in.skip(2, "analog values a frame");
  header.fps = static_cast<double>(numbers.next<float>("the frame rate"));
  if (block < 2) {
    in.fail("data in block " + std::to_string(block), "a block behind the header");
  }
  header.data = (static_cast<std::uint64_t>(block) - 1) * kBlock;
  return header;
}

}  // namespace

MarkerClip read_c3d(std::span<const std::byte> bytes, const std::string& name,
                    const Limits& limits) {
  ByteReader start(bytes, name);
  const int block = start.little<std::uint8_t>("the block of the parameters");
  if (start.little<std::uint8_t>("the key") != kMagic || block < 2) {
    start.fail("no key of a C3D file", "a C3D file");
  }
  const std::uint64_t parameters_at = (static_cast<std::uint64_t>(block) - 1) * kBlock;
  start.seek(parameters_at + 3, "the processor type");
  const int processor = start.little<std::uint8_t>("the processor type");
  if (processor != kIntel && processor != kMips) {
    start.fail("processor type " + std::to_string(processor),
               "84 (Intel) or 86 (MIPS); convert DEC files");
  }
  const bool big = processor == kMips;
  Numbers numbers(bytes, name, big);
  ByteReader& in = numbers.reader();
  const Header header = read_header(numbers);
  const Parameters parameters = read_parameters(bytes, name, parameters_at, big);

  MarkerClip clip;
  clip.name = name;
  clip.fps = real(parameters, "POINT:RATE", name, big, header.fps);
  if (!(clip.fps > 0) || !std::isfinite(clip.fps)) {
    throw DataError(name, "POINT:RATE", std::to_string(clip.fps), "more than 0");
  }
  const std::vector<std::string> units = texts(parameters, "POINT:UNITS");
  const std::string unit = units.empty() || units[0].empty() ? "mm" : units[0];
  clip.metres_per_unit = metres_of_unit(unit);
  if (clip.metres_per_unit == 0) {
    throw DataError(name, "POINT:UNITS", "'" + unit.substr(0, 20) + "'", "m, cm, mm or in");
  }
  std::vector<std::string> names = labels(parameters);
  names.resize(std::min(names.size(), static_cast<std::size_t>(header.points)));
  std::vector<std::size_t> kept;
  for (std::size_t m = 0; m < names.size(); ++m) {
    if (!names[m].empty() && names[m][0] != '*') {
      kept.push_back(m);
      clip.markers.push_back(names[m]);
    }
  }
  drop_common_prefix(clip.markers);
  if (clip.markers.empty() || static_cast<std::int64_t>(clip.markers.size()) > limits.joints) {
    throw DataError(name, "POINT:LABELS", std::to_string(clip.markers.size()) + " names of points",
                    "1 to " + std::to_string(limits.joints));
  }
  std::set<std::string> once;
  for (const std::string& marker : clip.markers) {
    if (!once.insert(marker).second) {
      throw DataError(name, "POINT:LABELS", "marker '" + marker.substr(0, 40) + "' twice",
                      "each name once");
    }
  }

  const bool real_numbers = header.scale < 0;
  const std::size_t width = real_numbers ? 4 : 2;
  const std::size_t row = width * (4 * static_cast<std::size_t>(header.points) +
                                   static_cast<std::size_t>(header.analog));
  in.seek(header.data, "the data");
  if (header.frames < 1 || header.frames > limits.frames) {
    in.fail(std::to_string(header.frames) + " frames", "1 to " + std::to_string(limits.frames));
  }
  in.paid(static_cast<std::uint64_t>(header.frames), row, "the frames");
  const double scale = clip.metres_per_unit * (real_numbers ? 1 : header.scale);
  for (std::int64_t frame = 0; frame < header.frames; ++frame) {
    Points positions = Points::Zero(static_cast<Index>(kept.size()), 3);
    std::vector<bool> seen(kept.size(), false);
    const std::size_t at = in.position();
    for (std::size_t m = 0; m < kept.size(); ++m) {
      in.seek(at + kept[m] * 4 * width, "a point");
      double values[4];
      for (double& value : values) {
        value = real_numbers ? static_cast<double>(numbers.next<float>("a coordinate"))
                             : static_cast<double>(numbers.next<std::int16_t>("a coordinate"));
      }
      if (values[3] < 0) {
        continue;
      }
      for (int i = 0; i < 3; ++i) {
        const double metres = scale * values[i];
        if (!(std::abs(metres) < limits.mesh_coordinate)) {
          in.fail("a coordinate of " + std::to_string(values[i]), "a finite number");
        }
        positions(static_cast<Index>(m), i) = metres;
      }
      seen[m] = true;
    }
    in.seek(at + row, "the next frame");
    clip.frame_ids.push_back(header.first + static_cast<int>(frame));
    clip.positions.push_back(std::move(positions));
    clip.seen.push_back(std::move(seen));
  }
  return clip;
}

MarkerClip read_c3d(const std::filesystem::path& path, const Limits& limits) {
  MarkerClip clip =
      read_c3d(read_file_bytes(path, limits.motion_file_bytes), path.string(), limits);
  clip.name = path.stem().string();
  return clip;
}

}  // namespace atelier
