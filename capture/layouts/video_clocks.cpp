#include "capture/layouts/video_clocks.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "capture/video_times.h"
#include "core/error.h"
#include "core/io/text_writer.h"

namespace atelier {
namespace {

struct VideoClock {
  std::string camera;
  VideoPace pace;
};

/// To three digits behind the point.
std::string shown_number(double value) {
  return number_text(std::round(1000 * value) / 1000);
}

Finding of_rates(const VideoClock& clock, const VideoClock& first) {
  return {
      Severity::Warning, "video-rates", clock.camera,
      shown_number(clock.pace.fps) + " images a second, those of " + first.camera + " are " +
          shown_number(first.pace.fps) + "; frames of one number are of other instants",
      "write all videos at one rate before anything is detected in them: ffmpeg -i IN -fps_mode "
      "cfr -r " +
          shown_number(first.pace.fps) + " -c:v libx264 -crf 12 OUT.mp4"};
}

Finding of_start(const VideoClock& clock, const VideoClock& first) {
  const double late = clock.pace.start - first.pace.start;
  const std::string frames = number_text(std::round(late * first.pace.fps));
  return {Severity::Warning, "video-start", clock.camera,
          "its file begins with a pause: the first image is shown " + shown_number(late) +
              " s later than that of " + first.camera + "; frames are numbered without it",
          "if the files begin at one instant, --capture.sync " + clock.camera + "=" + frames +
              " keeps the pause (images and keypoints move by " + frames + " frames)"};
}

}  // namespace

std::vector<Finding> compare_video_clocks(const Dataset& dataset, const Limits& limits) {
  std::vector<Finding> findings;
  std::vector<VideoClock> clocks;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const FrameLocations& images = dataset.frames[c].images;
    const DataLocation place = images.empty() ? DataLocation{} : images.begin()->second;
    if (place.index < 0 || !place.member.empty()) {
      continue;
    }
    try {
      if (const auto times = read_video_times(place.file, limits)) {
        clocks.push_back({dataset.cameras[c].id, video_pace(*times)});
        const std::vector<Finding> more = video_findings(*times, dataset.cameras[c].id);
        findings.insert(findings.end(), more.begin(), more.end());
      }
    } catch (const DataError&) {
      continue;
    }
  }
  const auto first = std::min_element(
      clocks.begin(), clocks.end(),
      [](const VideoClock& a, const VideoClock& b) { return a.pace.start < b.pace.start; });
  for (const VideoClock& clock : clocks) {
    constexpr double kSame = 0.005;  // of rates; 29.97 and 30 are apart by 0.001
    if (first->pace.fps > 0 && std::abs(clock.pace.fps / first->pace.fps - 1) > kSame) {
      findings.push_back(of_rates(clock, *first));
    }
    if ((clock.pace.start - first->pace.start) * first->pace.fps >= 0.5 &&
        !dataset.corrections.contains("sync")) {
      findings.push_back(of_start(clock, *first));
    }
  }
  return findings;
}

}  // namespace atelier
