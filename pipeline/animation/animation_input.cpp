#include "pipeline/animation/animation_input.h"

#include <algorithm>
#include <cmath>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/retarget/synthetic_motion.h"
#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/io/child_program.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_sequence_file.h"
#include "core/io/text_writer.h"
#include "core/limits.h"
#include "core/nearest_name.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"
#include "core/sequence_archive.h"
#include "core/unknown_value.h"
#include "core/usage_error.h"
#include "pipeline/animation/animation_garments.h"
#include "pipeline/outfit/dressing.h"
#include "pipeline/person/tracked_take.h"
#include "simulation/material/fabric.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxRate = 30;        // frames a second of a motion that is not the capture's
constexpr double kSampleRate = 60;     // of procedural motions
constexpr double kProceduralTime = 2;  // s, of a procedural motion
constexpr double kLongestLead = 120;   // s from where clothes are put on to the motion

AnimationSource read_source(StageRun& run, const AnimateOptions& options) {
  AnimationSource source;
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
    hold_outfit(source.outfit, options.holding, run.input("registered"));
  }
  return source;
}

constexpr const char* kLearnt = "networks are of registered garments and of the person under them";

/// Whether `appearance` can have learnt how this looks.
bool is_learnable(const AnimateOptions& options) {
  return options.garment == "auto" ||
         (options.garment == "none" && options.cloth_sequence.empty() && options.body.empty());
}

void require_learnable(const AnimateOptions& options) {
  if (options.view.drawn_by == "networks" && !is_learnable(options)) {
    throw UsageError(std::string("drawn_by networks is for what was captured: ") + kLearnt +
                     "; leave it out");
  }
}

/// The networks that draw the images; none where everything has one colour, and why is said. They
/// are refused here, before minutes of simulation, where they were asked for and are not there.
std::map<std::string, fs::path> drawing_networks(StageRun& run, const AnimationSource& source,
                                                 const std::optional<BodyAvatar>& avatar) {
  const auto& options = run.options<AnimateOptions>();
  std::map<std::string, fs::path> networks;
  if (!options.pictures || options.view.drawn_by == "plain") {
    return networks;
  }
  require_learnable(options);
  std::string missing;
  std::string why = kLearnt;
  if (is_learnable(options)) {
    const auto add = [&](const std::string& name) {
      const bool seen = name == "body" && avatar && has_child_program("atelier-appearance");
      const fs::path model = seen ? avatar->model
                             : run.has_input("networks")
                                 ? run.input("networks") / name / "model.safetensors"
                                 : "";
      if (!fs::exists(model)) {
        return false;
      }
      networks[name] = model;
      return true;
    };
    std::vector<std::string> shown;
    for (const RegisteredGarmentSequence& garment : source.outfit) {
      shown.push_back(garment.name);
    }
    if (shown.empty()) {
      shown = {"body"};
    }
    for (const std::string& name : shown) {
      if (!add(name)) {
        missing += (missing.empty() ? "" : ", ") + name;
      }
    }
    if (!networks.empty()) {
      add("body");  // without an avatar or network it is plain beside drawn clothes
    }
    why = networks.empty() ? "no network of " + missing + "; run 'atelier appearance' first" : "";
  }
  if (why.empty()) {
    if (!missing.empty()) {
      run.warn("no network of " + missing +
               ", drawn in one colour; run 'atelier appearance' again");
    }
  } else if (options.view.drawn_by == "networks") {
    throw DataError("", "drawn_by networks", why, "networks of what is worn; or leave it out");
  } else {
    run.say(
        (avatar ? "clothes in images have one colour each: " : "images have one colour each: ") +
        why);
  }
  return networks;
}

BodyModel wearer_of(StageRun& run, const AnimationSource& source, const AnimateOptions& options) {
  if (options.body.empty()) {
    return source.person.model;
  }
  BodyFile file = read_body_file(options.body);
  tell(run, file.findings);
  return std::move(file.model);
}

Motion retargeted(StageRun& run, const MotionClip& clip, const BodyModel& model) {
  Retargeted moved = retarget(clip, model);
  tell(run, moved.findings);
  return std::move(moved.motion);
}

