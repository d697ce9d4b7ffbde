#include "pipeline/cloth/scene_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <initializer_list>
#include <set>

#include "core/depths_inside.h"
#include "core/error.h"
#include "core/io/lower_extension.h"
#include "core/normals.h"
#include "core/topology.h"
#include "core/usage_error.h"
#include "core/welded_faces.h"
#include "simulation/cloth/attached_position.h"
#include "simulation/files/material_file.h"

namespace atelier {
namespace {

using Extent = Eigen::AlignedBox3d;

Extent extent_of(const Points& points) {
  Extent box;
  for (Index i = 0; i < points.rows(); ++i) {
    box.extend(Eigen::Vector3d(points.row(i).transpose()));
  }
  return box;
}

/// Volume that a closed surface encloses [m3], negative where its faces look inwards; 0 for an open
/// one.
double enclosed_volume(const Points& vertices, const Triangles& faces) {
  if (!boundary_loops(topology_of(welded_faces(vertices, faces), vertices.rows())).empty()) {
    return 0;
  }
  double sum = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = vertices.row(faces(f, 0));
    const Eigen::Vector3d b = vertices.row(faces(f, 1));
    const Eigen::Vector3d c = vertices.row(faces(f, 2));
    sum += a.dot(b.cross(c)) / 6;
  }
  return sum;
}

/// How far the body holds a vertex from where it begins [m], at most.
double farthest_pull(const SimulationScene& scene, const Points& body) {
  double farthest = 0;
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    for (const Attachment& one : scene.garments[g].attachments) {
      const Eigen::Vector3d held = attached_position(one, body, scene.body_faces);
      const Eigen::Vector3d begins = scene.start.row(scene.first[g] + one.vertex).transpose();
      farthest = std::max(farthest, (held - begins).norm());
    }
  }
  return farthest;
}

Index deeper_than(double reach, const Points& points, const Points& body, const Triangles& faces) {
  return (depths_inside(points, body, faces).array() > reach).count();
}

}  // namespace

void require_surface(const Points& body, const Triangles& faces,
                     const std::filesystem::path& file) {
  if (faces.rows() == 0) {
    throw DataError(file.string(), "faces", "none", "a body with a surface");
  }
  if (!(face_areas(body, faces).sum() > 0)) {
    throw DataError(file.string(), "faces", "no area", "a body with a surface");
  }
}

std::vector<std::string> scene_diagnostics(const SimulationScene& scene, double contact_reach) {
  std::vector<std::string> diagnostics;
  const Points& garment = scene.start;
  const Extent cloth = extent_of(garment);
  const auto metres = [](double length) { return number_text(length) + " m"; };
  if (!scene.body || scene.body_faces.rows() == 0) {
    const double size = cloth.diagonal().norm();
    if (size < 0.02 || size > 20) {
      diagnostics.push_back(
          "warning: the garment is " + metres(size) +
          " across; is the unit another? --scale is the length of its file's unit in metres");
    }
    return diagnostics;
  }
  const Points body = scene.body(0);
  const Extent about = extent_of(body);
  if (about.sizes().maxCoeff() < 0.05 || about.sizes().y() > 5) {
    diagnostics.push_back(
        "warning: the body is " + metres(about.sizes().y()) + " high and " +
        metres(about.diagonal().norm()) +
        " across; another unit than metres? Bodies are taken as they are: scale its "
        "file");
  }
  const double ratio = cloth.diagonal().norm() / about.diagonal().norm();
  if (ratio > 3 || ratio < 0.02) {
    diagnostics.push_back(
        "warning: the garment is " + metres(cloth.diagonal().norm()) + " across and the body " +
        metres(about.diagonal().norm()) +
        "; is the unit another? --scale is the length of the garment file's unit in metres");
  }
  if (cloth.min().x() > about.max().x() || cloth.max().x() < about.min().x() ||
      cloth.min().z() > about.max().z() || cloth.max().z() < about.min().z() ||
      cloth.max().y() < about.min().y() ||
      cloth.min().y() > about.max().y() + std::max(1.0, about.sizes().y())) {
    diagnostics.emplace_back(
        "warning: the garment lies beside, below or far above the body; --move-x, --move-y and "
        "--move-z translate it");
  }
  if (enclosed_volume(body, scene.body_faces) < 0) {
    diagnostics.emplace_back(
        "warning: the body's faces are oriented inwards, so its inside is taken for its outside; "
        "reverse their orientation");
  }
  if (const double pull = farthest_pull(scene, body); pull > 0.05) {
    diagnostics.push_back(
        "warning: the body holds vertices of the garment " + metres(pull) +
        " from where they begin: they were attached to another body, or --scale or "
        "--move has taken them away");
  }
  if (const Index deep = deeper_than(contact_reach, garment, body, scene.body_faces); deep > 0) {
    diagnostics.push_back(
        "warning: " + std::to_string(deep) + " of " + std::to_string(garment.rows()) +
        " vertices start deeper inside the body than " + solver_flag("contact_reach") + " (" +
        number_text(1e3 * contact_reach) +
        " mm), so contact may not bring them out: a larger one (0.1), --scale, or "
        "--move-x, --move-y and --move-z");
  }
  return diagnostics;
}

