#include "capture/explain_rig.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "capture/camera_conventions.h"
#include "capture/camera_readings.h"
#include "capture/check_cameras.h"
#include "capture/sentence.h"
#include "core/median.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr double kFits = 12;         // px of an image 1000 rows high: no detector is further off
constexpr std::size_t kSample = 10;  // frames that a reading of all cameras is tried on

SeenPerson some_frames(const SeenPerson& seen) {
  SeenPerson some = seen;
  some.frame_ids.clear();
  some.detections.clear();
  const std::size_t step = std::max<std::size_t>(1, seen.detections.size() / kSample);
  for (std::size_t f = 0; f < seen.detections.size(); f += step) {
    some.frame_ids.push_back(seen.frame_ids[f]);
    some.detections.push_back(seen.detections[f]);
  }
  return some;
}

SeenPerson all_read_as(const SeenPerson& seen, const Reading& reading) {
  SeenPerson meant = seen;
  for (std::size_t c = 0; c < seen.cameras.size(); ++c) {
    meant.cameras[c] = camera_read_as(seen.cameras[c], seen.world_convention, reading);
    for (auto& frame : meant.detections) {
      frame[c] = rows_read_as(frame[c], seen, seen.cameras[c], reading);
    }
  }
  return meant;
}

/// Cameras apart from each other that look at one place, with lenses that there are: some wrong
/// readings make rays meet by putting all cameras into one.
bool is_stage(const std::vector<Camera>& cameras) {
  const std::vector<Finding> findings = check_cameras(cameras);
  return std::none_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.code == "camera-twins" || finding.code == "camera-focal" ||
           finding.code == "cameras-apart";
  });
}

SeenPerson some_read_as(const SeenPerson& seen, const Reading& reading,
                        const std::vector<std::size_t>& cameras) {
  SeenPerson meant = seen;
  for (const std::size_t c : cameras) {
    meant.cameras[c] = camera_read_as(seen.cameras[c], seen.world_convention, reading);
    for (auto& frame : meant.detections) {
      frame[c] = rows_read_as(frame[c], seen, seen.cameras[c], reading);
    }
  }
  return meant;
}

/// Cameras whose distortion, or whose other intrinsics, are doubted by themselves.
std::vector<std::size_t> doubted_cameras(const std::vector<Camera>& cameras, bool distortion) {
  const std::vector<Finding> findings = check_cameras(cameras);
  std::vector<std::size_t> doubted;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (std::any_of(findings.begin(), findings.end(), [&](const Finding& finding) {
          return finding.place == cameras[c].id && finding.severity != Severity::Note &&
                 finding.code.starts_with("camera-") &&
                 (finding.code == "camera-distortion") == distortion &&
                 finding.code != "camera-looks-away" && finding.code != "camera-twins";
        })) {
      doubted.push_back(c);
    }
  }
  return doubted;
}

/// The few cameras that need a reading of the lens which makes all fit: where it does as well read
/// of one camera, or of those alone whose own numbers are doubted. None where it is of the rig.
std::vector<std::size_t> few_that_need(const SeenPerson& some, const Reading& reading,
                                       const RigFit& of_all, const TriangulationOptions& options) {
  constexpr std::size_t kTried = 12;  // cameras, one by one
  // Of cameras whose own numbers are none of a lens less is asked: read of all, errors are alike
  // and agree with each other.
  constexpr double kAsMany[] = {0.02, 0.15};
  constexpr double kAsLittle[] = {1.02, 1.5};
  const bool of_lens = reading.option == "distortion" || reading.option == "intrinsics";
  if (!of_lens || some.cameras.size() < 3) {
    return {};
  }
  const std::vector<std::size_t> doubted =
      doubted_cameras(some.cameras, reading.option == "distortion");
  std::vector<std::vector<std::size_t>> sets;
  if (!doubted.empty()) {
    sets = {doubted};
  }
  for (std::size_t c = 0; doubted.empty() && c < some.cameras.size() && c < kTried; ++c) {
    sets.push_back({c});
  }
  if (2 * doubted.size() > some.cameras.size() ||
      (doubted.empty() && some.cameras.size() > kTried)) {
    return {};
  }
  for (const std::vector<std::size_t>& cameras : sets) {
    const RigFit fit = rig_fit(some_read_as(some, reading, cameras), options);
    const std::size_t row = doubted.empty() ? 0 : 1;
    if (fit.share > of_all.share - kAsMany[row] && fit.error < kAsLittle[row] * of_all.error) {
      return cameras;
    }
  }
  return {};
}

