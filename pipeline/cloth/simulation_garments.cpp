#include "pipeline/cloth/simulation_garments.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/error.h"
#include "core/garment_archive.h"
#include "core/io/joined_names.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/median.h"
#include "core/nearest_name.h"
#include "core/tree.h"
#include "core/usage_error.h"
#include "pipeline/cloth/scene_check.h"
#include "simulation/cloth/weld_seams.h"
#include "simulation/material/resolve_material.h"

namespace atelier {
namespace {

/// Refuses a flat shape that is not the surface's size, as coordinates of a texture are not. Cloth
/// that hangs or fits tightly is a tenth longer than flat, hardly more.
void require_flat_size(const Garment& garment, const std::filesystem::path& file) {
  std::vector<double> ratios;
  for (Index f = 0; f < garment.mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto length = [&](const auto& rows, const Triangles& faces) {
        return (rows.row(faces(f, k)) - rows.row(faces(f, (k + 1) % 3))).norm();
      };
      const double surface = length(garment.mesh.vertices, garment.mesh.faces);
      if (surface > 0) {
        ratios.push_back(length(garment.rest, garment.rest_faces) / surface);
      }
    }
  }
  const double ratio = ratios.empty() ? 0 : median(ratios);
  constexpr double kMost = 1.25;
  if (!(ratio > 1 / kMost && ratio < kMost)) {
    char text[80];
    std::snprintf(text, sizeof text, "edges %.3g times as long as the surface's", ratio);
    throw DataError(file.string(), "texture coordinates", text,
                    "a flat rest shape in metres, as garment.obj of flatten and garment.h5 of "
                    "drape have it");
  }
}

/// A mesh, or an archive of a garment with rest shape, seams and attachments, `scale` times as
/// large.
Garment read_garment(const std::filesystem::path& file, bool flat_rest, double scale) {
  Garment garment;
  if (lower_extension(file) == ".json") {
    throw DataError(file.string(), "file name", "a pattern, which has no shape in space yet",
                    "a mesh or garment.h5 of atelier drape --garment " + file.filename().string() +
                        " --out FOLDER");
  }
  const std::string drafted = nearest_name(file.string(), {"dress", "tee", "skirt", "trousers"});
  if (!drafted.empty() && !std::filesystem::exists(file)) {
    throw DataError(file.string(), "", "no such file",
                    "a mesh or a garment.h5; '" + drafted + "' is drafted and put on by atelier " +
                        "drape --garment " + drafted + " --out FOLDER");
  }
  if (lower_extension(file) == ".h5") {
    garment = read_garment_archive(file);
    garment.rest *= scale;  // what is larger is larger at rest, too
  } else {
    garment.mesh = read_mesh(file);
  }
  garment.name = file.string();
  garment.mesh.vertices *= scale;
  if (flat_rest) {
    if (garment.mesh.uv_faces.rows() != garment.mesh.faces.rows()) {
      throw DataError(file.string(), "texture coordinates", "none",
                      "those of every triangle's corners, in metres: garment.obj of flatten");
    }
    garment.rest = garment.mesh.uvs;
    garment.rest_faces = garment.mesh.uv_faces;
  }
  return garment;
}

/// Refuses what the options ask of a garment and it has not; of several it is named.
void require_options(const Garment& garment, const SimulateOptions& options,
                     const std::string& name) {
  try {
    require_garment_options(garment, options);
  } catch (const UsageError& error) {
    throw name.empty() ? error : UsageError(name + ": " + error.what());
  }
}

}  // namespace

std::vector<std::filesystem::path> garment_paths(const std::string& text) {
  if (std::filesystem::exists(text) || text.find('+') == std::string::npos) {
    return {text};
  }
  std::vector<std::filesystem::path> paths;
  for (const std::string& name : joined_names(text)) {
    if (name.empty()) {
      throw UsageError("--garment '" + text.substr(0, 80) +
                       "' has a garment without a name; it takes files joined by +");
    }
    paths.emplace_back(name);
  }
  return paths;
}

std::vector<std::string> garment_names(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> names;
  for (const std::filesystem::path& file : files) {
    std::string name = file.stem().string();
    if (std::find(names.begin(), names.end(), name) != names.end()) {
      name += "_" + std::to_string(names.size() + 1);
    }
    names.push_back(std::move(name));
  }
  return names;
}

std::vector<Garment> placed_garments(const std::vector<std::filesystem::path>& files,
                                     const SimulateOptions& options) {
  const Material material = resolve_material(options.material);
  std::vector<Garment> garments;
  for (const std::filesystem::path& file : files) {
    Garment garment = read_garment(file, options.flat_rest, options.scale);
    garment.mesh.vertices.rowwise() +=
        Eigen::RowVector3d(options.move_x, options.move_y, options.move_z);
    if (options.flat_rest) {
      require_flat_size(garment, file);
    }
    garment.material = material;
    garments.push_back(std::move(garment));
  }
  const std::vector<std::string> names = garment_names(files);
  const bool seams = std::any_of(garments.begin(), garments.end(),
                                 [](const Garment& one) { return !one.seams.empty(); });
  for (std::size_t g = 0; g < garments.size(); ++g) {
    SimulateOptions of_it = options;
    of_it.sewn = options.sewn || seams;  // seams left open are those of whoever has some
    require_options(garments[g], of_it, files.size() > 1 ? names[g] : "");
    if (options.sewn && !garments[g].seams.empty()) {
      garments[g] = weld_seams(garments[g]);
    }
  }
  return garments;
}

void attach_top(Garment& garment, const Points& body, const Triangles& faces, double depth) {
  const double top = garment.mesh.vertices.col(1).maxCoeff();
  const TriangleTree tree = build_tree(body, faces);
  for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d p = garment.mesh.vertices.row(v).transpose();
    if (p.y() < top - depth) {
      continue;
    }
    Attachment attachment;
    attachment.vertex = static_cast<int>(v);
    attachment.triangle = closest_point(tree, p).face;
    const Eigen::Vector3d a = body.row(faces(attachment.triangle, 0)).transpose();
    const Eigen::Vector3d e1 = Eigen::Vector3d(body.row(faces(attachment.triangle, 1))) - a;
    const Eigen::Vector3d e2 = Eigen::Vector3d(body.row(faces(attachment.triangle, 2))) - a;
    const Eigen::Vector3d normal = e1.cross(e2);
    const double square = normal.squaredNorm();
    if (!(square > 0)) {
      continue;
    }
    const Eigen::Vector3d d = p - a;
    attachment.barycentric[1] = d.cross(e2).dot(normal) / square;
    attachment.barycentric[2] = e1.cross(d).dot(normal) / square;
    attachment.barycentric[0] = 1 - attachment.barycentric[1] - attachment.barycentric[2];
    attachment.distance = d.dot(normal) / std::sqrt(square);
    garment.attachments.push_back(attachment);
  }
}

}  // namespace atelier
