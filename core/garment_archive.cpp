#include "core/garment_archive.h"

#include <algorithm>
#include <limits>

#include "core/archive_arrays.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr const char* kSchema = "atelier.garment";
constexpr int kGarmentVersion = 1;
constexpr const char* kCloth = "cloth";

using IntRows = Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::vector<double> material_numbers(const Material& m) {
  return {m.density, m.stretch_warp, m.stretch_weft, m.shear,
          m.bending, m.damping,      m.friction,     m.thickness};
}

/// Names that the schema has; those of the mesh itself are checked where it is read.
bool is_named(const std::string& dataset) {
  const std::string mesh = std::string(kCloth) + "/";
  if (dataset.starts_with(mesh) && dataset.find('/', mesh.size()) == std::string::npos) {
    return true;
  }
  static const std::vector<std::string> names = {"cloth/pattern/rest",
                                                 "cloth/pattern/rest_faces",
                                                 "cloth/pattern/panels",
                                                 "cloth/pattern/panel_names",
                                                 "cloth/material/values",
                                                 "seams",
                                                 "seam_names",
                                                 "boundaries",
                                                 "boundary_names",
                                                 "attachments/places",
                                                 "attachments/coordinates"};
  return std::find(names.begin(), names.end(), dataset) != names.end();
}

std::string text_at(const Archive& archive, const std::string& name) {
  const auto found = archive.texts.find(name);
  return found == archive.texts.end() ? std::string() : found->second;
}

void put_boundaries(Archive& archive, const Garment& garment) {
  std::vector<int> rows;
  for (std::size_t b = 0; b < garment.boundaries.size(); ++b) {
    for (const int vertex : garment.boundaries[b]) {
      rows.insert(rows.end(), {static_cast<int>(b), vertex});
    }
  }
  put_array(archive, "boundaries",
            tensor_of(rows, {static_cast<std::int64_t>(rows.size() / 2), 2}));
  put_array(archive, "boundary_names", tensor_of_texts(garment.boundary_names));
}

void read_boundaries(Garment& garment, const Archive& archive, const std::string& file) {
  garment.boundary_names = texts_at(archive, "boundary_names", file);
  garment.boundaries.resize(garment.boundary_names.size());
  const auto loops = static_cast<Index>(garment.boundaries.size());
  const Index vertices = garment.mesh.vertices.rows();
  const auto rows =
      index_rows_at<IntRows>(archive, "boundaries", 2, std::max(loops, vertices), file);
  for (Index i = 0; i < rows.rows(); ++i) {
    if (rows(i, 0) >= loops || rows(i, 1) >= vertices) {
      throw DataError(file, "boundaries", "row " + std::to_string(i),
                      "a boundary that has a name, and a vertex");
    }
    garment.boundaries[static_cast<std::size_t>(rows(i, 0))].push_back(rows(i, 1));
  }
}

void put_attachments(Archive& archive, const std::vector<Attachment>& attachments) {
  std::vector<int> places;
  std::vector<double> coordinates;
  for (const Attachment& a : attachments) {
    places.insert(places.end(), {a.vertex, a.triangle});
    coordinates.insert(coordinates.end(),
                       {a.barycentric[0], a.barycentric[1], a.barycentric[2], a.distance});
  }
  const auto count = static_cast<std::int64_t>(attachments.size());
  put_array(archive, "attachments/places", tensor_of(places, {count, 2}));
  put_array(archive, "attachments/coordinates", tensor_of(coordinates, {count, 4}));
}

std::vector<Attachment> attachments_at(const Archive& archive, const std::string& file) {
  const auto places = index_rows_at<IntRows>(archive, "attachments/places", 2,
                                             std::numeric_limits<int>::max(), file);
  const auto coordinates =
      rows_at<RowMatrix>(archive, "attachments/coordinates", 4, places.rows(), file);
  std::vector<Attachment> attachments;
  attachments.reserve(static_cast<std::size_t>(places.rows()));
  for (Index i = 0; i < places.rows(); ++i) {
    attachments.push_back(
        {places(i, 0), places(i, 1), coordinates.row(i).head<3>().transpose(), coordinates(i, 3)});
  }
  return attachments;
}

}  // namespace