/// The capture's own motion on the wearer.
Motion own_motion(StageRun& run, const AnimationSource& source, const BodyModel& wearer,
                  const AnimateOptions& options) {
  if (options.body.empty()) {
    return source.tracked.motion;
  }
  MotionClip clip;
  clip.name = "tracked";
  clip.skeleton = source.tracked.skeleton;
  clip.motion = source.tracked.motion;
  return retargeted(run, clip, wearer);
}

void require_motion(const AnimateOptions& options) {
  if (options.motion.empty() || is_procedural(options.motion) ||
      fs::is_regular_file(options.motion)) {
    return;
  }
  const std::string expected =
      "a motion file (.bvh, .npz, .glb, .amc, .trc, .c3d), or stride, squat, raise, twist, spin or "
      "range" +
      did_you_mean(options.motion, procedural_motions());
  if (!fs::path(options.motion).has_extension()) {
    throw UnknownValue("", "motion", options.motion, expected);
  }
  throw DataError(options.motion, "motion",
                  fs::is_directory(options.motion) ? "a folder" : "no such file", expected);
}

Motion new_motion(StageRun& run, const BodyModel& wearer, const AnimateOptions& options) {
  if (is_procedural(options.motion)) {
    const ContinuousMotion continuous =
        continuous_motion(wearer, options.motion, kProceduralTime, 0);
    Motion motion;
    motion.fps = kSampleRate;
    const int frames = saturating_cast<int>(std::floor(continuous.duration * kSampleRate) + 1);
    for (int i = 0; i < frames; ++i) {
      motion.frame_ids.push_back(i);
      motion.poses.push_back(continuous.pose(i / kSampleRate));
    }
    return motion;
  }
  require_motion(options);
  const MotionClip clip = read_motion_file(options.motion, of_body(wearer));
  tell(run, clip.findings);
  return retargeted(run, clip, wearer);
}

/// The part of a motion that is wanted. Poses keep their rate, so that it begins at a pose.
Motion motion_part(const Motion& motion, const AnimateOptions& options, std::size_t& first) {
  first = saturating_cast<std::size_t>(std::round(options.start * motion.fps));
  if (first >= motion.poses.size()) {
    throw UnknownValue(
        options.motion, "start", number_text(options.start),
        "seconds within the motion, which has " + counted(std::ssize(motion.poses), "frame"));
  }
  std::size_t count = motion.poses.size() - first;
  if (options.seconds > 0) {
    count = std::min(
        count, saturating_cast<std::size_t>(std::ceil(options.seconds * motion.fps - 1e-9) + 1));
  }
  Motion part;
  part.fps = motion.fps;
  const auto begin = static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  part.poses.assign(motion.poses.begin() + begin, motion.poses.begin() + end);
  part.frame_ids.assign(motion.frame_ids.begin() + begin, motion.frame_ids.begin() + end);
  return part;
}

/// Surfaces of all frames, where `body` has one of each.
void add_offsets(MovingBody& body, const AnimationSource& source) {
  for (const int id : body.motion.frame_ids) {
    Points offset = offset_in(source, body, id);
    if (offset.rows() == 0) {
      body.offsets.clear();
      return;
    }
    body.offsets.push_back(std::move(offset));
  }
}