void require_solver(const SolverOptions& options, Device device) {
  const std::string conflict = solver_conflict(options, device);
  if (!conflict.empty()) {
    throw UsageError("--" + options.name + ": " + conflict);
  }
}

namespace {

/// Of one surface that does not move by itself.
bool is_one_mesh(const std::filesystem::path& body) {
  return body == "female" || body == "male" ||
         (std::filesystem::is_regular_file(body) && lower_extension(body) != ".h5");
}

struct UnusedRule {
  bool broken;
  std::string words;
};

void require_none(std::initializer_list<UnusedRule> rules) {
  for (const UnusedRule& rule : rules) {
    if (rule.broken) {
      throw UsageError(rule.words);
    }
  }
}

}  // namespace

void require_scene_options(const ScenePaths& paths, const SimulateOptions& options, Device device) {
  require_solver(options.solver, device);
  const SolverOptions usual;
  const bool of_body = options.solver.friction >= 0 || options.solver.thickness >= 0 ||
                       options.solver.contact_reach != usual.contact_reach ||
                       options.solver.body_edges;
  const bool wind = !options.wind.empty();
  require_none({
      {wind && options.wind.size() != 3, "--wind takes three numbers: --wind '[0, 0, 5]'"},
      {wind && !(options.solver.drag > 0) && !(options.solver.lift > 0),
       "--wind does nothing to cloth without drag or lift: --drag 1"},
      {!paths.motion.empty() && paths.body.empty(),
       "--motion takes a --body that can be posed: a body model, female or male"},
      {options.pin_top > 0 && paths.body.empty(),
       "--pin-top lets the garment ride on a body: give --body"},
      {!options.holding.empty() && options.holding != "none" && paths.body.empty(),
       "--holding holds the garment on a body: give --body"},
      {options.relax && paths.body.empty(),
       "--relax lets the garment hang as captured, and without a body it hangs on nothing: give "
       "--body"},
      {options.relax && paths.garments.size() > 1,
       "--relax takes one garment: the loads between several are not known"},
      {options.relax && options.flat_rest,
       "--flat-rest does nothing with --relax, which finds a rest shape of its own: leave one out"},
      {options.relax && options.cloth.membrane == "strain",
       "--membrane strain needs a flat rest shape, and --relax finds one in space: leave one out"},
      {options.length == 0 && options.settle == 0 && paths.motion.empty() &&
           (paths.body.empty() || is_one_mesh(paths.body)),
       "there are no frames to simulate: give --settle or --length"},
      {of_body && paths.body.empty(),
       "--friction, --thickness, --contact-reach and " + solver_flag("body_edges") +
           " are of contact with a body; give --body, or leave them out"},
      {options.body_fps > 0 && (!paths.motion.empty() || is_one_mesh(paths.body)),
       "--body-fps is of meshes that move by themselves; this body does not: leave it out"},
      {options.body_fps > 0 && paths.body.empty(), "--body-fps does nothing without --body"},
      {options.fall_in != SimulateOptions{}.fall_in && paths.motion.empty(),
       "--fall-in leads into a motion; give --motion, or leave it out"},
  });
  if (const std::string idle = option_without_effect(options.solver, device); !idle.empty()) {
    throw UsageError(
        solver_flag(idle, "", options.solver) + " does nothing on " +
        (device == Device::Cpu ? "the CPU; use --device cuda" : "a GPU; use --device cpu") +
        ", or leave it out");
  }
}

void require_garment_options(const Garment& garment, const SimulateOptions& options) {
  const bool flat = garment.rest_faces.rows() > 0 && !options.relax;
  const bool said =
      options.material.stretch_warp != kFabricsOwn || options.material.stretch_weft != kFabricsOwn;
  require_none({
      {said && !flat && garment.material.stretch_warp != garment.material.stretch_weft,
       "--material.stretch-warp and --material.stretch-weft cannot differ without a flat rest "
       "shape, which tells them apart: make them equal, or give garment.h5 of drape or "
       "--flat-rest, and no --relax"},
      {!options.sewn && garment.seams.empty(),
       "--sewn false does nothing: the garment has no seams; leave it out"},
  });
}

void require_held(const Garment& garment, const Triangles& body_faces,
                  const std::filesystem::path& file) {
  std::set<int> held;
  for (const Attachment& one : garment.attachments) {
    held.insert(one.vertex);
    if (one.triangle >= body_faces.rows()) {
      throw DataError(file.string(), "attachments",
                      "vertex " + std::to_string(one.vertex) + " on triangle " +
                          std::to_string(one.triangle) + " of a body, and this one has " +
                          std::to_string(body_faces.rows()),
                      "the body that it was put on; or the garment as a mesh, which nothing holds");
    }
  }
  if (static_cast<Index>(held.size()) >= garment.mesh.vertices.rows()) {
    throw UsageError(
        "every vertex of the garment is attached to the body, so nothing moves: lower --pin-top");
  }
}

}  // namespace atelier
