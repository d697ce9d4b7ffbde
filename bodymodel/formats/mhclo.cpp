#include "bodymodel/formats/mhclo.h"

#include <algorithm>
#include <cmath>

#include "bodymodel/formats/skin_weights.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_obj.h"
#include "core/io/text_scanner.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr double kUnitsPerMetre = 10;  // decimetres

class MhcloReader {
 public:
  MhcloReader(std::span<const std::byte> bytes, const std::string& name, Index base_vertices,
              const Limits& limits)
      : scanner_(as_text(bytes), name, limits.line_bytes), base_vertices_(base_vertices) {
    garment_.name = name;
  }

  Mhclo read() {
    bool in_vertices = false;
    bool in_deleted = false;
    while (scanner_.next_line()) {
      const std::string word(scanner_.next_word());
      if (word.empty()) {
        continue;
      }
      std::int64_t number = 0;
      if (parse_integer(word, number) && (in_vertices || in_deleted)) {
        if (in_deleted) {
          read_deleted(number);
        } else {
          read_vertex(number);
        }
        continue;
      }
      in_deleted = word == "delete_verts";
      in_vertices = word == "verts" || (in_vertices && !in_deleted);
      read_word(word);
    }
    if (garment_.vertices.empty()) {
      scanner_.fail("no vertices", "rows after 'verts 0'");
    }
    std::sort(garment_.deleted.begin(), garment_.deleted.end());
    return std::move(garment_);
  }

 private:
  int vertex(std::int64_t number) {
    if (number < 0 || number >= base_vertices_) {
      scanner_.fail("vertex " + std::to_string(number),
                    "a vertex in [0, " + std::to_string(base_vertices_) + ")");
    }
    return static_cast<int>(number);
  }

  void read_word(const std::string& word) {
    if (word == "basemesh") {
      const std::string_view base = scanner_.next_word();
      if (base != "hm08") {
        scanner_.fail("base mesh " + in_quotes(base), "hm08");
      }
    } else if (word == "name") {
      garment_.name = scanner_.rest();
    } else if (word == "obj_file") {
      garment_.obj_file = scanner_.rest();
    } else if (word == "x_scale" || word == "y_scale" || word == "z_scale") {
      const int axis = word[0] - 'x';
      for (int& end : garment_.scale_vertices[axis]) {
        end = vertex(scanner_.integer("a vertex"));
      }
      garment_.scale_lengths[axis] = scanner_.number("a length");
      if (!(garment_.scale_lengths[axis] > 0)) {
        scanner_.fail("length " + short_number(garment_.scale_lengths[axis]), "more than 0");
      }
    }
  }

  void read_vertex(std::int64_t first) {
    MhcloVertex row;
    row.base[0] = row.base[1] = row.base[2] = vertex(first);
    std::string_view next = scanner_.next_word();
    if (!next.empty()) {
      std::int64_t second = 0;
      if (!parse_integer(next, second)) {
        scanner_.fail(in_quotes(next), "a vertex");
      }
      row.base[1] = vertex(second);
      row.base[2] = vertex(scanner_.integer("a vertex"));
      for (int i = 0; i < 3; ++i) {
        row.weights[i] = scanner_.number("a weight");
      }
      for (int i = 0; i < 3; ++i) {
        row.offset[i] = scanner_.number("an offset");
      }
      if (!scanner_.next_word().empty()) {
        scanner_.fail("more than nine words", "one base vertex, or three with weights and offset");
      }
    }
    garment_.vertices.push_back(row);
  }

  // "3 4 10 - 20 31": single vertices and ranges.
  void read_deleted(std::int64_t first) {
    std::int64_t last = vertex(first);
    garment_.deleted.push_back(static_cast<int>(last));
    for (std::string_view word = scanner_.next_word(); !word.empty(); word = scanner_.next_word()) {
      if (word == "-") {
        const std::int64_t end = vertex(scanner_.integer("the end of a range"));
        if (end < last) {
          scanner_.fail("range " + std::to_string(last) + " - " + std::to_string(end),
                        "an increasing one");
        }
        if (static_cast<Index>(garment_.deleted.size()) + end - last > 2 * base_vertices_) {
          scanner_.fail("more vertices than the base mesh has", "each once");
        }
        for (std::int64_t v = last + 1; v <= end; ++v) {
          garment_.deleted.push_back(static_cast<int>(v));
        }
        last = end;
      } else {
        std::int64_t number = 0;
        if (!parse_integer(word, number)) {
          scanner_.fail(in_quotes(word), "a vertex or '-'");
        }
        last = vertex(number);
        garment_.deleted.push_back(static_cast<int>(last));
      }
    }
  }

