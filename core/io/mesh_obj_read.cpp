#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <unordered_map>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_obj.h"
#include "core/io/srgb.h"
#include "core/io/text_scanner.h"
#include "core/io/text_writer.h"
#include "core/printable.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr int kMaxCorners = 1024;  // ear clipping costs the square

/// Names in order of their first use.
class NameTable {
 public:
  explicit NameTable(std::vector<std::string>& names) : names_(names) {}

  int index_of(const std::string& name) {
    const auto [place, fresh] = index_.try_emplace(name, static_cast<int>(names_.size()));
    if (fresh) {
      names_.push_back(name);
    }
    return place->second;
  }

 private:
  std::vector<std::string>& names_;
  std::unordered_map<std::string, int> index_;
};

/// The largest index of one kind that a face used, and the line that used it.
struct Reach {
  std::int64_t index = -1;
  std::int64_t line = 0;
};

class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& name, const Limits& limits)
      : scanner_(text, name, limits.line_bytes, true), name_(name), limits_(limits) {}

  PolygonMesh read() {
    while (scanner_.next_line()) {
      read_line();
    }
    finish();
    return std::move(mesh_);
  }

 private:
  void read_line();
  void read_vertex();
  void read_texture();
  void read_normal();
  void read_face();
  int read_index(std::string_view word, std::size_t count, Reach& reach, const char* what);
  void skip(std::string_view word);
  std::string skipped_text() const;
  void check_room(std::size_t count, const char* what) const;
  void check_coordinate(double value) const;
  void finish();
  void check_reach(const Reach& reach, std::size_t count, const char* what) const;

  TextScanner scanner_;
  std::string name_;
  Limits limits_;
  PolygonMesh mesh_;
  NameTable groups_{mesh_.group_names};
  NameTable objects_{mesh_.object_names};
  NameTable materials_{mesh_.material_names};
  int group_ = -1;
  int object_ = -1;
  int material_ = -1;
  std::vector<double> vertices_;
  std::vector<float> colors_;
  std::vector<double> uvs_;
  std::vector<double> normals_;
  std::int64_t triangles_ = 0;
  std::array<Reach, 3> reach_;  // vertex, uv, normal
  std::int64_t skipped_ = 0;    // lines that begin with an unknown word
  std::int64_t skipped_line_ = 0;
  std::vector<std::string> skipped_words_;  // the first of them, each once
  bool numbers_skipped_ = false;            // numbers alone stood behind one of them
};

bool is_one_of(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// A name as it can be written again: control bytes become blanks, and it does not end in one or in
/// a backslash.
std::string name_in(std::string_view text) {
  std::string name(text);
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c >= 0 && c < 32; }, ' ');
  name.resize(name.find_last_not_of(" \\") + 1);  // nothing found: npos + 1 is 0
  return name;
}

void ObjReader::read_line() {
  const std::string_view word = scanner_.next_word();
  if (word.empty()) {
    const std::string_view comment = scanner_.comment();
    if (!comment.empty()) {
      read_convention(std::string(comment), mesh_.convention);
    }
  } else if (word == "v") {
    read_vertex();
  } else if (word == "vt") {
    read_texture();
  } else if (word == "vn") {
    read_normal();
  } else if (word == "f" || word == "fo") {
    read_face();
  } else if (word == "g") {
    group_ = groups_.index_of(name_in(scanner_.rest()));
  } else if (word == "o") {
    object_ = objects_.index_of(name_in(scanner_.rest()));
  } else if (word == "usemtl") {
    material_ = materials_.index_of(name_in(scanner_.rest()));
  } else if (word == "mtllib") {
    mesh_.material_files.push_back(name_in(scanner_.rest()));
  } else if (is_one_of(word, {"cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm",
                              "trim", "hole", "scrv", "sp", "end", "con"})) {
    scanner_.fail("free-form geometry (" + in_quotes(word) + ")", "polygons");
  } else if (!is_one_of(word, {"s", "p", "l", "vp", "mg", "bevel", "c_interp", "d_interp", "lod",
                               "shadow_obj", "trace_obj", "usemap", "maplib"})) {
    skip(word);
  }
}

