#include "core/io/mesh_stl.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/text_scanner.h"
#include "core/printable.h"

namespace atelier {
namespace {

constexpr std::size_t kStlHeader = 80;    // bytes before the count
constexpr std::size_t kStlTriangle = 50;  // normal, three corners, two bytes

using StlCorner = std::array<double, 3>;

struct CornerHash {
  std::size_t operator()(const StlCorner& corner) const {
    std::uint64_t hash = 0;
    for (const double value : corner) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      hash = (hash ^ bits) * 0x9E3779B97F4A7C15U;
      hash ^= hash >> 29U;
    }
    return hash;
  }
};

/// Triangles of corners as triangles of vertices.
class StlSurface {
 public:
  StlSurface(const std::string& name, const Limits& limits) : name_(name), limits_(limits) {}

  /// False for a coordinate beyond the limits.
  bool add(StlCorner corner) {
    for (double& value : corner) {
      if (!(std::abs(value) <= limits_.mesh_coordinate)) {
        return false;
      }
      value += 0.0;  // -0 is 0
    }
    const auto [place, fresh] = index_.try_emplace(corner, static_cast<int>(vertices_.size() / 3));
    if (fresh) {
      vertices_.insert(vertices_.end(), corner.begin(), corner.end());
    }
    mesh_.corner_vertices.push_back(place->second);
    return true;
  }

  void end_triangle() {
    mesh_.polygon_starts.push_back(static_cast<int>(mesh_.corner_vertices.size()));
    if (std::cmp_greater(mesh_.polygon_starts.size() - 1, limits_.mesh_faces) ||
        std::cmp_greater(vertices_.size() / 3, limits_.mesh_vertices)) {
      throw DataError(name_, "", "more triangles or vertices than the limits allow",
                      "a smaller mesh");
    }
  }

  void warn(const std::string& what) {
    mesh_.findings.push_back(
        {Severity::Warning, "stl-count", name_, what, "all that the file has are read"});
  }

  PolygonMesh mesh() {
    if (mesh_.corner_vertices.empty()) {
      throw DataError(name_, "", "no triangle", "an STL file with at least one");
    }
    const auto vertices = static_cast<Index>(vertices_.size() / 3);
    mesh_.vertices = Eigen::Map<const Points>(vertices_.data(), vertices, 3);
    mesh_.findings.push_back(
        {Severity::Note, "stl-joined", name_,
         counted(std::ssize(mesh_.corner_vertices), "corner") + " of triangles in " +
             counted(vertices, "place"),
         "corners at the same place are one vertex: STL has no vertices of its own"});
    return std::move(mesh_);
  }