/// The same of cameras by their places.
Finding finding_of_few(const Reading& reading, const std::vector<std::size_t>& cameras,
                       const SeenPerson& some, const RigFit& now,
                       const TriangulationOptions& options) {
  const RigFit then = rig_fit(some_read_as(some, reading, cameras), options);
  std::string setting;
  std::string ids;
  for (const std::size_t c : cameras) {
    const std::string& id = some.cameras[c].id;
    setting += setting.empty() ? setting_of(reading.option, id, reading.value)
                               : "," + id + "=" + std::string(reading.value);
    ids += (ids.empty() ? "" : ", ") + id;
  }
  const bool one = cameras.size() == 1;
  const std::vector<std::size_t> doubted = doubted_cameras(some.cameras, true);
  const bool no_lens = reading.value == "none" &&
                       std::find(doubted.begin(), doubted.end(), cameras[0]) != doubted.end();
  std::string what(no_lens ? "its distortion is no lens's, and is left out" : reading.what);
  if (!one) {
    what.replace(what.find("its"), 3, "each camera's");
    what = ids + " alone: " + what;
  }
  return {
      Severity::Error,
      std::string(reading.code),
      one ? ids : "",
      what + ": of the detections of all cameras " + fit_text(now) + ", agree, then " +
          fit_text(then),
      one ? "read it so, or calibrate this camera again" : "read these so, or calibrate them again",
      setting};
}

Finding finding_of_all(const Reading& reading, const RigFit& now, const RigFit& then) {
  std::string what(reading.what);
  what.replace(what.find("its"), 3, "each camera's");  // "its ...", "x and y of its ..."
  return {Severity::Error,
          std::string(reading.code),
          "",
          what + ": of the detections " + fit_text(now) + ", agree, then " + fit_text(then),
          "read all cameras so, or rewrite the files",
          setting_of(reading.option, "all", reading.value)};
}

}  // namespace

std::string fit_text(const RigFit& fit) {
  return fit.share > 0
             ? percent(fit.share) + ", with " + short_number(fit.error, 3) + " px of error"
             : "none";
}

int agreeing_views(const SeenPerson& seen, std::size_t frame, std::size_t point,
                   const SpacePoint& place, double most) {
  int agreeing = 0;
  const auto row = static_cast<Index>(point);
  for (std::size_t c = 0; c < seen.cameras.size() && place.confidence > 0; ++c) {
    const Keypoints2d& rows = seen.detections[frame][c];
    if (rows.rows() == 0 || rows(row, 2) <= kConfidentDetection) {
      continue;
    }
    const auto pixel = project(seen.cameras[c], place.place);
    agreeing += pixel && (*pixel - rows.row(row).head<2>().transpose()).norm() * 1000 <=
                             most * seen.cameras[c].height
                    ? 1
                    : 0;
  }
  return agreeing;
}

RigFit rig_fit(const SeenPerson& seen, const TriangulationOptions& options) {
  TriangulationOptions plain = options;
  plain.swaps = false;
  plain.bridge = 0;
  plain.distances = false;
  const Triangulation found =
      triangulate(seen.cameras, seen.detections, *seen.schema, seen.fps, plain);
  RigFit fit;
  double supporting = 0;
  double asked = 0;
  for (std::size_t f = 0; f < found.frames.size(); ++f) {
    for (std::size_t k = 0; k < seen.schema->points.size(); ++k) {
      const SpacePoint& point = found.frames[f].points[k];
      fit.points.push_back(point.confidence > 0 && !point.bridged ? point.error : -1);
      const int views = confident_views(seen.detections[f], k);
      if (views < options.min_views) {
        fit.unsupported.push_back(-1);
        continue;
      }
      // Two of many views always meet somewhere: what counts is how many do.
      const int agree = agreeing_views(seen, f, k, point, options.inlier);
      fit.unsupported.push_back(1 - static_cast<double>(agree) / views);
      supporting += agree;
      asked += views;
    }
  }
  fit.share = asked > 0 ? supporting / asked : 0;
  fit.error = median(found.camera_error);
  return fit;
}