void ObjReader::read_vertex() {
  std::array<double, 7> values{};
  std::size_t count = 0;
  for (std::string_view word = scanner_.next_word(); !word.empty(); word = scanner_.next_word()) {
    if (count == values.size() || !parse_number(word, values[count])) {
      scanner_.fail(no_number(word), "3 coordinates, or 6 with a colour, all finite");
    }
    ++count;
  }
  if (count < 3 || count == 5) {
    scanner_.fail(counted(static_cast<std::int64_t>(count), "number"),
                  "3 coordinates, or 6 with a colour");
  }
  check_room(vertices_.size() / 3, "vertices");
  const bool colored = count >= 6;
  if (colored != !colors_.empty() && !vertices_.empty()) {
    scanner_.fail(colored ? "a vertex with a colour" : "a vertex without a colour",
                  "colours on all vertices or on none");
  }
  for (int axis = 0; axis < 3; ++axis) {
    check_coordinate(values[axis]);
    vertices_.push_back(values[axis]);
  }
  for (std::size_t i = 3; colored && i < 6; ++i) {
    if (values[i] < 0 || values[i] > 1) {
      scanner_.fail("colour " + short_number(values[i], 7), "0 to 1");
    }
    colors_.push_back(linear_from_srgb(static_cast<float>(values[i])));
  }
}

void ObjReader::read_texture() {
  check_room(uvs_.size() / 2, "texture coordinates");
  const double u = scanner_.number("u");
  double v = 0;
  const std::string_view word = scanner_.next_word();
  if (!word.empty() && !parse_number(word, v)) {
    scanner_.fail(no_number(word), "v, a finite number");
  }
  check_coordinate(u);
  check_coordinate(v);
  uvs_.insert(uvs_.end(), {u, v});
}

void ObjReader::read_normal() {
  check_room(normals_.size() / 3, "normals");
  for (const char* axis : {"x of a normal", "y of a normal", "z of a normal"}) {
    normals_.push_back(scanner_.number(axis));
  }
}

int ObjReader::read_index(std::string_view word, std::size_t count, Reach& reach,
                          const char* what) {
  std::int64_t index = 0;
  if (!parse_integer(word, index) || index == 0) {
    scanner_.fail(in_quotes(word), std::string(what) + " index, from 1 or negative");
  }
  if (index < 0) {
    index += static_cast<std::int64_t>(count) + 1;
    if (index < 1) {
      scanner_.fail(std::string(what) + " index " + std::string(word),
                    "at least -" + std::to_string(count));
    }
  }
  if (index > limits_.mesh_vertices) {
    scanner_.fail(std::string(what) + " index " + std::to_string(index),
                  "at most " + std::to_string(limits_.mesh_vertices));
  }
  if (index - 1 > reach.index) {
    reach = {index - 1, scanner_.line()};
  }
  return static_cast<int>(index - 1);
}

void ObjReader::read_face() {
  int corners = 0;
  for (std::string_view word = scanner_.next_word(); !word.empty(); word = scanner_.next_word()) {
    if (++corners > kMaxCorners) {
      scanner_.fail("a face of more than " + std::to_string(kMaxCorners) + " corners",
                    "smaller polygons");
    }
    std::array<std::string_view, 3> parts{};
    std::size_t part = 0;
    for (std::size_t slash = word.find('/'); slash != std::string_view::npos;
         slash = word.find('/')) {
      if (part == 2) {
        scanner_.fail(in_quotes(word), "vertex/uv/normal");
      }
      parts[part++] = word.substr(0, slash);
      word.remove_prefix(slash + 1);
    }
    parts[part] = word;
    mesh_.corner_vertices.push_back(
        read_index(parts[0], vertices_.size() / 3, reach_[0], "vertex"));
    mesh_.corner_uvs.push_back(
        parts[1].empty() ? -1 : read_index(parts[1], uvs_.size() / 2, reach_[1], "uv"));
    mesh_.corner_normals.push_back(
        parts[2].empty() ? -1 : read_index(parts[2], normals_.size() / 3, reach_[2], "normal"));
  }
  if (corners < 3) {
    scanner_.fail("a face of " + std::to_string(corners) + (corners == 1 ? " corner" : " corners"),
                  "at least 3");
  }
  triangles_ += corners - 2;
  if (triangles_ > limits_.mesh_faces) {
    scanner_.fail("more than " + std::to_string(limits_.mesh_faces) + " triangles",
                  "a smaller mesh");
  }
  mesh_.polygon_starts.push_back(static_cast<int>(mesh_.corner_vertices.size()));
  mesh_.polygon_groups.push_back(group_);
  mesh_.polygon_objects.push_back(object_);
  mesh_.polygon_materials.push_back(material_);
}

