#include <cstdio>

#include "bodymodel/formats/motion_trc.h"
#include "bodymodel/formats/portable_names.h"
#include "bodymodel/kinematics.h"
#include "core/atomic_file.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr const char* kTrcKeys =
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
    "OrigNumFrames\n";

void check_marker_sizes(const MarkerClip& clip) {
  const std::size_t frames = clip.positions.size();
  ATELIER_CHECK(!clip.markers.empty() && frames > 0 && clip.fps > 0,
                "a TRC has markers, frames and a rate");
  ATELIER_CHECK(clip.frame_ids.size() == frames && clip.seen.size() == frames,
                "a number, places and what was seen for each frame");
  for (std::size_t f = 0; f < frames; ++f) {
    ATELIER_CHECK(std::cmp_equal(clip.positions[f].rows(), clip.markers.size()) &&
                      clip.seen[f].size() == clip.markers.size(),
                  "a place for each marker");
  }
}

std::string trc_header(const MarkerClip& clip) {
  const std::string frames = std::to_string(clip.positions.size());
  char rate[40];
  std::snprintf(rate, sizeof rate, "%.10g", clip.fps);
  std::string text = "PathFileType\t4\t(X/Y/Z)\t" + portable_names({clip.name})[0] + ".trc\n" +
                     kTrcKeys + rate + "\t" + rate + "\t" + frames + "\t" +
                     std::to_string(clip.markers.size()) + "\tm\t" + rate + "\t1\t" + frames +
                     "\nFrame#\tTime";
  std::string axes = "\t";
  for (std::size_t m = 0; m < clip.markers.size(); ++m) {
    const std::string number = std::to_string(m + 1);
    text += m == 0 ? "\t" : "\t\t\t";
    text += clip.markers[m];
    for (const char* axis : {"\tX", "\tY", "\tZ"}) {
      axes += axis;
      axes += number;
    }
  }
  return text + "\t\t\n" + axes + "\n\n";
}

}  // namespace

MarkerClip joint_markers(const MotionClip& clip) {
  MarkerClip markers;
  markers.name = clip.name;
  markers.markers = portable_names(clip.skeleton.names);
  markers.fps = clip.motion.fps;
  markers.frame_ids = clip.motion.frame_ids;
  for (const Pose& pose : clip.motion.poses) {
    markers.positions.push_back(forward_kinematics(clip.skeleton, pose).positions);
    markers.seen.emplace_back(markers.markers.size(), true);
  }
  return markers;
}

std::string trc_text(const MarkerClip& clip) {
  check_marker_sizes(clip);
  std::string text = trc_header(clip);
  char cell[64];
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    const int passed = clip.frame_ids[f] - clip.frame_ids.front();
    std::snprintf(cell, sizeof cell, "%d\t%.6f", passed + 1, passed / clip.fps);
    text += cell;
    for (std::size_t m = 0; m < clip.markers.size(); ++m) {
      for (int axis = 0; axis < 3; ++axis) {
        // OpenSim's older readers skip empty cells and then miss their number.
        if (clip.seen[f][m]) {
          std::snprintf(cell, sizeof cell, "\t%.6f",
                        clip.positions[f](static_cast<Index>(m), axis));
          text += cell;
        } else {
          text += "\tNaN";
        }
      }
    }
    text += "\n";
  }
  return text;
}

void write_trc(const std::filesystem::path& path, const MarkerClip& clip) {
  write_file_atomically(path, trc_text(clip));
}

}  // namespace atelier