bool loses_centre(const Camera& before, const Camera& after) {
  const auto off = [](const Camera& camera) {
    return std::max(std::abs(camera.cx / camera.width - 0.5),
                    std::abs(camera.cy / camera.height - 0.5));
  };
  constexpr double kFar = 0.2;
  return off(after) > kFar && off(before) <= kFar;
}

std::optional<Finding> explain_all(const SeenPerson& seen, const TriangulationOptions& options) {
  const SeenPerson some = some_frames(seen);
  const RigFit now = rig_fit(some, options);
  std::optional<Finding> best;
  Reading of_best;
  RigFit least;
  least.share = 0;
  const auto offer = [&](const Reading& reading, const SeenPerson& meant) {
    const RigFit fit = rig_fit(meant, options);
    constexpr double kMeet = 0.8;
    constexpr double kMore = 0.1;
    const bool better = fit.share > least.share + 0.03 ||
                        (fit.share > least.share - 0.03 && fit.error < 0.9 * least.error);
    if (fit.share > kMeet && fit.share > now.share + kMore && fit.error < kFits && better &&
        surely_less(fit.unsupported, now.unsupported)) {
      least = fit;
      best = finding_of_all(reading, now, fit);
      of_best = reading.option == "turned" ? Reading{} : reading;  // whose texts are gone then
    }
  };
  for (const Reading& reading : all_readings()) {
    if (reading.alone) {
      continue;
    }
    const SeenPerson meant = all_read_as(some, reading);
    if (is_stage(meant.cameras) && !loses_centre(some.cameras[0], meant.cameras[0])) {
      offer(reading, meant);
    }
  }
  const bool square =
      std::all_of(some.cameras.begin(), some.cameras.end(),
                  [](const Camera& camera) { return camera.width == camera.height; });
  for (const int quarters : {2, 1, 3}) {
    if (quarters != 2 && !square) {
      continue;
    }
    SeenPerson meant = some;
    for (Camera& camera : meant.cameras) {
      camera = turned_camera(camera, quarters);
    }
    const std::string degrees = std::to_string(90 * quarters);
    const std::string what =
        "its images were turned by " + degrees + " degrees clockwise since the calibration";
    offer({"turned", degrees, "camera-turned", what}, meant);
  }
  for (const Reading& reading : turned_keypoint_readings()) {
    offer(reading, all_read_as(some, reading));
  }
  if (best) {
    const std::vector<std::size_t> few = few_that_need(some, of_best, least, options);
    return few.empty() ? best : finding_of_few(of_best, few, some, now, options);
  }
  return best;
}

std::optional<Finding> explain_distortion(const SeenPerson& seen,
                                          const TriangulationOptions& options) {
  const SeenPerson some = some_frames(seen);
  const RigFit now = rig_fit(some, options);
  const Reading straight{"distortion", "none", "", ""};
  const RigFit none = rig_fit(all_read_as(some, straight), options);
  std::optional<Finding> best;
  Reading of_best;
  RigFit then;
  constexpr double kBetter = 0.93;
  double least = kBetter * now.error;
  for (const Reading& reading : all_readings()) {
    if (reading.option != "distortion") {
      continue;
    }
    const RigFit fit = rig_fit(all_read_as(some, reading), options);
    // Numbers that are read rightly are better than no numbers: else what is less wrong by less
    // distortion would do.
    const bool earned = reading.value == straight.value ||
                        (fit.error < none.error && surely_less(fit.points, none.points));
    if (fit.error < least && fit.share >= now.share && surely_less(fit.points, now.points) &&
        earned) {
      least = fit.error;
      best = finding_of_all(reading, now, fit);
      of_best = reading;
      then = fit;
    }
  }
  if (best) {
    const std::vector<std::size_t> few = few_that_need(some, of_best, then, options);
    return few.empty() ? best : finding_of_few(of_best, few, some, now, options);
  }
  return best;
}

