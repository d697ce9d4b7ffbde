#include "pipeline/pattern/sew_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/json.h"
#include "core/io/mesh_file.h"
#include "core/normals.h"
#include "core/saturating_cast.h"
#include "core/topology.h"
#include "core/tree.h"
#include "pipeline/cloth/captured_scene.h"
#include "pipeline/pattern/flatten_relax.h"
#include "registration/drafting/panels_on_surface.h"
#include "registration/sewing/garment_pattern_json.h"
#include "simulation/cloth/weld_seams.h"
#include "simulation/contact/contact_distance.h"
#include "simulation/contact/resting_gap.h"
#include "simulation/material/fabric.h"
#include "simulation/relax_gravity.h"
#include "simulation/solver.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWornCloth = "garment.obj";
constexpr const char* kWornBody = "body.obj";
constexpr const char* kWornNote = "captured.json";

/// Where the vertices of the cut mesh were captured: at the same place of the surface, whose
/// smoothed, thinned and slightly moved copy the mesh is.
Points captured_places(const Mesh& mesh, const Mesh& surface, const Mesh& captured) {
  if (!equal_arrays(surface.faces, captured.faces)) {
    throw DataError("", "captured garment", "other triangles than the flattened surface's",
                    "the same garment in another pose");
  }
  Points places(mesh.vertices.rows(), 3);
  const TriangleTree tree = build_tree(surface.vertices, surface.faces);
  const std::vector<ClosestPoint> nearest = closest_points(tree, mesh.vertices);
  for (Index v = 0; v < places.rows(); ++v) {
    const ClosestPoint& at = nearest[static_cast<std::size_t>(v)];
    places.row(v).setZero();
    for (int k = 0; k < 3; ++k) {
      places.row(v) += at.barycentric[k] * captured.vertices.row(captured.faces(at.face, k));
    }
  }
  return places;
}

/// Refuses what no thread closes: edges that are sewn to others than they lay at. By the mean of a
/// seam: beside a slit of its panel a single vertex may be taken from the other side of it.
void require_near_seams(const Garment& panels) {
  constexpr double kApart = 0.05;  // m
  for (const Seam& seam : panels.seams) {
    double apart = 0;
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      const Eigen::RowVector3d gap =
          panels.mesh.vertices.row(seam.a[i]) - panels.mesh.vertices.row(seam.b[i]);
      apart += gap.norm() / static_cast<double>(seam.a.size());
    }
    if (apart > kApart) {
      throw DataError("", seam.name,
                      "sides that lay " +
                          std::to_string(saturating_cast<int>(std::round(1000 * apart))) +
                          " mm apart on the captured garment",
                      "5 cm at most, in the mean");
    }
  }
}

/// The vertices after some time on a body that stands still; none where it was stopped.
std::optional<Points> draped(const Garment& sewn, const WornGarment& worn,
                             const SewCheckOptions& options, const std::function<bool()>& stopped) {
  constexpr double kDamping = 4;     // 1/s, as a garment is relaxed
  constexpr double kMostGap = 0.02;  // m
  SolverOptions how = relaxing_solver();
  how.velocity_damping = kDamping;
  how.report = false;
  how.thickness = std::clamp(resting_gap(worn.cloth.vertices, worn.body.vertices, worn.body.faces,
                                         contact_distance(options.edge_length)),
                             sewn.material.thickness, kMostGap);
  const SimulationModel model{make_cloth(sewn, held_waist(sewn.mesh, worn.body)), worn.body.faces};
  const std::unique_ptr<Solver> solver = create_solver(model, how);
  ClothState state = rest_state(model.cloth);
  state.positions = sewn.mesh.vertices;
  solver->set_state(state);
  Control control;
  control.body_start = control.body_end = worn.body.vertices;
  control.pin_targets = sewn.mesh.vertices;
  const auto frames = saturating_cast<int>(std::round(options.seconds / how.time_step));
  for (int frame = 0; frame < std::max(1, frames); ++frame) {
    if (stopped()) {
      return std::nullopt;
    }
    solver->step(control);
  }
  return solver->state().positions;
}

/// The rotation that brings points nearest to others, by least squares (Umeyama 1991).
Eigen::Matrix3d turn_between(const Points& from, const Points& to) {
  return Eigen::umeyama(Eigen::Matrix3Xd(from.transpose()), Eigen::Matrix3Xd(to.transpose()), false)
      .topLeftCorner<3, 3>();
}

