#include "pipeline/animation/animation_garments.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <map>

#include "bodymodel/kinematics.h"
#include "core/error.h"
#include "core/io/mesh_sequence_file.h"
#include "pipeline/outfit/dressing.h"
#include "registration/attach_to_body.h"
#include "simulation/files/material_file.h"
#include "simulation/material/hanging_acceleration.h"

namespace atelier {
namespace {

/// m: what does not hang still so near to where it was captured was not at rest there.
constexpr double kHangsThere = 0.01;

/// The materials that the stage `material` found, if it ran.
std::map<std::string, Material> fitted_materials(StageRun& run) {
  if (run.has_input("fitted_material")) {
    std::map<std::string, Material> materials;
    for (const auto& [name, found] : read_materials(run.input("fitted_material"))) {
      materials[name] = found.material;
    }
    return materials;
  }
  if (run.options<AnimateOptions>().material.name == "fitted") {
    run.warn(
        "no material was fitted to this cloth (atelier material fits one): the values of "
        "'custom' are taken; --material.name names a fabric");
  }
  return {};
}

Material material_for(const AnimateOptions& options, const std::map<std::string, Material>& fitted,
                      const std::string& garment) {
  const auto found = fitted.find(garment);
  return resolve_material(options.material, found == fitted.end() ? Material{} : found->second);
}

/// The frame in which clothes are put on before a motion that is not theirs: the template's own,
/// of the garment with most vertices.
int dressing_frame(const AnimationSource& source) {
  const std::vector<int> frames = common_frames(source.outfit);
  const auto largest = std::max_element(
      source.outfit.begin(), source.outfit.end(), [](const auto& a, const auto& b) {
        return a.garment.mesh.vertices.rows() < b.garment.mesh.vertices.rows();
      });
  const int wanted = largest->template_frame;
  if (std::binary_search(frames.begin(), frames.end(), wanted) && source.row(wanted) >= 0) {
    return wanted;
  }
  for (const int frame : frames) {
    if (source.row(frame) >= 0 && source.surface(frame)) {
      return frame;
    }
  }
  throw DataError("", "garments", "no frame in which all are registered and the body is tracked",
                  "registered garments of this capture; run 'atelier register' again");
}

/// The weight is taken out of a garment, where it hung still in its template's frame.
void relax(StageRun& run, const RegisteredGarmentSequence& garment, const Points& body,
           const Triangles& faces, WornGarment& worn) {
  const auto& options = run.options<AnimateOptions>();
  char text[240];
  const std::optional<double> motion =
      hanging_acceleration(garment.registered, garment.template_frame, body, faces);
  if (motion && *motion > kInMotion) {
    std::snprintf(text, sizeof text,
                  "%s: the cloth was in motion in its template's frame (its freely hanging parts "
                  "accelerate by %.1f m/s2), so the registered shape is taken for the shape at "
                  "rest, as with --cloth.relax false",
                  garment.name.c_str(), *motion);
    run.warn(text);
    return;
  }
  RelaxedGarment relaxed = unloaded(worn, body, faces, options.cloth, run.device());
  std::snprintf(text, sizeof text,
                "%s: simulated from its unloaded shape it hangs %.2f mm from the registered shape",
                garment.name.c_str(), 1e3 * relaxed.mean_error);
  if (relaxed.mean_error < kHangsThere) {
    run.say(text);
    worn.garment.mesh = std::move(relaxed.garment.mesh);
  } else {
    run.warn(std::string(text) +
             ", too far: it was in motion in its template's frame; the registered shape is taken "
             "for the shape at rest, as with --cloth.relax false");
  }
}

/// Garments carried over to another body in the same pose, riding on its triangles.
void carry(std::vector<WornGarment>& garments, const Points& from, const Points& to,
           const Triangles& faces) {
  for (WornGarment& worn : garments) {
    worn.start = body_driven(attach_to_body(worn.start, from, faces), to, faces);
    worn.velocity.resize(0, 3);
  }
}

}  // namespace

Points offset_in(const AnimationSource& source, const MovingBody& body, int frame_id) {
  const std::optional<Points> surface = source.surface(frame_id);
  const Index row = source.row(frame_id);
  if (!surface || row < 0) {
    return Points(0, 3);
  }
  return *surface - skin_vertices(body.model, body.shaped,
                                  source.tracked.motion.poses[static_cast<std::size_t>(row)]);
}

void wear_registered(StageRun& run, const AnimationSource& source, const OwnPose& own_pose,
                     Animation& animation) {
  const auto& options = run.options<AnimateOptions>();
  const bool own = options.motion.empty();
  const bool on_person = options.body.empty();
  const std::map<std::string, Material> fitted = fitted_materials(run);
  MovingBody& body = animation.body;
  const Triangles& faces = body.model.mesh.faces;
  const int first = body.motion.frame_ids.front();
  const std::vector<int> frames = common_frames(source.outfit);
  const bool begins_moving = own && on_person && !body.offsets.empty() &&
                             std::binary_search(frames.begin(), frames.end(), first);
  const int frame_id = begins_moving ? first : dressing_frame(source);
  const std::optional<Points> surface = source.surface(frame_id);
  if (!surface) {
    throw DataError(run.input("bodies").string(), "frames",
                    "no body in frame " + std::to_string(frame_id),
                    "one in every registered frame; run 'atelier body' again");
  }
  std::vector<WornGarment> garments;
  Points dressed = *surface;
  for (const RegisteredGarmentSequence& garment : source.outfit) {
    garments.push_back(worn_in_frame(garment, frame_id, *surface, faces,
                                     material_for(options, fitted, garment.name)));
    if (begins_moving) {
      garments.back().velocity = registered_velocity(garment, body);
    }
    if (options.cloth.relax) {
      const std::optional<Points> there = source.surface(garment.template_frame);
      relax(run, garment, there ? *there : *surface, faces, garments.back());
    }
  }
  if (!begins_moving) {
    const Index row = source.row(frame_id);
    Pose pose = source.tracked.motion.poses[static_cast<std::size_t>(row)];
    Points offset = offset_in(source, body, frame_id);
    if (!on_person) {
      pose = own_pose(row);
      offset.resize(0, 3);
      dressed = skin_vertices(body.model, body.shaped, pose);
      carry(garments, *surface, dressed, faces);
    }
    if (!own) {
      body.motion = entered_from(body.model, std::move(body.motion), pose);
    }
    lead_in(body, pose, std::move(offset), options.settle);
  }
  animation.worn = worn_cloth(garments, options.cloth);
  for (std::size_t g = 0; g < garments.size(); ++g) {
    for (RingPlace& place : ring_places(garments[g].holding, animation.worn.first[g],
                                        garments[g].start, dressed, faces)) {
      animation.places.push_back(std::move(place));
    }
  }
  if (begins_moving) {
    animation.registered = source.outfit;
  }
}

void wear_pattern(StageRun& run, Animation& animation) {
  const auto& options = run.options<AnimateOptions>();
  const bool own = options.motion.empty();
  MovingBody& body = animation.body;
  const Material material = resolve_material(options.material);
  OutfitOptions how;
  how.garment = options.garment;
  how.density = material.density;
  how.stretch = material.stretch_warp;
  how.bending = material.bending;
  how.friction = material.friction;
  how.thickness = options.cloth.contact;
  how.rate = options.cloth.rate;
  how.substeps = options.cloth.solver.substeps;
  outfit_garments(options.garment);  // refuses unknown names before any work
  run.say("sewing and draping " + options.garment);
  Outfit outfit = dress_body(body.model, how, options.body, run.device());
  WornCloth& worn = animation.worn;
  for (const GroundTruthGarment& garment : outfit.garments) {
    worn.names.push_back(garment.garment.name);
    Mesh mesh = garment.garment.mesh;
    mesh.normals.resize(0, 3);
    worn.meshes.push_back(std::move(mesh));
  }
  worn.first = outfit.first;
  worn.cloth = std::move(outfit.cloth);
  worn.state = std::move(outfit.state);
  worn.solver = options.cloth.solver;
  worn.solver.thickness = outfit.solver.thickness;
  const Pose rest = rest_pose(body.model.skeleton);
  Pose standing = rest;
  if (own) {
    // The motion stays where the cameras saw it: who is dressed is turned to it.
    Motion still;
    still.fps = 1;
    still.frame_ids = {0};
    still.poses = {rest};
    standing = entered_from(body.model, still, body.motion.poses.front()).poses.front();
    const JointFrames from = forward_kinematics(body.shaped.skeleton, rest);
    const JointFrames to = forward_kinematics(body.shaped.skeleton, standing);
    const Eigen::Matrix3d turn = to.rotations[0] * from.rotations[0].transpose();
    const Eigen::RowVector3d shift = to.positions.row(0) - from.positions.row(0) * turn.transpose();
    worn.state.positions = (worn.state.positions * turn.transpose()).rowwise() + shift;
    worn.state.velocities = worn.state.velocities * turn.transpose();
  } else {
    body.motion = entered_from(body.model, std::move(body.motion), rest);
  }
  lead_in(body, standing, Points(0, 3), 0);
}

void wear_foreign(const AnimateOptions& options, const AnimationSource& source,
                  Animation& animation) {
  const MeshSequenceFile file = read_mesh_sequence(options.cloth_sequence, SequenceOf::Cloth);
  WornCloth& worn = animation.worn;
  worn.first.push_back(0);
  Index faces = 0;
  std::string names;
  for (const RegisteredGarmentSequence& garment : source.outfit) {
    Mesh mesh = garment.garment.mesh;
    mesh.normals.resize(0, 3);
    names += (names.empty() ? "" : ", then ") + garment.name;
    worn.names.push_back(garment.name);
    worn.first.push_back(worn.first.back() + mesh.vertices.rows());
    faces += mesh.faces.rows();
    worn.meshes.push_back(std::move(mesh));
  }
  Triangles joined(faces, 3);
  Index row = 0;
  for (std::size_t g = 0; g < worn.meshes.size(); ++g) {
    const Triangles& own = worn.meshes[g].faces;
    joined.middleRows(row, own.rows()) = own.array() + static_cast<int>(worn.first[g]);
    row += own.rows();
  }
  if (!source.outfit.empty() && !equal_arrays(joined, file.shared.faces)) {
    const bool alone = worn.names.size() == 1;
    throw DataError(
        options.cloth_sequence, "faces",
        std::to_string(file.shared.faces.rows()) + " of another topology",
        "the " + std::to_string(joined.rows()) + " faces of " + names +
            (alone ? ", as 'atelier export --stage register' writes them to registered/" +
                         worn.names[0] + " (--format ply or obj) or registered/" + worn.names[0] +
                         ".h5 (--format h5); glTF splits vertices at seams"
                   : ", one behind the other in one mesh") +
            "; or --garment none");
  }
  if (source.outfit.empty()) {
    worn.names = {"cloth"};
    worn.meshes = {file.shared};
    worn.meshes[0].labels.clear();
    worn.meshes[0].vertices = frame(file.sequence, 0).vertices;
    worn.first = {0, worn.meshes[0].vertices.rows()};
  }
  animation.foreign = file.sequence;
}

}  // namespace atelier
