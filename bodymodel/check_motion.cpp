#include "bodymodel/check_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "core/median.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

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

// How a person goes, from frames that are spread over the clip.
struct Gait {
  std::vector<double> path;              // m, height of the root's path
  std::vector<double> above;             // m, of the hips above it, in the same frames
  double leg = 0;                        // m, hips above the lowest joint, median
  std::vector<Eigen::Vector3d> steps;    // m, of the path in a tenth of a second
  std::vector<Eigen::Vector3d> feet[2];  // m, of each ankle against it, beside each step
};

Gait gait_of(const MotionClip& clip, const Humanoid& person) {
  constexpr double kStepTime = 0.1;     // s; shorter than a foot stands
  constexpr std::size_t kSteps = 1000;  // that are looked at
  const std::size_t frames = clip.motion.poses.size();
  const std::size_t ahead = std::clamp<std::size_t>(
      saturating_cast<std::size_t>(std::round(kStepTime * clip.motion.fps)), 1, frames);
  const auto joints = [&](std::size_t frame) {
    return forward_kinematics(clip.skeleton, clip.motion.poses[frame]).positions;
  };
  const auto path = [&](std::size_t frame) -> Eigen::Vector3d {
    return clip.motion.poses[frame].root_translation;
  };
  const auto hips = [&](const Points& places) -> Eigen::Vector3d {
    return (places.row(person.legs[0].hip) + places.row(person.legs[1].hip)).transpose() / 2;
  };
  Gait gait;
  std::vector<double> legs;
  for (std::size_t frame = 0; frame < frames; frame += 1 + frames / kSteps) {
    const Points now = joints(frame);
    const Eigen::Vector3d root = path(frame);
    gait.path.push_back(root.y());
    gait.above.push_back(hips(now).y() - root.y());
    legs.push_back(hips(now).y() - now.col(1).minCoeff());
    if (frame + ahead < frames) {
      const Points then = joints(frame + ahead);
      gait.steps.emplace_back(path(frame + ahead) - root);
      for (std::size_t side = 0; side < 2; ++side) {
        const int ankle = person.legs[side].ankle;
        gait.feet[side].emplace_back((then.row(ankle) - now.row(ankle)).transpose() -
                                     gait.steps.back());
      }
    }
  }
  gait.leg = median(legs);
  return gait;
}

// By how much the foot that stands best slides in a step, mean, if the path were `scale` times as
// long.
double sliding(const Gait& gait, double scale) {
  double sum = 0;
  for (std::size_t i = 0; i < gait.steps.size(); ++i) {
    const Eigen::Vector3d step = scale * gait.steps[i];
    sum += std::min((gait.feet[0][i] + step).norm(), (gait.feet[1][i] + step).norm());
  }
  return gait.steps.empty() ? 0 : sum / static_cast<double>(gait.steps.size());
}

// Heights of the hips, m, ascending, if the path were `scale` times as long.
std::vector<double> hip_heights(const Gait& gait, double scale) {
  std::vector<double> heights(gait.path.size());
  std::transform(gait.path.begin(), gait.path.end(), gait.above.begin(), heights.begin(),
                 [&](double path, double above) { return scale * path + above; });
  std::sort(heights.begin(), heights.end());
  return heights;
}

// Whether hips stand where legs put them above a floor at 0, in nearly all frames.
bool stands_on_floor(const Gait& gait, double scale) {
  const std::vector<double> heights = hip_heights(gait, scale);
  const std::size_t few = heights.size() / 20;
  const double low = heights[few];
  const double high = heights[heights.size() - 1 - few];
  return low > 0.3 * gait.leg && high < 1.7 * gait.leg && high > 0.8 * gait.leg;
}

// A path in another unit than the bones. One that is too short leaves the hips too low for their
// legs, or the feet slide on the spot; one that is too long has the hips too high and the feet
// slide along. Of several units one in which the hips stand on their legs, and of these the one in
// which the feet slide least.
std::optional<Finding> doubt_path_unit(const MotionClip& clip, const Humanoid& person) {
  constexpr double kStill = 2e-3;   // m in a tenth of a second: a person who stays
  constexpr double kStands = 0.35;  // of the sliding that a wrong unit makes
  const Gait gait = gait_of(clip, person);
  if (!(gait.leg > 0) || gait.path.empty()) {
    return std::nullopt;
  }
  const double slides = sliding(gait, 1);
  const bool stands = stands_on_floor(gait, 1);
  double best = 1;
  bool by_height = false;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::pair<bool, double> least = {true, kNone};  // whether the hips do not stand, sliding
  for (const double scale : {100.0, 1000.0, 10.0, 0.01, 0.001, 0.1}) {
    const double mended = sliding(gait, scale);
    const bool raised =
        scale > 1 && !stands && stands_on_floor(gait, scale) && mended <= slides + kStill;
    const bool steadied =
        (scale > 1 || !stands) && slides > 5 * kStill && mended < kStands * slides;
    const std::pair<bool, double> left = {!stands_on_floor(gait, scale), mended};
    if ((raised || steadied) && left < least) {
      best = scale;
      by_height = !stands;
      least = left;
    }
  }
  if (best == 1) {
    return std::nullopt;
  }
  return Finding{
      Severity::Warning, "motion-path-unit", clip.name,
      "the path through the world is in another unit than the bones: " +
          std::string(by_height
                          ? "the hips are " + short_number(median(hip_heights(gait, 1))) +
                                " m above the floor on legs of " + short_number(gait.leg) + " m"
                          : "the feet slide as if the person walked on the spot"),
      "atelier body-model convert MOTION --motion.path-scale " + short_number(best) +
          " --out MENDED mends it, if the person is not meant to be there"};
}

}  // namespace

std::vector<Finding> check_motion(const MotionClip& clip) {
  std::vector<Finding> findings;
  const std::optional<Humanoid> person = find_humanoid(clip.skeleton);
  if (!person) {
    return findings;
  }
  const bool unit_said =
      std::any_of(clip.findings.begin(), clip.findings.end(), [](const auto& one) {
        return one.code == "motion-unit" && one.severity == Severity::Warning;
      });
  for (const auto& finding : {doubt_path(clip), doubt_bones(clip, *person),
                              unit_said ? std::nullopt : doubt_path_unit(clip, *person)}) {
    if (finding) {
      findings.push_back(*finding);
    }
  }
  return findings;
}

}  // namespace atelier