/// Programs add lines of their own ("vv", a velocity, of cloth simulators). A mangled line looks
/// alike: where it was a vertex, faces reach beyond those that are left, which is an error.
void ObjReader::skip(std::string_view word) {
  constexpr std::size_t kMostWords = 3;
  int numbers = 0;
  int others = 0;
  double value = 0;
  for (std::string_view next = scanner_.next_word(); !next.empty(); next = scanner_.next_word()) {
    (parse_number(next, value) ? numbers : others) += 1;
  }
  numbers_skipped_ = numbers_skipped_ || (numbers >= 2 && others == 0);
  if (skipped_++ == 0) {
    skipped_line_ = scanner_.line();
  }
  const std::string quoted = in_quotes(word);
  if (skipped_words_.size() < kMostWords &&
      std::find(skipped_words_.begin(), skipped_words_.end(), quoted) == skipped_words_.end()) {
    skipped_words_.push_back(quoted);
  }
}

std::string ObjReader::skipped_text() const {
  std::string words;
  for (const std::string& word : skipped_words_) {
    words += (words.empty() ? "" : ", ") + word;
  }
  return counted(skipped_, "line") + " with an unknown word " + (skipped_ == 1 ? "is" : "are") +
         " skipped: " + words;
}

void ObjReader::check_room(std::size_t count, const char* what) const {
  if (static_cast<std::int64_t>(count) >= limits_.mesh_vertices) {
    scanner_.fail("more than " + std::to_string(limits_.mesh_vertices) + " " + what,
                  "a smaller mesh");
  }
}

void ObjReader::check_coordinate(double value) const {
  if (std::abs(value) > limits_.mesh_coordinate) {
    scanner_.fail("coordinate " + number_text(value),
                  "at most " + number_text(limits_.mesh_coordinate));
  }
}

void ObjReader::check_reach(const Reach& reach, std::size_t count, const char* what) const {
  if (reach.index >= static_cast<std::int64_t>(count)) {
    throw DataError(
        name_, "line " + std::to_string(reach.line),
        std::string(what) + " index " + std::to_string(reach.index + 1),
        "1 to " + std::to_string(count) +
            (skipped_ > 0 ? "; from line " + std::to_string(skipped_line_) + " on " + skipped_text()
                          : std::string()));
  }
}

void clear_if_unused(std::vector<int>& indices) {
  for (const int index : indices) {
    if (index >= 0) {
      return;
    }
  }
  indices.clear();
}

void ObjReader::finish() {
  const std::size_t vertices = vertices_.size() / 3;
  if (vertices == 0) {
    throw DataError(name_, "", "no vertex", "an OBJ file with at least one line \"v x y z\"");
  }
  check_reach(reach_[0], vertices, "vertex");
  check_reach(reach_[1], uvs_.size() / 2, "uv");
  check_reach(reach_[2], normals_.size() / 3, "normal");
  const auto rows = [](std::size_t n) { return static_cast<Index>(n); };
  mesh_.vertices = Eigen::Map<const Points>(vertices_.data(), rows(vertices), 3);
  mesh_.colors = Eigen::Map<const Colors>(colors_.data(), rows(colors_.size() / 3), 3);
  mesh_.uvs = Eigen::Map<const Points2>(uvs_.data(), rows(uvs_.size() / 2), 2);
  mesh_.normals = Eigen::Map<const Points>(normals_.data(), rows(normals_.size() / 3), 3);
  clear_if_unused(mesh_.corner_uvs);
  clear_if_unused(mesh_.corner_normals);
  clear_if_unused(mesh_.polygon_groups);
  clear_if_unused(mesh_.polygon_objects);
  clear_if_unused(mesh_.polygon_materials);
  // A normal for each vertex, and no face that says otherwise: normals of the vertices, also of
  // those that no face uses.
  if (mesh_.normals.rows() == mesh_.vertices.rows() &&
      (mesh_.corner_normals == mesh_.corner_vertices || mesh_.corner_vertices.empty())) {
    mesh_.vertex_normals = mesh_.normals;
    if (!make_unit_rows(mesh_.vertex_normals)) {
      mesh_.vertex_normals.resize(0, 3);
    }
  }
  if (skipped_ > 0) {
    mesh_.findings.push_back(
        {numbers_skipped_ ? Severity::Warning : Severity::Note, "obj-skipped",
         name_ + ": line " + std::to_string(skipped_line_), skipped_text(),
         numbers_skipped_ ? "v, vt, vn and f alone make a mesh" : "a comment begins with '#'"});
  }
}

}  // namespace

PolygonMesh read_obj(std::span<const std::byte> bytes, const std::string& name,
                     const Limits& limits) {
  return ObjReader(as_text(bytes), name, limits).read();
}

PolygonMesh read_obj(const std::filesystem::path& path, const Limits& limits) {
  return read_obj(read_file_bytes(path, limits.mesh_file_bytes), path.string(), limits);
}

}  // namespace atelier
