#include "pipeline/pattern/flatten_relax.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/io/mesh_file.h"
#include "core/normals.h"
#include "core/sequence_archive.h"
#include "core/topology.h"
#include "pipeline/cloth/simulation_scene.h"
#include "registration/flattening/flatten_diagnostics.h"
#include "registration/flattening/flatten_surface.h"
#include "simulation/material/fabric.h"
#include "simulation/material/hanging_acceleration.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// The registered sequence of a garment: the folder itself, or the one in it of the garment's name.
fs::path registered_of(const std::string& folder, const fs::path& mesh) {
  return fs::exists(fs::path(folder) / "sequence.h5") ? fs::path(folder)
                                                      : fs::path(folder) / mesh.stem();
}

/// The row of a registered sequence that a mesh is nearest to. Throws DataError for a sequence of
/// another mesh.
Index nearest_row(const Sequence& sequence, const Mesh& mesh, const fs::path& folder) {
  if (!equal_arrays(sequence.faces, mesh.faces)) {
    throw DataError(folder.string(), "faces", "another topology than the mesh's",
                    "the sequence that the mesh is the template of");
  }
  Index nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (Index row = 0; row < frame_count(sequence); ++row) {
    const double off = (frame(sequence, row).vertices - mesh.vertices).rowwise().norm().mean();
    if (off < least) {
      least = off;
      nearest = row;
    }
  }
  return nearest;
}

/// The warning "in-motion" where a frame of a registered sequence shows that its motion held it up.
std::optional<Finding> motion_finding(const Sequence& sequence, int frame_id, const Mesh& body,
                                      const fs::path& registered) {
  const std::optional<double> motion =
      hanging_acceleration(sequence, frame_id, body.vertices, body.faces);
  if (!motion || *motion <= kInMotion) {
    return std::nullopt;
  }
  char text[160];
  std::snprintf(text, sizeof text,
                "the cloth was in motion in frame %d (its freely hanging parts accelerate by %.1f "
                "m/s2), so its shape at rest cannot be found from it",
                frame_id, *motion);
  return Finding{
      Severity::Warning, "in-motion", registered.string(), text,
      "it is flattened as it was captured; a template of a frame at rest: atelier template "
      "--frame N"};
}

/// The row of a frame among bodies. Throws DataError where there is none.
Index row_of(const Sequence& bodies, int frame_id, const std::string& place) {
  const std::vector<int>& ids = bodies.frame_ids;
  const auto at = std::find(ids.begin(), ids.end(), frame_id);
  if (at == ids.end()) {
    throw DataError(place, "frames", "no body of frame " + std::to_string(frame_id),
                    "the bodies of the capture that the garment is of: WORKSPACE/body/current");
  }
  return at - ids.begin();
}

}  // namespace

std::vector<int> held_waist(const Mesh& mesh, const Mesh& body) {
  std::vector<int> waist;
  double height = 0;
  for (std::vector<int>& loop : boundary_loops(topology_of(mesh.faces, mesh.vertices.rows()))) {
    const double y = mesh.vertices(loop, 1).mean();
    if (waist.empty() || y > height) {
      height = y;
      waist = std::move(loop);
    }
  }
  // Above a waist is half of the skin, above a neck a tenth, with raised arms a quarter.
  constexpr double kShareAboveWaist = 0.35;
  const Eigen::VectorXd areas = face_areas(body.vertices, body.faces);
  double above = 0;
  for (Index f = 0; f < body.faces.rows(); ++f) {
    above += body.vertices(body.faces(f, 0), 1) > height ? areas[f] : 0;
  }
  if (above < kShareAboveWaist * areas.sum()) {
    waist.clear();
  }
  return waist;
}

Mesh body_of(const std::string& place, const MeshConvention& convention,
             const std::optional<int>& frame_id) {
  if (!fs::is_directory(place)) {
    return read_mesh(place, convention);
  }
  const Sequence bodies = open_sequence(place);
  return frame(bodies, row_of(bodies, frame_id.value_or(-1), place));
}