std::optional<CommonShift> common_shift(const SeenPerson& seen, const Triangulation& found) {
  // Detection = projection + J dX + s: dX is eliminated point by point (Schur complement), s is
  // what all have in common. Far detections are left out.
  struct Sums {
    Eigen::Matrix2d matrix = Eigen::Matrix2d::Zero();
    Eigen::Vector2d vector = Eigen::Vector2d::Zero();
  };
  std::vector<Sums> of_camera(seen.cameras.size());
  int count = 0;
  struct View {
    std::size_t camera;
    Eigen::Matrix<double, 2, 3> jacobian;
    Eigen::Vector2d off;
  };
  for (std::size_t f = 0; f < found.frames.size(); ++f) {
    for (std::size_t k = 0; k < found.frames[f].points.size(); ++k) {
      const SpacePoint& point = found.frames[f].points[k];
      if (point.confidence <= 0 || point.bridged || point.views < 3) {
        continue;
      }
      std::vector<View> views;
      for (std::size_t c = 0; c < seen.cameras.size(); ++c) {
        const Keypoints2d& rows = seen.detections[f][c];
        const auto row = static_cast<Index>(k);
        if (rows.rows() == 0 || rows(row, 2) < kConfidentDetection) {
          continue;
        }
        const auto pixel = project(seen.cameras[c], point.place);
        const auto jacobian = project_jacobian(seen.cameras[c], point.place);
        if (!pixel || !jacobian) {
          continue;
        }
        const Eigen::Vector2d off = rows.row(row).head<2>().transpose() - *pixel;
        constexpr double kFar = 10;
        if (off.norm() * 1000 / seen.cameras[c].height <= kFar) {
          views.push_back({c, *jacobian, off});
        }
      }
      if (views.size() < 3) {
        continue;
      }
      Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
      Eigen::Matrix<double, 3, 2> mixed = Eigen::Matrix<double, 3, 2>::Zero();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
      for (const View& view : views) {
        normal += view.jacobian.transpose() * view.jacobian;
        mixed += view.jacobian.transpose();
        right += view.jacobian.transpose() * view.off;
      }
      const Eigen::Matrix3d inverse = normal.inverse();
      for (const View& view : views) {
        Sums& sums = of_camera[view.camera];
        sums.matrix += Eigen::Matrix2d::Identity() - view.jacobian * inverse * mixed;
        sums.vector += view.off - view.jacobian * inverse * right;
      }
      count += static_cast<int>(views.size());
    }
  }
  Sums all;
  int cameras = 0;
  for (const Sums& sums : of_camera) {
    all.matrix += sums.matrix;
    all.vector += sums.vector;
    cameras += sums.matrix.trace() > 0 ? 1 : 0;
  }
  constexpr int kFew = 200;
  constexpr int kFewCameras = 6;
  const Eigen::Matrix2d inverse = all.matrix.inverse();
  if (count < kFew || cameras < kFewCameras || !inverse.allFinite()) {
    return std::nullopt;
  }
  CommonShift common;
  common.shift = inverse * all.vector;
  // Each calibration is a little off by itself: what counts is how much the cameras differ, not how
  // many points each has (the sandwich of errors that are alike within a camera).
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const Sums& sums : of_camera) {
    const Eigen::Vector2d left = sums.vector - sums.matrix * common.shift;
    scatter += left * left.transpose();
  }
  const Eigen::Matrix2d covariance =
      inverse * scatter * inverse.transpose() * (cameras / (cameras - 1.0));
  common.deviation = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  return common;
}

}  // namespace atelier
