#pragma once

#include <string>
#include <vector>

#include "core/finding.h"
#include "core/types.h"

namespace atelier {

/// Points over time, each with a name: markers on a body or keypoints of a detector.
struct MarkerClip {
  std::string name;
  std::vector<std::string> markers;  ///< [M] unique, as in the file: "LASI", "Ada:LASI"
  double fps = 0;                    ///< frames per second
  double metres_per_unit = 1;        ///< of the file's own unit, as its header says
  std::vector<int> frame_ids;        ///< [N] increasing
  std::vector<Points> positions;     ///< [N] of [M,3] metres, axes as in the file; 0 where unseen
  std::vector<std::vector<bool>> seen;  ///< [N][M]
  std::vector<Finding> findings;        ///< guesses and repairs of the reader
};

/// The subject of a marker, which stands before the last colon of its name: "Ada" of "Ada:LASI";
/// "" where there is none.
std::string marker_subject(const std::string& marker);

/// Takes for unseen what stands at exactly (0, 0, 0), with a finding ("motion-markers-zero"), as
/// many programs write markers that they lost: a marker that is elsewhere in another frame, all of
/// several that are there at once, and one that is there throughout while the others are not around
/// it. One that the others are always around is left: keypoints may be relative to it.
void lose_markers_at_origin(MarkerClip& clip);

}  // namespace atelier
