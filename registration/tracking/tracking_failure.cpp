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
  constexpr double kMinCorrelation = 0.4;
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
  char what[320];
  std::snprintf(what, sizeof what,
                "its position is not to be relied on in %zu of %zu frames (%s); at worst, only "
                "%.0f%% of its surface has a scan near it",
                lost.size(), frames.size(), places_text(lost, frames).substr(0, 120).c_str(),
                100 * support);
  std::string found = what;
  if (correlation < kMinCorrelation) {
    std::snprintf(what, sizeof what,
                  ", and its texture matches the images with a correlation of %.2f, where %.1f "
                  "and more is usual",
                  correlation, kMinCorrelation);
    found += what;
  }
  return Finding{Severity::Warning, "tracking-failure", garment, found,
                 "compare garment and images of these frames in the report; where the template is "
                 "wrong, take one of another frame: atelier template --frame N; where scans are, "
                 "more cameras or better masks (sliding along cloth without a print is not found)"};
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
  std::snprintf(what, sizeof what, "up to %.1f%% of it lies inside the body, in %zu of %zu frames",
                100 * most, inside.size(), frames.size());
  return Finding{Severity::Warning, "inside-body", garment,
                 what + std::string(" (") + places_text(inside, frames) + ")",
                 "look in the report whether the body of these frames is wider than the person, or "
                 "its limbs pass through each other; --collision true keeps cloth outside"};
}

}  // namespace atelier
