#include "bodymodel/formats/marker_clip.h"

#include <algorithm>

#include "core/printable.h"

namespace atelier {

std::string marker_subject(const std::string& marker) {
  const std::size_t colon = marker.rfind(':');
  return colon == std::string::npos ? "" : marker.substr(0, colon);
}

void lose_markers_at_origin(MarkerClip& clip) {
  const std::size_t count = clip.markers.size();
  const auto at_origin = [&](std::size_t frame, std::size_t m) {
    return clip.seen[frame][m] && clip.positions[frame].row(static_cast<Index>(m)).isZero(0);
  };
  std::vector<bool> elsewhere(count, false);
  for (std::size_t frame = 0; frame < clip.positions.size(); ++frame) {
    for (std::size_t m = 0; m < count; ++m) {
      elsewhere[m] = elsewhere[m] || (clip.seen[frame][m] && !at_origin(frame, m));
    }
  }
  std::size_t lost = 0;
  for (std::size_t frame = 0; frame < clip.positions.size(); ++frame) {
    std::vector<std::size_t> there;
    for (std::size_t m = 0; m < count; ++m) {
      if (at_origin(frame, m)) {
        there.push_back(m);
      }
    }
    const bool several = there.size() > 1;
    for (const std::size_t m : there) {
      if (several || elsewhere[m]) {
        clip.seen[frame][m] = false;
        ++lost;
      }
    }
  }
  if (lost > 0) {
    clip.findings.push_back(
        {Severity::Note, "motion-markers-zero", clip.name,
         counted(static_cast<std::int64_t>(lost), "position") + " at exactly 0, 0, 0",
         "taken for markers that were not seen"});
  }
}

}  // namespace atelier