void put_cloth(Archive& archive, const std::string& group, const Garment& garment) {
  put_mesh(archive, group, garment.mesh);
  put_array(archive, group + "/pattern/rest", tensor_of(garment.rest));
  put_array(archive, group + "/pattern/rest_faces", tensor_of(garment.rest_faces));
  put_array(archive, group + "/pattern/panels", tensor_of(garment.panels));
  put_array(archive, group + "/pattern/panel_names", tensor_of_texts(garment.panel_names));
  put_array(archive, group + "/material/values", tensor_of(material_numbers(garment.material)));
}

Garment cloth_at(const Archive& archive, const std::string& group, const std::string& file) {
  Garment garment;
  garment.mesh = mesh_at(archive, group, file);
  garment.rest = rows_at<Points2>(archive, group + "/pattern/rest", 2, -1, file);
  garment.rest_faces = index_rows_at<Triangles>(archive, group + "/pattern/rest_faces", 3,
                                                garment.rest.rows(), file);
  garment.panel_names = texts_at(archive, group + "/pattern/panel_names", file);
  if (const Tensor* panels = find_array(archive, group + "/pattern/panels")) {
    garment.panels = indices_of(*panels, static_cast<Index>(garment.panel_names.size()), file,
                                group + "/pattern/panels");
  }
  const std::string place = group + "/material/values";
  const std::vector<double> m = doubles_of(array_at(archive, place, file), file, place);
  if (m.size() != material_numbers({}).size()) {
    throw DataError(file, place, std::to_string(m.size()), "8 numbers");
  }
  garment.material = {"", m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7]};
  check_garment(garment, file);
  return garment;
}

void put_seams(Archive& archive, const std::string& stem, const std::vector<Seam>& seams) {
  std::vector<int> pairs;
  std::vector<std::string> names;
  for (std::size_t s = 0; s < seams.size(); ++s) {
    names.push_back(seams[s].name);
    for (std::size_t i = 0; i < seams[s].a.size(); ++i) {
      pairs.insert(pairs.end(), {static_cast<int>(s), seams[s].a[i], seams[s].b[i]});
    }
  }
  put_array(archive, stem + "s",
            tensor_of(pairs, {static_cast<std::int64_t>(pairs.size() / 3), 3}));
  put_array(archive, stem + "_names", tensor_of_texts(names));
}

std::vector<Seam> seams_at(const Archive& archive, const std::string& stem, Index vertices,
                           const std::string& file) {
  std::vector<Seam> seams;
  for (const std::string& name : texts_at(archive, stem + "_names", file)) {
    seams.push_back({name, {}, {}});
  }
  const auto count = static_cast<Index>(seams.size());
  const auto pairs =
      index_rows_at<IntRows>(archive, stem + "s", 3, std::max(count, vertices), file);
  for (Index i = 0; i < pairs.rows(); ++i) {
    if (pairs(i, 0) >= count || std::max(pairs(i, 1), pairs(i, 2)) >= vertices) {
      throw DataError(file, stem + "s", "row " + std::to_string(i),
                      "a seam and two of " + std::to_string(vertices) + " vertices");
    }
    Seam& seam = seams[static_cast<std::size_t>(pairs(i, 0))];
    seam.a.push_back(pairs(i, 1));
    seam.b.push_back(pairs(i, 2));
  }
  return seams;
}

Archive archive_of(const Garment& garment) {
  check_garment(garment);
  Archive archive;
  archive.schema = kSchema;
  archive.version = kGarmentVersion;
  archive.texts["name"] = garment.name;
  archive.texts["material"] = garment.material.name;
  put_cloth(archive, kCloth, garment);
  put_seams(archive, "seam", garment.seams);
  put_boundaries(archive, garment);
  put_attachments(archive, garment.attachments);
  return archive;
}

Garment garment_of(const Archive& archive, const std::string& file) {
  check_units(archive, file);
  check_names(archive, file, is_named);
  Garment garment = cloth_at(archive, kCloth, file);
  garment.name = text_at(archive, "name");
  garment.material.name = text_at(archive, "material");
  garment.seams = seams_at(archive, "seam", garment.mesh.vertices.rows(), file);
  read_boundaries(garment, archive, file);
  garment.attachments = attachments_at(archive, file);
  check_garment(garment, file);
  return garment;
}

void write_garment_archive(const std::filesystem::path& path, const Garment& garment) {
  write_archive(path, archive_of(garment));
}

Garment read_garment_archive(const std::filesystem::path& path, const Limits& limits) {
  return garment_of(read_archive(path, kSchema, kGarmentVersion, limits), path.string());
}

}  // namespace atelier
