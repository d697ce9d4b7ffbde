#include "pipeline/person/track_pictures.h"

#include <algorithm>
#include <vector>

#include "core/render/drawing.h"
#include "pipeline/pictures/report_drawings.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/pictures/report_plots.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// How well each frame of each tracked sequence is founded.
std::string track_plots(const fs::path& result) {
  const fs::path folder = result / "tracked";
  std::string html;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const TrackedMotion tracked = read_tracked_motion(entry.path());
    const auto series = [](const Eigen::VectorXd& values, double scale) {
      const Eigen::VectorXd scaled = scale * values;
      return std::vector<double>(scaled.data(), scaled.data() + scaled.size());
    };
    const std::vector<int>& ids = tracked.motion.frame_ids;
    const std::string svg =
        plots_svg({{"standard deviation of joints, mm", ids,
                    series(tracked.deviations.rowwise().mean(), 1e3)},
                   {"keypoints, mm rms", ids, series(tracked.keypoint_rms, 1e3),
                    scaled_limit(kTrackFigures, "keypoint_rms", 1e3)},
                   {"scan, mm rms", ids, series(tracked.scan_rms, 1e3)},
                   {"share of the scan that counted", ids, series(tracked.scan_share, 1)}});
    html += svg.empty()
                ? ""
                : "<figure>" + svg + "<figcaption>" + html_text(entry.path().stem().string()) +
                      " over frames</figcaption></figure>\n";
  }
  return html;
}

/// Bones, red in frames that are not trusted.
Image with_bones(const Camera& camera, const TrackedMotion& motion, int id, const Image& picture) {
  const auto row = static_cast<std::size_t>(
      std::find(motion.motion.frame_ids.begin(), motion.motion.frame_ids.end(), id) -
      motion.motion.frame_ids.begin());
  const double unit = camera.height / 480.0;
  std::vector<Mark> marks;
  for (std::size_t j = 1; j < motion.skeleton.parents.size(); ++j) {
    const auto a = project(camera, motion.joints[row].row(motion.skeleton.parents[j]).transpose());
    const auto b = project(camera, motion.joints[row].row(static_cast<Index>(j)).transpose());
    if (a && b) {
      marks.emplace_back(Polyline{.points = {*a, *b},
                                  .color = motion.trusted[row] != 0
                                               ? Eigen::Vector3f(0.1F, 0.9F, 0.2F)
                                               : Eigen::Vector3f(0.9F, 0.1F, 0.05F),
                                  .width = 2.2 * unit});
      marks.emplace_back(Circle{.center = *b, .radius = 2.6 * unit, .color = {1, 0.8F, 0}});
    }
  }
  return drawn(picture, marks);
}

}  // namespace

std::string track_pictures(const StageStatus& own, const ReportPlaces& places) {
  return front_pictures(places, "The skeleton", with_bones) +
         track_plots(result_folder_of(own, places));
}

}  // namespace atelier
