#include "bodymodel/check_motion.h"

#include <optional>

#include "bodymodel/humanoid.h"
#include "core/printable.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

std::optional<Finding> doubt_path(const MotionClip& clip) {
  constexpr double kLeap = 1;      // m
  constexpr double kFastest = 20;  // m/s; sprinters reach 12.4
  const Motion& motion = clip.motion;
  std::int64_t leaps = 0;
  std::string first;
  for (std::size_t i = 1; i < motion.poses.size(); ++i) {
    const double frames = motion.frame_ids[i] - motion.frame_ids[i - 1];
    const double metres =
        (motion.poses[i].root_translation - motion.poses[i - 1].root_translation).norm();
    if (metres > kLeap && metres * motion.fps > kFastest * frames && leaps++ == 0) {
      first =
          "by " + short_number(metres) + " m before frame " + std::to_string(motion.frame_ids[i]);
    }
  }
  if (leaps == 0) {
    return std::nullopt;
  }
  return Finding{Severity::Warning, "motion-jump", clip.name,
                 "the root leaps " + counted(leaps, "time") + ", first " + first,
                 "correct the file, or take a part of it"};
}

std::optional<Finding> doubt_bones(const MotionClip& clip, const Humanoid& person) {
  constexpr double kLongest = 2.5;  // of a leg; from the hips to a fingertip it is one
  const double leg = leg_length(clip.skeleton, person);
  const Points& offsets = clip.skeleton.offsets;
  Index longest = 0;
  for (Index j = 1; j < offsets.rows(); ++j) {
    if (longest == 0 || offsets.row(j).norm() > offsets.row(longest).norm()) {
      longest = j;
    }
  }
  const double metres = longest > 0 ? offsets.row(longest).norm() : 0;
  if (!(leg > 0) || !(metres > kLongest * leg)) {
    return std::nullopt;
  }
  return Finding{Severity::Warning, "motion-bone", clip.name,
                 "joint " + clip.skeleton.names[static_cast<std::size_t>(longest)].substr(0, 40) +
                     " is " + short_number(metres) + " m from its parent, and the legs are " +
                     short_number(leg) + " m",
                 "look whether its place in the file is damaged"};
}

}  // namespace

std::vector<Finding> check_motion(const MotionClip& clip) {
  std::vector<Finding> findings;
  const std::optional<Humanoid> person = find_humanoid(clip.skeleton);
  if (!person) {
    return findings;
  }
  for (const auto& finding : {doubt_path(clip), doubt_bones(clip, *person)}) {
    if (finding) {
      findings.push_back(*finding);
    }
  }
  return findings;
}

}  // namespace atelier
