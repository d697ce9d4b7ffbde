#include "bodymodel/tracking/keypoint_unit.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "bodymodel/tracking/track.h"
#include "core/error.h"
#include "core/listed_frames.h"

namespace atelier {
namespace {

constexpr double kLeast = 0.01;  // m
constexpr double kMost = 3;      // m

double middle_of(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// How far, m, half of the keypoints that are seen lie from their middle: of a person 0.2 to 1 m.
/// 0 where fewer than three are seen.
double spread(const FrameTargets& frame) {
  constexpr std::size_t kFewest = 3;
  std::array<std::vector<double>, 3> seen;
  for (Index k = 0; k < frame.deviations.size(); ++k) {
    for (int axis = 0; axis < 3 && frame.deviations[k] > 0; ++axis) {
      seen[static_cast<std::size_t>(axis)].push_back(frame.keypoints(k, axis));
    }
  }
  if (seen[0].size() < kFewest) {
    return 0;
  }
  const Eigen::Vector3d middle(middle_of(seen[0]), middle_of(seen[1]), middle_of(seen[2]));
  std::vector<double> distances;
  for (std::size_t k = 0; k < seen[0].size(); ++k) {
    distances.push_back((Eigen::Vector3d(seen[0][k], seen[1][k], seen[2][k]) - middle).norm());
  }
  return middle_of(std::move(distances));
}

std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g m", value);
  return text;
}

}  // namespace

bool OtherUnits::is_one(std::size_t frame) const {
  return std::binary_search(frames.begin(), frames.end(), frame);
}

OtherUnits without_other_units(std::vector<FrameTargets>& frames) {
  OtherUnits others;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const double own = spread(frames[f]);
    if (own <= kMost && (own <= 0 || own >= kLeast)) {
      continue;
    }
    frames[f].keypoints.resize(0, 3);
    frames[f].deviations.resize(0);
    others.least = others.frames.empty() ? own : std::min(others.least, own);
    others.most = std::max(others.most, own);
    others.frames.push_back(f);
  }
  return others;
}

Finding keypoint_unit(const OtherUnits& others, const std::vector<int>& frame_ids,
                      const std::string& instead) {
  ATELIER_CHECK(!others.frames.empty(), "frames in another unit");
  std::vector<int> ids;
  for (const std::size_t f : others.frames) {
    ids.push_back(frame_ids.at(f));
  }
  const bool large = others.most > kMost;
  const bool small = others.least < kLeast;
  const std::string found = large && small ? metres(others.least) + " to " + metres(others.most)
                            : large        ? "up to " + metres(others.most)
                                           : "as little as " + metres(others.least);
  const char* unit = large && small ? "in what unit they are"
                     : large        ? "whether they are in millimetres"
                                    : "whether they are in kilometres or another larger unit";
  return {Severity::Warning, "keypoint-unit", "frames " + listed_frames(ids),
          "half of the keypoints are " + found + " from their middle, a person's 0.2 to 1 m",
          "left out; " + instead + "; look " + unit};
}

}  // namespace atelier
