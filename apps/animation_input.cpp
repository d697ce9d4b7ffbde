#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_REGISTRATION) && \
    defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_BODYMODEL) && \
    defined(ATELIER_HAS_CORE_RENDER)

#include "apps/animation_input.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "apps/dressing.h"
#include "apps/material_stage.h"
#include "apps/mesh_sequence_file.h"
#include "apps/synthetic_motion.h"
#include "bodymodel/body_file.h"
#include "bodymodel/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/motion_file.h"
#include "bodymodel/personal_body.h"
#include "bodymodel/retarget.h"
#include "bodymodel/tracked_motion.h"
#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/sequence_archive.h"
#include "registration/attach_to_body.h"
#include "simulation/fabric.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr double kMostRate = 30;       // frames a second of a motion that is not the capture's
constexpr double kSampleRate = 60;     // of procedural motions
constexpr double kProceduralTime = 2;  // s, of a procedural motion

/// The workspace as the stage reads it, before any garment is placed.
struct Source {
  PersonalBody person;
  TrackedMotion tracked;
  std::optional<Sequence> bodies;  // surfaces of the frames, by `body`
  std::vector<RegisteredGarmentSequence> outfit;

  std::optional<Points> surface(int frame_id) const {
    if (!bodies) {
      return std::nullopt;
    }
    const std::vector<int>& ids = bodies->frame_ids;
    const auto at = std::lower_bound(ids.begin(), ids.end(), frame_id);
    if (at == ids.end() || *at != frame_id) {
      return std::nullopt;
    }
    return frame(*bodies, at - ids.begin()).vertices;
  }
  /// Row of a frame in the tracked motion, or -1.
  Index row(int frame_id) const {
    const std::vector<int>& ids = tracked.motion.frame_ids;
    const auto at = std::lower_bound(ids.begin(), ids.end(), frame_id);
    return at == ids.end() || *at != frame_id ? -1 : at - ids.begin();
  }
};

Source read_source(StageRun& run, const AnimateOptions& options) {
  Source source;
  source.person = read_personal_body(run.input("person") / "person.npz");
  const fs::path take = tracked_take(run.input("tracked"), run.input("capture"), options.sequence);
  source.tracked = read_tracked_motion(take);
  if (joint_count(source.person.model) !=
      static_cast<Index>(source.tracked.skeleton.parents.size())) {
    throw DataError(take.string(), "skeleton", "another one than the person's",
                    "the person's own; run 'atelier track' again");
  }
  if (source.tracked.motion.poses.empty()) {
    throw DataError(take.string(), "frames", "none", "at least one tracked frame");
  }
  if (run.has_input("bodies")) {
    source.bodies = open_sequence(run.input("bodies"));
    if (!equal_arrays(source.bodies->faces, source.person.model.mesh.faces)) {
      throw DataError(run.input("bodies").string(), "faces", "another body than the person's",
                      "bodies of this person; run 'atelier body' again");
    }
  }
  if (options.garment == "auto") {
    if (!run.has_input("template") || !run.has_input("registered") || !source.bodies) {
      throw DataError("", "garment", "no registered garment in the workspace",
                      "one: run 'atelier body', 'atelier template' and 'atelier register' first, "
                      "or take a garment from a pattern: --garment dress, tee+trousers or a file");
    }
    source.outfit = read_registered_outfit(run.input("template"), run.input("registered"));
  }
  return source;
}

bool is_person(const AnimateOptions& options) {
  return options.body.empty();
}

BodyModel wearer_of(StageRun& run, const Source& source, const AnimateOptions& options) {
  if (is_person(options)) {
    return source.person.model;
  }
  if (options.body == "female" || options.body == "male") {
    return default_human(options.body == "male" ? male_human() : female_human());
  }
  BodyFile file = read_body_file(options.body);
  for (const Finding& finding : file.findings) {
    run.say(to_string(finding));
  }
  return std::move(file.model);
}

Motion retargeted(StageRun& run, const MotionClip& clip, const BodyModel& model) {
  Retargeted moved = retarget(clip, model);
  for (const Finding& finding : moved.findings) {
    run.say(to_string(finding));
  }
  return std::move(moved.motion);
}

/// The capture's own motion on the wearer.
Motion own_motion(StageRun& run, const Source& source, const BodyModel& wearer,
                  const AnimateOptions& options) {
  if (is_person(options)) {
    return source.tracked.motion;
  }
  MotionClip clip;
  clip.name = "tracked";
  clip.skeleton = source.tracked.skeleton;
  clip.motion = source.tracked.motion;
  return retargeted(run, clip, wearer);
}

