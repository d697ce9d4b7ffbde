#include "bodymodel/motion_clip.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr double kStage = 1000;        // metres from the origin
constexpr double kAdultHeight = 1.65;  // metres; skeletons end a little below the skin
constexpr double kAdultLegs = 0.83;    // metres, hip to knee to ankle (Drillis and Contini 1966:
                                       // 0.491 of a stature of 1.70)
// Metre, decimetre, 0.45 units an inch (CMU ASF and cgspeed BVH), inch, centimetre, millimetre.
constexpr double kUnits[] = {1, 0.1, 0.0254 / 0.45, 0.0254, 0.01, 0.001};

// Rows turned so that what was z becomes y: (x, y, z) -> (x, z, -y).
void z_up_to_y_up(Points& rows) {
  const Eigen::VectorXd y = rows.col(1);
  rows.col(1) = rows.col(2);
  rows.col(2) = -y;
}

Eigen::Vector3d trunk_direction(const Points& joints, const Humanoid& person) {
  return (joints.row(person.neck.back()) - joints.row(person.spine.front()))
      .normalized()
      .transpose();
}

// Whether a person whose rest pose stands along one of y and z stands along `axis`, the other one,
// in the motion: with the head up in nearly all frames, the lowest joint at 0 and the pelvis a leg
// above it. A person who lies has the floor elsewhere.
bool stands_along(int axis, const MotionClip& clip, const Humanoid& person) {
  constexpr std::size_t kLooked = 200;  // frames that are looked at
  constexpr double kHeadUp = 0.8;       // mean cosine
  constexpr double kFloor = 0.25;       // of a leg, between the lowest joint and 0
  const double leg = leg_length(clip.skeleton, person);
  const std::size_t step = 1 + clip.motion.poses.size() / kLooked;
  double upright = 0;
  double lowest = std::numeric_limits<double>::infinity();
  double pelvis = 0;
  double count = 0;
  for (std::size_t i = 0; i < clip.motion.poses.size(); i += step) {
    const Points joints = forward_kinematics(clip.skeleton, clip.motion.poses[i]).positions;
    upright += trunk_direction(joints, person)[axis];
    lowest = std::min(lowest, joints.col(axis).minCoeff());
    pelvis += joints(person.spine.front(), axis);
    ++count;
  }
  const double height = count > 0 ? pelvis / count - lowest : 0;
  return upright > kHeadUp * count && std::abs(lowest) < kFloor * leg && height > 0.6 * leg &&
         height < 1.5 * leg;
}

Eigen::Vector3d z_up_to_y_up(const Eigen::Vector3d& p) {
  return {p.x(), p.z(), -p.y()};
}

}  // namespace

OptionTable describe(MotionOptions& options) {
  OptionTable table;
  table.add("metres_per_unit", options.metres_per_unit, 0, 1000, "m",
            "Length of the unit of motion files that do not state it; 0: guessed from the length "
            "of the legs, set it for children");
  table.add("up", options.up, {{"auto", '\0'}, {"y", 'y'}, {"z", 'z'}},
            "Up axis of the motion file; auto: guessed from the position of the head");
  table.add("fps", options.fps, 0, 1000, "1/s",
            "Frame rate of motion files that do not state it; 0: as the file says");
  table.add("animation", options.animation, {},
            "Animation of a glTF or FBX file that holds several, by name or number from 1; empty: "
            "the first that moves a joint");
  table.add("skin", options.skin, {},
            "Skin of a glTF or FBX file that holds several people, by name or number from 1; "
            "empty: the first that the animation moves");
  table.add("path_scale", options.path_scale, 1e-4, 1e4, "",
            "Factor of the person's path where the file has it in another unit than the bones: "
            "100 for a path in metres of bones in centimetres");
  return table;
}

void check_motion_clip(const MotionClip& clip, const std::string& file) {
  check_skeleton(clip.skeleton, file);
  const Index joints = static_cast<Index>(clip.skeleton.names.size());
  for (const EndSite& site : clip.end_sites) {
    if (site.joint < 0 || site.joint >= joints || !site.offset.allFinite()) {
      throw DataError(file, "end site", "joint " + std::to_string(site.joint),
                      "a joint in [0, " + std::to_string(joints) + ") and a finite offset");
    }
  }
  const Motion& motion = clip.motion;
  if (!(motion.fps > 0) || !std::isfinite(motion.fps)) {
    throw DataError(file, "frame rate", short_number(motion.fps), "more than 0");
  }
  if (motion.frame_ids.size() != motion.poses.size()) {
    throw DataError(file, "motion", std::to_string(motion.frame_ids.size()) + " frame ids",
                    std::to_string(motion.poses.size()) + ", one for each pose");
  }
  for (std::size_t i = 0; i < motion.poses.size(); ++i) {
    const std::string where = "frame " + std::to_string(motion.frame_ids[i]);
    if (i > 0 && motion.frame_ids[i] <= motion.frame_ids[i - 1]) {
      throw DataError(file, where, "an id that does not increase", "increasing frame ids");
    }
    const Pose& pose = motion.poses[i];
    if (pose.rotations.rows() != joints) {
      throw DataError(file, where, std::to_string(pose.rotations.rows()) + " rotations",
                      std::to_string(joints) + ", one for each joint");
    }
    if (!pose.rotations.allFinite() || !pose.root_translation.allFinite()) {
      throw DataError(file, where, "a number that is not finite", "finite numbers");
    }
  }
}

