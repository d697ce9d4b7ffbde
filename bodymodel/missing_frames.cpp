#include "bodymodel/missing_frames.h"

#include <algorithm>
#include <numeric>

#include "bodymodel/interpolated_pose.h"
#include "core/error.h"
#include "core/printable.h"

namespace atelier {
namespace {

constexpr std::size_t kFewestOfStep = 3;  // frames that say that numbers go on by a step

// The step by which all numbers go on.
int common_step(const std::vector<int>& ids) {
  int step = 0;
  for (std::size_t i = 1; i < ids.size(); ++i) {
    step = std::gcd(step, ids[i] - ids[i - 1]);
  }
  return ids.size() < kFewestOfStep ? 1 : std::max(step, 1);
}

std::int64_t missing_of(const std::vector<int>& ids, int step) {
  return ids.empty() ? 0 : (std::int64_t{ids.back()} - ids.front()) / step + 1 - std::ssize(ids);
}

// "frames 7 to 9" before the frame `i`.
std::string gap_before(const std::vector<int>& ids, std::size_t i, int step) {
  const int first = ids[i - 1] + step;
  const int last = ids[i] - step;
  return first == last ? "frame " + std::to_string(first)
                       : "frames " + std::to_string(first) + " to " + std::to_string(last);
}

std::string first_gap(const std::vector<int>& ids, int step) {
  std::size_t i = 1;
  while (ids[i] - ids[i - 1] == step) {
    ++i;
  }
  return gap_before(ids, i, step);
}

}  // namespace

Motion without_gaps(const Motion& motion, const std::string& file) {
  constexpr std::int64_t kTimes = 4;
  constexpr std::int64_t kMostNumbers = 4'000'000;
  const std::vector<int>& ids = motion.frame_ids;
  const int step = common_step(ids);
  const std::int64_t missing = missing_of(ids, step);
  if (missing == 0 && step == 1) {
    return motion;
  }
  const std::int64_t joints = std::max<Index>(motion.poses[0].rotations.rows(), 1);
  if (missing > kTimes * std::ssize(ids) && missing * joints > kMostNumbers) {
    throw DataError(file, "frame numbers",
                    first_gap(ids, step) + " missing, " + counted(missing, "frame") + " in all",
                    "a motion that goes on; cut it there");
  }
  Motion whole;
  whole.fps = motion.fps / step;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const int passed = i == 0 ? 1 : (ids[i] - ids[i - 1]) / step;
    for (int k = 1; k < passed; ++k) {
      whole.poses.push_back(
          interpolated_pose(motion.poses[i - 1], motion.poses[i], static_cast<double>(k) / passed));
    }
    whole.poses.push_back(motion.poses[i]);
  }
  for (std::size_t i = 0; i < whole.poses.size(); ++i) {
    whole.frame_ids.push_back(ids[0] + static_cast<int>(i));
  }
  return whole;
}

void fill_missing_frames(MotionClip& clip, const std::string& file) {
  const std::vector<int> ids = clip.motion.frame_ids;
  const int step = common_step(ids);
  const std::int64_t missing = missing_of(ids, step);
  clip.motion = without_gaps(clip.motion, file);
  if (missing > 0) {
    clip.findings.push_back(
        {Severity::Warning, "motion-gaps", clip.name,
         counted(missing, "frame") + " missing beside " + std::to_string(ids.size()) +
             " that are there, first " + first_gap(ids, step),
         "poses between those of the neighbours stand there, so that the motion keeps its time"});
  } else if (step > 1) {
    clip.findings.push_back({Severity::Note, "motion-gaps", clip.name,
                             "frame numbers go on by " + std::to_string(step),
                             "the rate is divided by that; --motion.fps sets another"});
  }
}

}  // namespace atelier