void require_relaxable(const FlattenStageOptions& options,
                       const std::vector<FlattenGarment>& garments) {
  const FlattenRelaxOptions& relax = options.relax;
  if (relax.body.empty()) {
    return;
  }
  std::optional<Sequence> bodies;
  if (fs::is_directory(relax.body)) {
    bodies = open_sequence(relax.body);  // says what it would have read
  }
  const bool one =
      !relax.registered.empty() && fs::exists(fs::path(relax.registered) / "sequence.h5");
  if (one && garments.size() > 1) {
    throw DataError(relax.registered, "",
                    "one garment's sequence, of " + std::to_string(garments.size()) +
                        " garments that are flattened",
                    "the folder of all of them: WORKSPACE/register/current/registered");
  }
  std::optional<int> first;
  for (const FlattenGarment& garment : garments) {
    if (is_rest(garment)) {
      throw DataError(garment.file.string(), "", "a rest surface, which is in no captured pose",
                      "the template as it was captured: WORKSPACE/template/current");
    }
    if (!relax.registered.empty()) {
      open_sequence(registered_of(relax.registered, garment.file));
    }
    const std::optional<int>& frame = garment.note.frame;
    if (bodies && !frame && relax.registered.empty()) {
      throw DataError(
          relax.body, "",
          "bodies in motion, but the frame of " + garment.file.filename().string() +
              " is not known",
          "WORKSPACE/template/current, which states the frame, --relax.registered, or a mesh of "
          "the body in that frame");
    }
    if (bodies && frame) {
      row_of(*bodies, *frame, relax.body);
    }
    if (!bodies && frame && first && *frame != *first) {
      throw DataError(relax.body, "",
                      "one body, of garments in frames " + std::to_string(*first) + " and " +
                          std::to_string(*frame),
                      "the bodies of all frames: WORKSPACE/body/current");
    }
    first = first ? first : frame;
  }
}

bool relax_mesh(Mesh& mesh, const FlattenGarment& of, const FlattenStageOptions& all,
                const FlattenWatcher& watcher) {
  constexpr double kAsCaptured = 2e-3;  // m, mean
  const FlattenRelaxOptions& options = all.relax;
  Garment garment;
  garment.name = options.body;
  garment.mesh = mesh;
  if (!options.fabric.empty()) {
    garment.material = fabric_material(options.fabric);
  }
  std::optional<int> frame_id = of.note.frame;
  std::optional<Sequence> registered;
  const fs::path sequence = registered_of(options.registered, of.file);
  if (!options.registered.empty()) {
    registered = open_sequence(sequence);
    const Index row = nearest_row(*registered, mesh, sequence);
    frame_id = frame_id.value_or(registered->frame_ids[static_cast<std::size_t>(row)]);
  }
  const Mesh body = body_of(options.body, all.input, frame_id);
  if (const auto doubt = open_body_finding(body, options.body)) {
    watcher.warn(*doubt);
  }
  if (registered) {
    if (const auto doubt = motion_finding(*registered, *frame_id, body, sequence)) {
      watcher.warn(*doubt);
      return false;
    }
  }
  SolverOptions solver = relaxing_solver();
  solver.substeps = options.substeps;
  solver.thickness = options.gap > 0 ? options.gap : -1;
  const RelaxedGarment relaxed =
      relax_gravity({garment, held_waist(mesh, body), body.vertices, body.faces}, {}, solver,
                    options.relaxing, Device::Cpu, [&](int round, double error) {
                      watcher.relaxed(round, options.relaxing.rounds, error);
                      return !watcher.stopped();
                    });
  watcher.say(relaxed_text(relaxed, options.relaxing.seconds));
  if (relaxed.mean_error > kAsCaptured) {
    watcher.warn(
        {Severity::Warning, "not-relaxed", options.body,
         "no garment was found that hangs within 2 mm of the captured one",
         "it is flattened as it was captured; try more --relax.relaxing.rounds, or another "
         "body or fabric"});
    return false;
  }
  mesh.vertices = relaxed.garment.mesh.vertices;
  return true;
}

}  // namespace atelier
