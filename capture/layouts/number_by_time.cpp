#include "capture/layouts/number_by_time.h"

#include <algorithm>
#include <cmath>

#include "capture/sentence.h"
#include "core/median.h"

namespace atelier {
namespace {

using Stamped = std::vector<StampedFiles>;

/// Stamps in a second, by the digits of one.
double stamps_in_a_second(std::int64_t stamp) {
  const double digits =
      std::floor(std::log10(static_cast<double>(std::max<std::int64_t>(1, stamp)))) + 1;
  return digits < 12 ? 1 : digits < 15 ? 1e3 : digits < 18 ? 1e6 : 1e9;
}

/// Median time from one file of a camera to the next; 0: no camera has two.
double interval_of(const Stamped& stamped) {
  std::vector<double> gaps;
  for (const StampedFiles& camera : stamped) {
    for (std::size_t i = 1; i < camera.files.size(); ++i) {
      gaps.push_back(static_cast<double>(camera.files[i].stamp - camera.files[i - 1].stamp));
    }
  }
  return median(std::move(gaps));
}

/// The first stamp of each frame.
std::vector<std::int64_t> times_of(const Stamped& stamped, double interval) {
  std::vector<std::int64_t> all;
  for (const StampedFiles& camera : stamped) {
    for (const StampedFiles::File& file : camera.files) {
      all.push_back(file.stamp);
    }
  }
  std::sort(all.begin(), all.end());
  std::vector<std::int64_t> times;
  for (const std::int64_t stamp : all) {
    if (times.empty() || static_cast<double>(stamp - times.back()) > 0.5 * interval) {
      times.push_back(stamp);
    }
  }
  return times;
}

/// The frame nearest in time; -1: none within half an interval.
int frame_at(const std::vector<std::int64_t>& times, std::int64_t stamp, double interval) {
  auto after = std::lower_bound(times.begin(), times.end(), stamp);
  if (after == times.end() ||
      (after != times.begin() && stamp - *std::prev(after) <= *after - stamp)) {
    --after;
  }
  const double off = std::abs(static_cast<double>(stamp - *after));
  return off <= 0.5 * interval ? static_cast<int>(after - times.begin()) : -1;
}

}  // namespace

void number_by_time(Dataset& dataset, FrameLocations CameraFrames::*kind, const Stamped& stamped,
                    const std::string& place) {
  const bool any = std::any_of(stamped.begin(), stamped.end(),
                               [](const StampedFiles& camera) { return !camera.files.empty(); });
  if (!any) {
    return;
  }
  if (dataset.frame_times.empty()) {
    dataset.frame_interval = interval_of(stamped);
    dataset.frame_times = times_of(stamped, dataset.frame_interval);
    const double second = stamps_in_a_second(dataset.frame_times.front());
    const double fps = dataset.frame_interval > 0 ? second / dataset.frame_interval : 0;
    if (dataset.info.sequences.empty() && fps > 0) {
      dataset.info.sequences.push_back({"capture", "clothed", fps, {}});
    }
    dataset.findings.push_back(
        {Severity::Note, "frames-by-time", place,
         sentence("files are named by time stamps: %zu frames are numbered from 0 by them, "
                  "%.4g a second",
                  dataset.frame_times.size(), fps),
         "nothing, if that is the frame rate; --capture.fps says it otherwise"});
  }
  for (std::size_t c = 0; c < stamped.size(); ++c) {
    for (const auto& [stamp, name] : stamped[c].files) {
      const int frame = frame_at(dataset.frame_times, stamp, dataset.frame_interval);
      if (frame >= 0) {
        (dataset.frames[c].*kind).add(frame, {stamped[c].folder / name, "", -1});
      }
    }
  }
}

}  // namespace atelier