Motion new_motion(StageRun& run, const BodyModel& wearer, const AnimateOptions& options) {
  if (is_procedural(options.motion)) {
    const ContinuousMotion continuous =
        continuous_motion(wearer, options.motion, kProceduralTime, 0);
    Motion motion;
    motion.fps = kSampleRate;
    const int frames = static_cast<int>(std::floor(continuous.duration * kSampleRate)) + 1;
    for (int i = 0; i < frames; ++i) {
      motion.frame_ids.push_back(i);
      motion.poses.push_back(continuous.pose(i / kSampleRate));
    }
    return motion;
  }
  if (!fs::exists(options.motion)) {
    throw DataError(options.motion, "motion", "no such file",
                    "a motion file (.bvh, .npz, .glb, .amc, .trc, .c3d), or stride, squat, raise, "
                    "twist, spin or range");
  }
  const MotionClip clip = read_motion_file(options.motion);
  for (const Finding& finding : clip.findings) {
    run.say(to_string(finding));
  }
  return retargeted(run, clip, wearer);
}

/// The part of a motion that is wanted. Poses keep their rate, so that it begins at a pose.
Motion motion_part(const Motion& motion, const AnimateOptions& options, std::size_t& first) {
  first = static_cast<std::size_t>(std::llround(options.start * motion.fps));
  if (first >= motion.poses.size()) {
    throw DataError(options.motion, "motion",
                    std::to_string(motion.poses.size()) + " frames, none of them behind --start",
                    "a motion that is longer than --start");
  }
  std::size_t count = motion.poses.size() - first;
  if (options.seconds > 0) {
    count = std::min(count,
                     static_cast<std::size_t>(std::ceil(options.seconds * motion.fps - 1e-9)) + 1);
  }
  Motion part;
  part.fps = motion.fps;
  const auto begin = static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  part.poses.assign(motion.poses.begin() + begin, motion.poses.begin() + end);
  part.frame_ids.assign(motion.frame_ids.begin() + begin, motion.frame_ids.begin() + end);
  return part;
}

/// How far the surface of a frame is off the skinned person; no rows where there is none.
Points offset_in(const Source& source, const MovingBody& body, int frame_id) {
  const std::optional<Points> surface = source.surface(frame_id);
  const Index row = source.row(frame_id);
  if (!surface || row < 0) {
    return Points(0, 3);
  }
  return *surface - skin_vertices(body.model, body.shaped,
                                  source.tracked.motion.poses[static_cast<std::size_t>(row)]);
}

/// Surfaces of all frames, where `body` has one of each.
void add_offsets(MovingBody& body, const Source& source) {
  for (const int id : body.motion.frame_ids) {
    Points offset = offset_in(source, body, id);
    if (offset.rows() == 0) {
      body.offsets.clear();
      return;
    }
    body.offsets.push_back(std::move(offset));
  }
}

Material material_for(const AnimateOptions& options, const std::map<std::string, Material>& fitted,
                      const std::string& garment) {
  const auto found = fitted.find(garment);
  return said_material(options.material, found == fitted.end() ? Material{} : found->second);
}