void check_on_stage(const MotionClip& clip, const std::string& file) {
  const Points& offsets = clip.skeleton.offsets;
  for (Index j = 1; j < offsets.rows(); ++j) {
    if (!(offsets.row(j).norm() <= kStage)) {
      throw DataError(file, "joint " + clip.skeleton.names[static_cast<std::size_t>(j)],
                      "a bone of " + short_number(offsets.row(j).norm()) + " m",
                      "a person's; set the unit by --motion.metres-per-unit");
    }
  }
  for (std::size_t i = 0; i < clip.motion.poses.size(); ++i) {
    const Eigen::Vector3d root = offsets.row(0).transpose() + clip.motion.poses[i].root_translation;
    if (!(root.norm() <= kStage)) {
      throw DataError(file, "frame " + std::to_string(clip.motion.frame_ids[i]),
                      "a root " + short_number(root.norm()) + " m from the origin",
                      "a stage: at most " + short_number(kStage) +
                          " m; move the motion to the origin, or set its unit by "
                          "--motion.metres-per-unit");
    }
  }
}

Eigen::Vector3d rest_extent(const MotionClip& clip) {
  const JointFrames rest = forward_kinematics(clip.skeleton, rest_pose(clip.skeleton));
  Eigen::Vector3d low = rest.positions.colwise().minCoeff();
  Eigen::Vector3d high = rest.positions.colwise().maxCoeff();
  for (const EndSite& site : clip.end_sites) {
    const Eigen::Vector3d tip = rest.positions.row(site.joint).transpose() +
                                rest.rotations[static_cast<std::size_t>(site.joint)] * site.offset;
    low = low.cwiseMin(tip);
    high = high.cwiseMax(tip);
  }
  return high - low;
}

char guess_up_axis(const MotionClip& clip) {
  const std::optional<Humanoid> person = find_humanoid(clip.skeleton);
  if (!person) {
    const Eigen::Vector3d extent = rest_extent(clip);
    return extent.z() > extent.y() ? 'z' : 'y';
  }
  const Points rest = rest_positions(clip.skeleton);
  Eigen::Vector3d trunk = trunk_direction(rest, *person);
  const Eigen::Vector3d legs = rest.row(person->legs[0].ankle) + rest.row(person->legs[1].ankle) -
                               rest.row(person->legs[0].hip) - rest.row(person->legs[1].hip);
  const bool standing = trunk.dot(legs.normalized()) < -0.7;
  if (!standing) {
    trunk.setZero();
    for (const Pose& pose : clip.motion.poses) {
      trunk += trunk_direction(forward_kinematics(clip.skeleton, pose).positions, *person);
    }
  }
  const bool z = std::abs(trunk.z()) > std::abs(trunk.y());
  return z != (standing && stands_along(z ? 1 : 2, clip, *person)) ? 'z' : 'y';
}

double guess_metres_per_unit(const MotionClip& clip, char up) {
  const std::optional<Humanoid> person = find_humanoid(clip.skeleton);
  const double length =
      person ? leg_length(clip.skeleton, *person) : rest_extent(clip)[up == 'z' ? 2 : 1];
  const double adult = person ? kAdultLegs : kAdultHeight;
  if (!(length > 0)) {
    return 1;
  }
  double best = 1;
  double least = std::abs(std::log(length / adult));
  for (const double unit : kUnits) {
    const double off = std::abs(std::log(length * unit / adult));
    if (off < least) {
      least = off;
      best = unit;
    }
  }
  return least < std::log(1.3) ? best : adult / length;
}

MotionClip in_metres_y_up(MotionClip clip, const MotionOptions& options) {
  ATELIER_CHECK(options.up == 0 || options.up == 'y' || options.up == 'z', "up is 'y' or 'z'");
  ATELIER_CHECK(options.metres_per_unit >= 0 && std::isfinite(options.metres_per_unit),
                "metres per unit is not negative");
  const char up = options.up != 0 ? options.up : guess_up_axis(clip);
  const double scale =
      options.metres_per_unit > 0 ? options.metres_per_unit : guess_metres_per_unit(clip, up);
  constexpr double kLeastUnit = 1e-6;
  constexpr double kMostUnit = 1e3;
  if (options.metres_per_unit == 0 && !(scale >= kLeastUnit && scale <= kMostUnit)) {
    throw DataError(
        clip.name, "skeleton",
        "bones of which no unit makes a person's: one would be " + short_number(scale) + " m",
        "a person's bones; --motion.metres-per-unit of body-model sets the unit");
  }
  if (options.up == 0 && up != 'y') {
    clip.findings.push_back({Severity::Note, "motion-up", clip.name, "z taken as up",
                             "--motion.up y if that is wrong"});
  }
  if (options.metres_per_unit == 0 && scale != 1) {
    clip.findings.push_back({Severity::Note, "motion-unit", clip.name,
                             "one unit taken as " + short_number(scale) + " m",
                             "--motion.metres-per-unit sets another"});
  }
  clip.skeleton.offsets *= scale;
  for (EndSite& site : clip.end_sites) {
    site.offset *= scale;
  }
  for (Pose& pose : clip.motion.poses) {
    pose.root_translation *= scale;
  }
  if (up == 'z') {
    z_up_to_y_up(clip.skeleton.offsets);
    if (clip.skeleton.rest_rotations.rows() > 0) {
      z_up_to_y_up(clip.skeleton.rest_rotations);
    }
    for (EndSite& site : clip.end_sites) {
      site.offset = z_up_to_y_up(site.offset);
    }
    for (Pose& pose : clip.motion.poses) {
      pose.root_translation = z_up_to_y_up(pose.root_translation);
      z_up_to_y_up(pose.rotations);
    }
  }
  if (options.fps > 0) {
    clip.motion.fps = options.fps;
  }
  return clip;
}

double frame_rate(double seconds_per_frame) {
  const double rate = 1 / seconds_per_frame;
  const double whole = std::round(rate);
  return whole > 0 && std::abs(rate - whole) < 1e-3 * whole ? whole : rate;
}

}  // namespace atelier