/// Frames of the result and the steps between them.
void set_frames(const AnimateOptions& options, bool own, Animation& animation) {
  MovingBody& body = animation.body;
  const Motion& motion = body.motion;
  animation.fps = options.fps > 0 ? options.fps : own ? motion.fps : std::min(motion.fps, kMaxRate);
  const double duration = static_cast<double>(motion.poses.size() - 1) / motion.fps;
  const auto count = saturating_cast<Index>(std::floor(duration * animation.fps + 1e-6) + 1);
  if (count > Limits{}.frames) {
    throw DataError(
        options.motion, "duration",
        short_number(duration) + " s, at " + short_number(animation.fps) + " frames a second " +
            short_number(static_cast<double>(count)) + " frames",
        "at most " + std::to_string(Limits{}.frames) + " frames; --seconds takes a part of them");
  }
  for (Index i = 0; i < count; ++i) {
    animation.frame_ids.push_back(own && animation.fps == motion.fps
                                      ? motion.frame_ids[static_cast<std::size_t>(i)]
                                      : static_cast<int>(i));
  }
  animation.steps_per_frame =
      saturating_cast<int>(std::ceil(options.cloth.rate / animation.fps - 1e-9));
  animation.step_seconds = 1 / (animation.fps * animation.steps_per_frame);
  const double lead = lead_seconds(body);
  if (!(lead <= kLongestLead)) {
    throw DataError(
        options.motion, "first frames",
        "a start so far away or so fast that the body takes " +
            std::to_string(saturating_cast<std::int64_t>(std::round(std::min(lead, 1e9)))) +
            " s to it from where its clothes are put on",
        "at most " + std::to_string(saturating_cast<std::int64_t>(kLongestLead)) +
            " s; a frame that jumps is passed by with --start");
  }
  animation.steps_before = saturating_cast<int>(std::ceil(lead / animation.step_seconds - 1e-9));
  body.settle += animation.steps_before * animation.step_seconds - lead;
  animation.worn.solver.time_step = animation.step_seconds;
}

}  // namespace

OptionTable describe(AnimateOptions& options) {
  OptionTable table;
  std::vector<std::string> materials = fabric_names();
  materials.insert(materials.begin(), "fitted");
  table.add("motion", options.motion, std::vector<std::string>{},
            "Motion to animate: a file (.bvh, .npz, .glb, .amc, .trc, .c3d) or stride, squat, "
            "raise, twist, spin, range; empty: the capture's own motion");
  table.add(
      "sequence", options.sequence, std::vector<std::string>{},
      "Name of the sequence of the capture whose motion is used; empty: the first clothed one");
  table.add("start", options.start, 0, 1e6, "s",
            "Time in the motion at which the animation begins");
  table.add("seconds", options.seconds, 0, 1e6, "s",
            "Duration of the animation; 0: to the end of the motion");
  table.add("fps", options.fps, 0, 240, "1/s",
            "Frame rate of the animation; 0: the capture's, or that of another motion up to 30");
  table.add("body", options.body, std::vector<std::string>{},
            "Another body of the person's topology: a file, female or male; empty: the person");
  table.add("garment", options.garment, std::vector<std::string>{},
            "Garments worn: auto (as registered), none, or new ones sewn on the body as synthesize "
            "takes them, such as dress, tee+trousers or a pattern file (.json)");
  table.add("holding", options.holding, std::vector<std::string>{}, kHoldingHelp);
  table.add("cloth_sequence", options.cloth_sequence, std::vector<std::string>{},
            "Meshes of another simulator, one for each frame (folder, .npz, .h5), used instead of "
            "simulating");
  table.add("material", describe_material(options.material, std::move(materials)));
  table.add("cloth", describe(options.cloth));
  table.add("settle", options.settle, 0, 60, "s", "Time that cloth hangs before the body moves");
  table.add("pictures", options.pictures, "Rendering of images and a video");
  table.add(describe(options.view));
  table.add("mark", options.mark,
            "Invisible mark and content credentials of images and video, which verify reads; off: "
            "exactly what was drawn, for figures of a paper");
  table
      .add("sign", options.sign, std::vector<std::string>{},
           "File of a secret key without a passphrase, by which images and video are signed, as "
           "atelier key --signing writes it; empty: a key that everybody can derive, which says "
           "that they are whole, not whose")
      .not_keyed();
  table.add(describe(options.use));
  return table;
}

void require_named(const AnimateOptions& options, const fs::path& capture) {
  if (options.pictures) {
    require_view(options.view, open_dataset(capture).cameras);
    require_learnable(options);
  }
  const auto missing = [](const std::string& file) { return !file.empty() && !fs::exists(file); };
  if (missing(options.body) && options.body != "female" && options.body != "male") {
    read_body_file(options.body);  // says what it would have read
  }
  require_motion(options);
  require_holding_named(options.holding);
  if (!options.cloth_sequence.empty()) {
    if (missing(options.cloth_sequence)) {
      read_mesh_sequence(options.cloth_sequence, SequenceOf::Cloth);
    }
  } else if (options.garment != "auto" && options.garment != "none") {
    for (const auto& [name, label] : outfit_garments(options.garment)) {
      if (name.ends_with(".json") && missing(name)) {
        read_file_text(name, Limits().text_file_bytes);
      }
    }
  }
}