/// The frame in which clothes are put on before a motion that is not theirs: the template's own,
/// of the garment with most vertices.
int dressing_frame(const Source& source) {
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

/// Garments carried over to another body in the same pose, riding on its triangles.
void carry(std::vector<WornGarment>& garments, const Points& from, const Points& to,
           const Triangles& faces) {
  for (WornGarment& worn : garments) {
    worn.start = ride_on_body(attach_to_body(worn.start, from, faces), to, faces);
    worn.velocity.resize(0, 3);
  }
}

/// The clothes as registered, on the body: in its motion where that is the capture's own, else in
/// the pose of their template, from which the body goes over into the motion.
void wear_registered(StageRun& run, const Source& source, const AnimateOptions& options, bool own,
                     const std::map<std::string, Material>& fitted, Animation& animation) {
  MovingBody& body = animation.body;
  const Triangles& faces = body.model.mesh.faces;
  const int first = body.motion.frame_ids.front();
  const std::vector<int> frames = common_frames(source.outfit);
  const bool begins_moving = own && is_person(options) && !body.offsets.empty() &&
                             std::binary_search(frames.begin(), frames.end(), first);
  const int frame_id = begins_moving ? first : dressing_frame(source);
  const std::optional<Points> surface = source.surface(frame_id);
  if (!surface) {
    throw DataError(run.input("bodies").string(), "frames",
                    "no body in frame " + std::to_string(frame_id),
                    "one in every registered frame; run 'atelier body' again");
  }
  std::vector<WornGarment> garments;
  for (const RegisteredGarmentSequence& garment : source.outfit) {
    garments.push_back(worn_in_frame(garment, frame_id, *surface, faces,
                                     material_for(options, fitted, garment.name)));
    if (begins_moving) {
      garments.back().velocity = registered_velocity(garment, body);
    }
    if (options.cloth.relax) {
      const std::optional<Points> there = source.surface(garment.template_frame);
      RelaxedGarment relaxed =
          unloaded(garments.back(), there ? *there : *surface, faces, options.cloth, run.device());
      char text[160];
      std::snprintf(text, sizeof text, "%s: without its weight it hangs %.2f mm from as registered",
                    garment.name.c_str(), 1e3 * relaxed.mean_error);
      run.say(text);
      garments.back().garment.mesh = std::move(relaxed.garment.mesh);
    }
  }
  if (!begins_moving) {
    const Index row = source.row(frame_id);
    Pose pose = source.tracked.motion.poses[static_cast<std::size_t>(row)];
    Points offset = offset_in(source, body, frame_id);
    if (!is_person(options)) {
      pose = own_motion(run, source, body.model, options).poses[static_cast<std::size_t>(row)];
      offset.resize(0, 3);
      carry(garments, *surface, skin_vertices(body.model, body.shaped, pose), faces);
    }
    if (!own) {
      body.motion = entered_from(body.model, std::move(body.motion), pose);
    }
    lead_in(body, pose, std::move(offset), options.settle);
  }
  animation.worn = worn_cloth(garments, options.cloth);
  if (begins_moving) {
    animation.registered = source.outfit;
  }
}

/// Clothes of patterns, sewn on the body in its rest pose.
void wear_pattern(StageRun& run, const AnimateOptions& options, bool own, Animation& animation) {
  MovingBody& body = animation.body;
  const Material material = said_material(options.material);
  OutfitOptions how;
  how.garment = options.garment;
  how.density = material.density;
  how.stretch = material.stretch_warp;
  how.bending = material.bending;
  how.friction = material.friction;
  how.thickness = options.cloth.contact;
  how.rate = options.cloth.rate;
  how.substeps = options.cloth.xpbd.substeps;
  run.say("sewing and draping " + options.garment);
  Outfit outfit = dress_body(body.model, how, options.body, run.device());
  WornCloth& worn = animation.worn;
  for (const TruthGarment& garment : outfit.garments) {
    worn.names.push_back(garment.garment.name);
    Mesh mesh = garment.garment.mesh;
    mesh.normals.resize(0, 3);
    worn.meshes.push_back(std::move(mesh));
  }
  worn.first = outfit.first;
  worn.cloth = std::move(outfit.cloth);
  worn.state = std::move(outfit.state);
  worn.solver = options.cloth.xpbd;
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

/// Cloth that another simulator moved, in place of what the workspace has.
void wear_foreign(const Source& source, const AnimateOptions& options, Animation& animation) {
  const MeshSequenceFile file = read_mesh_sequence(options.cloth_sequence, false);
  WornCloth& worn = animation.worn;
  worn.first.push_back(0);
  Index faces = 0;
  for (const RegisteredGarmentSequence& garment : source.outfit) {
    Mesh mesh = garment.garment.mesh;
    mesh.normals.resize(0, 3);
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
    throw DataError(options.cloth_sequence, "faces",
                    std::to_string(file.shared.faces.rows()) + " of another topology",
                    "the " + std::to_string(joined.rows()) +
                        " faces of the workspace's garments, one behind the other (atelier export "
                        "--stage register), or --garment none");
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

/// Frames of the result and the steps between them.
void set_frames(const AnimateOptions& options, bool own, Animation& animation) {
  MovingBody& body = animation.body;
  const Motion& motion = body.motion;
  animation.fps = options.fps > 0 ? options.fps
                  : own           ? motion.fps
                                  : std::min(motion.fps, kMostRate);
  const double duration = static_cast<double>(motion.poses.size() - 1) / motion.fps;
  const auto count = static_cast<Index>(std::floor(duration * animation.fps + 1e-6)) + 1;
  for (Index i = 0; i < count; ++i) {
    animation.frame_ids.push_back(own && animation.fps == motion.fps
                                      ? motion.frame_ids[static_cast<std::size_t>(i)]
                                      : static_cast<int>(i));
  }
  animation.steps_per_frame =
      static_cast<int>(std::ceil(options.cloth.rate / animation.fps - 1e-9));
  animation.step_seconds = 1 / (animation.fps * animation.steps_per_frame);
  const double lead = lead_seconds(body);
  animation.steps_before = static_cast<int>(std::ceil(lead / animation.step_seconds - 1e-9));
  body.settle += animation.steps_before * animation.step_seconds - lead;
  animation.worn.solver.time_step = animation.step_seconds;
}

}  // namespace

OptionTable describe(AnimateOptions& options) {
  OptionTable table;
  std::vector<std::string> materials = fabric_names();
  materials.insert(materials.begin(), "fitted");
  table.add("motion", options.motion, std::vector<std::string>{},
            "File (.bvh, .npz, .glb, .amc, .trc, .c3d), or stride, squat, raise, twist, spin, "
            "range; empty: the capture's own");
  table.add("sequence", options.sequence, std::vector<std::string>{},
            "Of the capture, whose motion is its own; empty: the first clothed one");
  table.add("start", options.start, 0, 1e6, "s", "Where in the motion it begins");
  table.add("seconds", options.seconds, 0, 1e6, "s", "How much of the motion; 0: to its end");
  table.add("fps", options.fps, 0, 240, "1/s",
            "Frames a second; 0: the capture's own, of other motions theirs up to 30");
  table.add("body", options.body, std::vector<std::string>{},
            "Another body of the person's topology: file, female or male; empty: the person");
  table.add("garment", options.garment, std::vector<std::string>{},
            "auto: as registered; none; or what synthesize takes: dress, tee+trousers, a pattern "
            "file (.json), sewn on the body");
  table.add("cloth_sequence", options.cloth_sequence, std::vector<std::string>{},
            "Instead of simulating: meshes of another simulator, one a frame (folder, .npz, .h5)");
  table.add("material", describe_said(options.material, std::move(materials)));
  table.add("cloth", describe(options.cloth));
  table.add("settle", options.settle, 0, 60, "s", "That cloth hangs before the body moves");
  table.add("pictures", options.pictures, "Render pictures and a video");
  table.add(describe(options.view));
  return table;
}

fs::path tracked_take(const fs::path& tracked, const fs::path& capture, const std::string& name) {
  const fs::path folder = tracked / "tracked";
  if (!name.empty()) {
    const fs::path file = folder / (name + ".h5");
    if (!fs::exists(file)) {
      throw DataError(folder.string(), "sequence", "'" + name.substr(0, 80) + "' is not tracked",
                      "a sequence of the capture");
    }
    return file;
  }
  fs::path first;
  for (const CaptureSequence& sequence : open_dataset(capture).info.sequences) {
    const fs::path file = folder / (sequence.name + ".h5");
    if (!fs::exists(file)) {
      continue;
    }
    if (sequence.kind != "minimal") {
      return file;
    }
    first = first.empty() ? file : first;
  }
  if (first.empty()) {
    throw DataError(folder.string(), "", "no sequence of this capture",
                    "tracked ones; run 'atelier track' again");
  }
  return first;
}

Animation read_animation(StageRun& run) {
  const auto& options = run.options<AnimateOptions>();
  const Source source = read_source(run, options);
  Animation animation;
  MovingBody& body = animation.body;
  body.model = wearer_of(run, source, options);
  body.shaped = shape_body(body.model);
  if (options.garment == "auto" &&
      !equal_arrays(body.model.mesh.faces, source.person.model.mesh.faces)) {
    throw DataError(options.body, "faces", "a body of another topology",
                    "one with the person's " +
                        std::to_string(source.person.model.mesh.faces.rows()) +
                        " triangles, on which the garments ride: female, male, or a person.npz");
  }
  const bool own = options.motion.empty();
  std::size_t first = 0;
  body.motion = motion_part(
      own ? own_motion(run, source, body.model, options) : new_motion(run, body.model, options),
      options, first);
  if (own && is_person(options)) {
    add_offsets(body, source);
  }
  if (!options.cloth_sequence.empty() || options.garment == "none") {
    if (options.cloth_sequence.empty()) {
      animation.worn.first = {0};
    } else {
      wear_foreign(source, options, animation);
    }
  } else if (options.garment == "auto") {
    std::map<std::string, Material> fitted;
    if (run.has_input("fitted_material")) {
      fitted = read_materials(run.input("fitted_material"));
    } else if (options.material.name == "fitted") {
      run.say("no fitted material: the values of 'custom' are taken (atelier material fits one)");
    }
    wear_registered(run, source, options, own, fitted, animation);
  } else {
    wear_pattern(run, options, own, animation);
  }
  set_frames(options, own, animation);
  if (animation.foreign) {
    const double rate = animation.foreign->fps > 0 ? animation.foreign->fps : animation.fps;
    const auto needed =
        static_cast<Index>(std::floor(
            static_cast<double>(animation.frame_ids.size() - 1) / animation.fps * rate + 1e-6)) +
        1;
    if (frame_count(*animation.foreign) < needed) {
      throw DataError(options.cloth_sequence, "frames",
                      std::to_string(frame_count(*animation.foreign)),
                      std::to_string(needed) + ", as long as the motion; or --seconds");
    }
  }
  animation.cameras = open_dataset(run.input("capture")).cameras;
  return animation;
}

int step_of(const Animation& animation, Index frame) {
  return animation.steps_before + static_cast<int>(frame) * animation.steps_per_frame;
}

Points body_after(const Animation& animation, int step) {
  return surface_at(animation.body, step * animation.step_seconds);
}

}  // namespace atelier

#endif
