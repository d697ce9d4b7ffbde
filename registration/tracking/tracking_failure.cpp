#include "registration/tracking/tracking_failure.h"

#include <algorithm>
#include <cstdio>
#include <vector>

namespace atelier {
namespace {

/// "1, 3 to 7", of places among the frames.
std::string places_text(const std::vector<std::size_t>& places,
                        std::span<const TrackedFrameFigures> frames) {
  std::string text;
  for (std::size_t i = 0; i < places.size();) {
    std::size_t last = i;
    while (last + 1 < places.size() && places[last + 1] == places[last] + 1) {
      ++last;
    }
    text += (text.empty() ? "" : ", ") + std::to_string(frames[places[i]].frame_id);
    if (last > i) {
      text += (last > i + 1 ? " to " : ", ") + std::to_string(frames[places[last]].frame_id);
    }
    i = last + 1;
  }
  return text;
}

}  // namespace

std::optional<Finding> tracking_failure(const std::string& garment,
                                        std::span<const TrackedFrameFigures> frames) {
  constexpr double kMinSupport = 0.75;
  constexpr double kMinCorrelation = 0.5;
  std::vector<std::size_t> lost;
  double support = 1;
  double correlation = 1;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const TrackedFrameFigures& frame = frames[i];
    const bool compared = frame.correlation != 0;
    if (frame.support < kMinSupport || (compared && frame.correlation < kMinCorrelation)) {
      lost.push_back(i);
      support = std::min(support, frame.support);
      correlation = compared ? std::min(correlation, frame.correlation) : correlation;
    }
  }
  if (lost.empty()) {
    return std::nullopt;
  }
  char what[200];
  std::snprintf(what, sizeof what,
                "lost in %zu of %zu frames: the scan speaks of %.2f of it, images agree with its "
                "texture by %.2f, at worst",
                lost.size(), frames.size(), support, correlation);
  return Finding{Severity::Warning, "tracking-failure", garment,
                 what + std::string(" (frames ") + places_text(lost, frames) + ")",
                 "look at the template and at these frames' scans; what slides along cloth without "
                 "a print is not seen"};
}

std::optional<Finding> inside_body(const std::string& garment,
                                   std::span<const TrackedFrameFigures> frames) {
  constexpr double kMaxInside = 0.01;
  std::vector<std::size_t> inside;
  double most = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].inside > kMaxInside) {
      inside.push_back(i);
      most = std::max(most, frames[i].inside);
    }
  }
  if (inside.empty()) {
    return std::nullopt;
  }
  char what[120];
  std::snprintf(what, sizeof what, "inside the body in %zu of %zu frames, %.1f %% of it at worst",
                inside.size(), frames.size(), 100 * most);
  return Finding{Severity::Warning, "inside-body", garment,
                 what + std::string(" (frames ") + places_text(inside, frames) + ")",
                 "look at the body of these frames: is it as wide as the person, do its limbs pass "
                 "through each other; --collision keeps cloth out of it"};
}

}  // namespace atelier