 private:
  const std::string& name_;
  const Limits& limits_;
  PolygonMesh mesh_;
  std::vector<double> vertices_;
  std::unordered_map<StlCorner, int, CornerHash> index_;
};

/// Whether the last bytes are line ends, blanks or zeros, as transfers and editors leave them.
bool ends_empty(ByteReader in, std::size_t bytes) {
  in.skip(in.remaining() - bytes, "triangles");
  bool empty = true;
  while (in.remaining() > 0) {
    const auto byte = in.little<std::uint8_t>("a byte");
    empty = empty && (byte == 0 || byte == '\n' || byte == '\r' || byte == ' ' || byte == 0x1A);
  }
  return empty;
}

PolygonMesh read_binary_stl(ByteReader in, const std::string& name, const Limits& limits) {
  in.seek(kStlHeader, "the header");
  const auto count = in.little<std::uint32_t>("the number of triangles");
  in.paid(count, kStlTriangle, "triangles");
  const std::size_t held = in.remaining() / kStlTriangle;
  const std::size_t over = in.remaining() - held * kStlTriangle;
  if (over > 0 && (held != count || !ends_empty(in, over))) {
    in.fail(std::to_string(in.remaining()) + " bytes behind the header",
            std::to_string(std::uint64_t{count} * kStlTriangle) + " for " +
                counted(count, "triangle") + ", or a text that begins with 'solid'");
  }
  StlSurface surface(name, limits);
  if (over > 0) {
    surface.warn(counted(over, "byte") + " of no triangle at the end: line ends or zeros");
  }
  if (held != count) {  // VTK writes strips that it does not count
    surface.warn("the header counts " + counted(count, "triangle") + ", the file has " +
                 std::to_string(held));
  }
  for (std::size_t triangle = 0; triangle < held; ++triangle) {
    in.skip(12, "a normal");
    for (int corner = 0; corner < 3; ++corner) {
      StlCorner place;
      for (double& value : place) {
        value = static_cast<double>(in.little<float>("a coordinate"));
      }
      if (!surface.add(place)) {
        in.fail("a coordinate that is not finite, or beyond the limits", "a coordinate");
      }
    }
    in.skip(2, "the bytes behind a triangle");
    surface.end_triangle();
  }
  return surface.mesh();
}

bool is_stl_word(std::string_view word, std::string_view expected) {
  return std::equal(word.begin(), word.end(), expected.begin(), expected.end(), [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == b;
  });
}

PolygonMesh read_text_stl(std::string_view text, const std::string& name, const Limits& limits) {
  TextScanner scanner(text, name, limits.line_bytes);
  StlSurface surface(name, limits);
  int corners = -1;  // of this facet; outside of facets -1
  while (scanner.next_line()) {
    const std::string_view word = scanner.next_word();
    if (is_stl_word(word, "facet")) {
      if (corners >= 0) {
        scanner.fail("a facet in a facet", "endfacet");
      }
      corners = 0;
    } else if (is_stl_word(word, "vertex")) {
      StlCorner place;
      for (double& value : place) {
        value = scanner.number("a coordinate");
      }
      if (corners < 0 || ++corners > 3 || !surface.add(place)) {
        scanner.fail(corners < 0   ? "a vertex outside of a facet"
                     : corners > 3 ? "a fourth corner of a facet"
                                   : "a coordinate beyond the limits",
                     "three corners in each facet");
      }
    } else if (is_stl_word(word, "endfacet")) {
      if (corners != 3) {
        scanner.fail("a facet of " + counted(std::max(corners, 0), "corner"), "three");
      }
      corners = -1;
      surface.end_triangle();
    } else if (!word.empty() && !is_stl_word(word, "outer") && !is_stl_word(word, "endloop") &&
               !is_stl_word(word, "solid") && !is_stl_word(word, "endsolid") &&
               !is_stl_word(word, "color")) {
      scanner.fail(in_quotes(word),
                   "solid, facet, outer loop, vertex, endloop, endfacet, endsolid");
    }
  }
  if (corners >= 0) {
    scanner.fail("the end of the file in a facet", "endfacet (the file is cut off)");
  }
  return surface.mesh();
}

}  // namespace

PolygonMesh read_stl(std::span<const std::byte> bytes, const std::string& name,
                     const Limits& limits) {
  ByteReader in(bytes, name);
  const std::string_view text = as_text(bytes);
  const std::size_t begin = std::min(text.find_first_not_of(" \t\r\n"), text.size());
  const bool solid = is_stl_word(text.substr(begin, 5), "solid");
  bool pays = false;  // of text no four letters are so small a count
  if (bytes.size() >= kStlHeader + 4) {
    ByteReader counter(bytes, name);
    counter.seek(kStlHeader, "the header");
    const std::uint64_t count = counter.little<std::uint32_t>("the number of triangles");
    pays = count > 0 && count * kStlTriangle <= counter.remaining();
  }
  return solid && !pays ? read_text_stl(text, name, limits) : read_binary_stl(in, name, limits);
}

PolygonMesh read_stl(const std::filesystem::path& path, const Limits& limits) {
  return read_stl(read_file_bytes(path, limits.mesh_file_bytes), path.string(), limits);
}

}  // namespace atelier