std::vector<Finding> preview_animation(const AnimateOptions& options, const fs::path& workspace) {
  if (options.motion.empty() || is_procedural(options.motion)) {
    return {};
  }
  require_motion(options);
  const fs::path person = workspace / "personalize" / "current" / "person.npz";
  Animation animation;
  MovingBody& body = animation.body;
  std::size_t first = 0;
  if (!options.body.empty()) {
    body.model = read_body_file(options.body).model;
  } else if (!workspace.empty() && fs::exists(person)) {
    body.model = read_personal_body(person).model;
  } else {
    MotionClip clip = read_motion_file(options.motion);
    motion_part(clip.motion, options, first);
    return std::move(clip.findings);
  }
  const MotionClip clip = read_motion_file(options.motion, of_body(body.model));
  Retargeted moved = retarget(clip, body.model);
  body.motion = motion_part(moved.motion, options, first);
  set_frames(options, false, animation);
  std::vector<Finding> findings = clip.findings;
  findings.insert(findings.end(), moved.findings.begin(), moved.findings.end());
  return findings;
}

Animation read_animation(StageRun& run) {
  const auto& options = run.options<AnimateOptions>();
  const AnimationSource source = read_source(run, options);
  Animation animation;
  animation.cameras = open_dataset(run.input("capture")).cameras;
  if (options.pictures) {  // refused now rather than behind minutes of simulation
    require_view(options.view, animation.cameras);
  }
  if (run.has_input("avatar") && options.body.empty()) {
    animation.avatar = read_body_avatar(run.input("avatar"), source.person.model);
  }
  animation.networks = drawing_networks(run, source, animation.avatar);
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
  if (own && options.body.empty()) {
    add_offsets(body, source);
  }
  if (!options.cloth_sequence.empty() || options.garment == "none") {
    if (options.cloth_sequence.empty()) {
      animation.worn.first = {0};
    } else {
      wear_foreign(options, source, animation);
    }
  } else if (options.garment == "auto") {
    wear_registered(
        run, source,
        [&](Index row) {
          return own_motion(run, source, body.model, options).poses[static_cast<std::size_t>(row)];
        },
        animation);
  } else {
    wear_pattern(run, animation);
  }
  set_frames(options, own, animation);
  if (animation.foreign) {
    const double rate = animation.foreign->fps > 0 ? animation.foreign->fps : animation.fps;
    const auto needed =
        saturating_cast<Index>(std::floor(
            static_cast<double>(animation.frame_ids.size() - 1) / animation.fps * rate + 1e-6)) +
        1;
    if (frame_count(*animation.foreign) < needed) {
      throw DataError(options.cloth_sequence, "frames",
                      std::to_string(frame_count(*animation.foreign)),
                      std::to_string(needed) + ", as long as the motion; or --seconds");
    }
  }
  return animation;
}

int step_of(const Animation& animation, Index frame) {
  return animation.steps_before + static_cast<int>(frame) * animation.steps_per_frame;
}

double first_azimuth(const Animation& animation) {
  const Skeleton& skeleton = animation.body.shaped.skeleton;
  const std::optional<Humanoid> person = find_humanoid(skeleton);
  if (!person) {
    return 0;
  }
  const Pose pose = pose_at(animation.body, step_of(animation, 0) * animation.step_seconds);
  const Points joints = forward_kinematics(skeleton, pose).positions;
  const Eigen::RowVector3d left = joints.row(person->legs[0].hip) - joints.row(person->legs[1].hip);
  // Lying on the side hips have no direction along the ground.
  const bool lies = std::hypot(left.x(), left.z()) < 0.2 * left.norm();
  return lies ? 0 : std::atan2(-left.z(), left.x());
}

Points body_after(const Animation& animation, int step) {
  return surface_at(animation.body, step * animation.step_seconds);
}

}  // namespace atelier
