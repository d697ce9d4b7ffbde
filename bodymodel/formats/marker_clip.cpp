#include "bodymodel/formats/marker_clip.h"

#include <algorithm>

#include "core/printable.h"

namespace atelier {
namespace {

// Whether the markers that are seen beside `marker` are around the origin in every frame: their
// middle is nearer to it than they are to their middle, as of keypoints relative to the pelvis.
bool others_around_origin(const MarkerClip& clip, std::size_t marker) {
  for (std::size_t frame = 0; frame < clip.positions.size(); ++frame) {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    double squares = 0;
    double count = 0;
    for (std::size_t m = 0; m < clip.markers.size(); ++m) {
      if (m != marker && clip.seen[frame][m]) {
        const Eigen::RowVector3d place = clip.positions[frame].row(static_cast<Index>(m));
        sum += place;
        squares += place.squaredNorm();
        ++count;
      }
    }
    if (count > 1) {
      const double middle = (sum / count).squaredNorm();
      if (!(middle < squares / count - middle)) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace

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
  std::vector<bool> ever(count, false);  // seen
  for (std::size_t frame = 0; frame < clip.positions.size(); ++frame) {
    for (std::size_t m = 0; m < count; ++m) {
      ever[m] = ever[m] || clip.seen[frame][m];
      elsewhere[m] = elsewhere[m] || (clip.seen[frame][m] && !at_origin(frame, m));
    }
  }
  std::vector<std::size_t> always;
  for (std::size_t m = 0; m < count; ++m) {
    if (ever[m] && !elsewhere[m]) {
      always.push_back(m);
    }
  }
  if (always.size() == 1) {
    elsewhere[always[0]] = !others_around_origin(clip, always[0]);
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