  TextScanner scanner_;
  Index base_vertices_;
  Mhclo garment_;
};

}  // namespace

Mhclo read_mhclo(std::span<const std::byte> bytes, const std::string& name, Index base_vertices,
                 const Limits& limits) {
  return MhcloReader(bytes, name, base_vertices, limits).read();
}

Mhclo read_mhclo(const std::filesystem::path& path, Index base_vertices, const Limits& limits) {
  return read_mhclo(read_file_bytes(path, limits.mesh_file_bytes), path.string(), base_vertices,
                    limits);
}

Points fitted_vertices(const Mhclo& garment, const Points& base) {
  Eigen::Vector3d scale = Eigen::Vector3d::Constant(1 / kUnitsPerMetre);
  for (int axis = 0; axis < 3; ++axis) {
    const int* ends = garment.scale_vertices[axis];
    if (ends[0] >= 0) {
      ATELIER_CHECK(ends[0] < base.rows() && ends[1] < base.rows(), "another base mesh");
      scale[axis] =
          std::abs(base(ends[0], axis) - base(ends[1], axis)) / garment.scale_lengths[axis];
    }
  }
  Points vertices(static_cast<Index>(garment.vertices.size()), 3);
  for (std::size_t v = 0; v < garment.vertices.size(); ++v) {
    const MhcloVertex& row = garment.vertices[v];
    Eigen::RowVector3d position = row.offset.cwiseProduct(scale).transpose();
    for (int i = 0; i < 3; ++i) {
      ATELIER_CHECK(row.base[i] < base.rows(), "another base mesh");
      position += row.weights[i] * base.row(row.base[i]);
    }
    vertices.row(static_cast<Index>(v)) = position;
  }
  return vertices;
}

SkinWeights fitted_weights(const Mhclo& garment, const SkinWeights& base_skin, Index joints) {
  std::vector<std::vector<Influence>> influences(garment.vertices.size());
  for (std::size_t v = 0; v < garment.vertices.size(); ++v) {
    const MhcloVertex& row = garment.vertices[v];
    for (int i = 0; i < 3; ++i) {
      ATELIER_CHECK(row.base[i] < base_skin.weights.rows(), "another base mesh");
      // Weights may be negative where a vertex lies outside its triangle.
      const double share = std::max(0.0, row.weights[i]);
      for (Index k = 0; k < base_skin.weights.cols() && share > 0; ++k) {
        influences[v].push_back(
            {base_skin.joints(row.base[i], k), share * base_skin.weights(row.base[i], k)});
      }
    }
  }
  return pack_skin_weights(influences, joints).skin;
}

BodyModel read_makehuman_garment(const std::filesystem::path& mhclo, const MakeHumanBody& body,
                                 const Limits& limits) {
  const Mhclo garment = read_mhclo(mhclo, body.base.rows(), limits);
  const std::filesystem::path file(garment.obj_file);
  if (garment.obj_file.empty() || file.has_parent_path() || file == "..") {
    throw DataError(mhclo.string(), "obj_file", in_quotes(garment.obj_file),
                    "the name of an OBJ beside the .mhclo");
  }
  BodyModel model;
  model.name = garment.name;
  model.skeleton = body.model.skeleton;
  model.mesh = triangulated(read_obj(mhclo.parent_path() / file, limits));
  if (model.mesh.vertices.rows() != static_cast<Index>(garment.vertices.size())) {
    throw DataError(mhclo.string(), "verts", std::to_string(garment.vertices.size()) + " rows",
                    std::to_string(model.mesh.vertices.rows()) + ", as its OBJ has vertices");
  }
  // The OBJ's positions are those of the pose in which it was made; the rows say where they belong.
  model.mesh.vertices = fitted_vertices(garment, body.base);
  model.mesh.normals.resize(0, 3);
  model.skin = fitted_weights(garment, body.base_skin, joint_count(model));
  check_body_model(model, mhclo.string());
  return model;
}

}  // namespace atelier