/// Distance of each vertex from a surface, m.
Eigen::VectorXd distances_from(const Mesh& surface, const Points& points) {
  const std::vector<ClosestPoint> nearest =
      closest_points(build_tree(surface.vertices, surface.faces), points);
  Eigen::VectorXd off(points.rows());
  for (Index v = 0; v < off.size(); ++v) {
    off[v] = std::sqrt(nearest[static_cast<std::size_t>(v)].squared_distance);
  }
  return off;
}

/// Fills in mean and p95 of the distances both ways, by the area that a vertex stands for.
void measure_distance(SewnPattern& sewn) {
  sewn.off = distances_from(sewn.captured, sewn.mesh.vertices);
  const Eigen::VectorXd back = distances_from(sewn.mesh, sewn.captured.vertices);
  const Eigen::VectorXd areas = vertex_areas(sewn.mesh.vertices, sewn.mesh.faces);
  const Eigen::VectorXd back_areas = vertex_areas(sewn.captured.vertices, sewn.captured.faces);
  std::vector<std::pair<double, double>> all;  // distance, share
  for (Index v = 0; v < areas.size(); ++v) {
    all.emplace_back(sewn.off[v], areas[v] / (2 * areas.sum()));
  }
  for (Index v = 0; v < back_areas.size(); ++v) {
    all.emplace_back(back[v], back_areas[v] / (2 * back_areas.sum()));
  }
  std::sort(all.begin(), all.end());
  double share = 0;
  for (const auto& [off, of_all] : all) {
    sewn.mean += of_all * off;
    if (share < 0.95) {
      sewn.p95 = off;
    }
    share += of_all;
  }
}

}  // namespace

OptionTable describe(SewCheckOptions& options) {
  OptionTable table;
  table.add("body", options.body, std::vector<std::string>{},
            "Body on which the written pattern is sewn anew, draped and held against the captured "
            "garment: a mesh in the unit of the garment, the bodies of its capture "
            "(WORKSPACE/body/current), or none; empty: that of WORKSPACE/surfaces, if flattened");
  std::vector<std::string> fabrics = fabric_names();
  fabrics.insert(fabrics.begin(), "");
  table.add("fabric", options.fabric, fabrics, "Fabric of the garment sewn anew");
  table.add("edge_length", options.edge_length, 0.005, 0.1, "m",
            "Edge length of its triangles; shorter for finer folds, which takes longer");
  table.add("seconds", options.seconds, 0.05, 60, "s", "Simulated time in which it comes to rest");
  return table;
}

fs::path worn_folder(const fs::path& folder, const fs::path& mesh) {
  const fs::path worn = folder / kCapturedFolder / mesh.stem();
  return fs::is_directory(worn) ? worn : fs::path();
}

void write_worn(const fs::path& folder, const WornGarment& worn, int frame_id) {
  fs::create_directories(folder);
  write_mesh(folder / kWornCloth, worn.cloth);
  write_mesh(folder / kWornBody, worn.body);
  nlohmann::ordered_json note{{"frame", frame_id}};
  if (worn.acceleration >= 0) {
    note["acceleration"] = worn.acceleration;
  }
  write_file_atomically(folder / kWornNote, note.dump(1) + "\n");
}

WornGarment read_worn(const fs::path& folder) {
  WornGarment worn{read_mesh(folder / kWornCloth), read_mesh(folder / kWornBody)};
  const nlohmann::json note = read_json(folder / kWornNote);
  if (note.is_object() && note.contains("acceleration") && note["acceleration"].is_number()) {
    worn.acceleration = note["acceleration"].get<double>();
  }
  return worn;
}

std::optional<SewnPattern> sew_anew(const WrittenPattern& written, const WornGarment& worn,
                                    const SewCheckOptions& options,
                                    const std::function<bool()>& stopped) {
  const SewingPattern pattern = garment_pattern_from_json(written.text, "pattern.json");
  Garment panels = panels_on_surface(pattern, written.names, written.flat,
                                     captured_places(written.mesh, written.surface, worn.cloth),
                                     {.edge_length = options.edge_length});
  if (!options.fabric.empty()) {
    panels.material = fabric_material(options.fabric);
  }
  require_near_seams(panels);
  const Garment sewn = weld_seams(panels);
  const std::optional<Points> hung = draped(sewn, worn, options, stopped);
  if (!hung) {
    return std::nullopt;
  }
  SewnPattern result;
  result.mesh = sewn.mesh;
  result.mesh.vertices = *hung;
  result.captured = worn.cloth;
  result.body = worn.body;
  result.turn = turn_between(written.surface.vertices, worn.cloth.vertices);
  result.acceleration = worn.acceleration;
  measure_distance(result);
  return result;
}

}  // namespace atelier
