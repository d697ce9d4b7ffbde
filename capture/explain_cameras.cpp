#include "capture/explain_cameras.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "capture/camera_conventions.h"
#include "capture/camera_readings.h"
#include "capture/check_cameras.h"
#include "capture/sentence.h"
#include "core/median.h"

namespace atelier {
namespace {

constexpr double kFits = 12;         // px of a picture 1000 rows high: no detector is further off
constexpr double kNowhere = 1000;    // px: of a point that has no place in the picture
constexpr double kConfident = 0.3;   // of detections that are asked
constexpr std::size_t kSample = 10;  // frames that a reading of all cameras is tried on

Camera camera_read_as(const Camera& camera, const FileWorld& world, const Reading& reading) {
  return reading.option == "keypoints"
             ? camera
             : in_our_world(read_as(in_file_world(camera, world), reading.option, reading.value),
                            world);
}

Keypoints2d rows_read_as(const Keypoints2d& rows, const SeenPerson& seen, const Camera& camera,
                         const Reading& reading) {
  return reading.option == "keypoints"
             ? read_as(rows, keypoint_reading(reading.value, camera.width, camera.height),
                       *seen.schema, camera.width, camera.height)
             : rows;
}

std::string setting_of(std::string_view option, const std::string& camera, std::string_view value) {
  return "--capture." + std::string(option) + " " + camera + "=" + std::string(value);
}

/// How well all cameras fit together.
struct Fit {
  double error = kNowhere;          ///< px at 1000 rows, median camera
  double share = 0;                 ///< of the points that two cameras detect, that meet in space
  std::vector<double> points = {};  ///< px [frames x K]: error of each that met, else negative
};

Fit fit_of(const SeenPerson& seen, const TriangulationOptions& options) {
  TriangulationOptions plain = options;
  plain.swaps = false;
  plain.bridge = 0;
  const Triangulation found =
      triangulate(seen.cameras, seen.detections, *seen.schema, seen.fps, plain);
  Fit fit;
  double met = 0;
  double wanted = 0;
  for (std::size_t f = 0; f < found.frames.size(); ++f) {
    for (std::size_t k = 0; k < seen.schema->points.size(); ++k) {
      int views = 0;
      for (const Keypoints2d& rows : seen.detections[f]) {
        views += rows.rows() > 0 && rows(static_cast<Index>(k), 2) > kConfident ? 1 : 0;
      }
      if (views >= options.least_views) {
        wanted += 1;
        // Two of many views always meet somewhere; a point is one where half of them do.
        met += 2 * found.frames[f].points[k].views >= views ? 1 : 0;
      }
      const SpacePoint& point = found.frames[f].points[k];
      fit.points.push_back(point.confidence > 0 && !point.bridged ? point.error : -1);
    }
  }
  fit.share = wanted > 0 ? met / wanted : 0;
  fit.error = median(found.camera_error);
  return fit;
}

/// Whether the points' errors are less by more than chance makes them: the mean of the differences
/// is beyond four of its standard deviations.
bool surely_less(const std::vector<double>& then, const std::vector<double>& now) {
  constexpr double kDeviations = 4;
  constexpr int kFew = 30;
  double sum = 0;
  double squares = 0;
  int count = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i] >= 0 && then[i] >= 0) {
      const double less = now[i] - then[i];
      sum += less;
      squares += less * less;
      ++count;
    }
  }
  // The sum of differences that are as often for as against deviates by the root of their squares.
  return count >= kFew && sum > kDeviations * std::sqrt(squares);
}

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
    meant.cameras[c] = camera_read_as(seen.cameras[c], seen.file_world, reading);
    for (auto& frame : meant.detections) {
      frame[c] = rows_read_as(frame[c], seen, seen.cameras[c], reading);
    }
  }
  return meant;
}

/// Intrinsics of half the size and detections of twice the size make the same rays: the one that
/// leaves the principal point near the middle is meant.
bool loses_centre(const Camera& before, const Camera& after) {
  const auto off = [](const Camera& camera) {
    return std::max(std::abs(camera.cx / camera.width - 0.5),
                    std::abs(camera.cy / camera.height - 0.5));
  };
  constexpr double kFar = 0.2;
  return off(after) > kFar && off(before) <= kFar;
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

Finding finding_of_all(const Reading& reading, const Fit& now, const Fit& then) {
  std::string what(reading.what);
  what.replace(0, 3, "each camera's");  // "its ..."
  return {Severity::Error,
          std::string(reading.code),
          "",
          what + sentence(": %.0f%% of the keypoints meet in space with %.1f px of error, then "
                          "%.0f%% with %.1f",
                          100 * now.share, now.error, 100 * then.share, then.error),
          "read all cameras so, or write the files anew",
          setting_of(reading.option, "all", reading.value)};
}

struct Window {
  int begin = 0;
  int end = 0;
};

/// Errors, px at 1000 rows, of a camera's detections in one frame against the person of another.
void append_errors(const Camera& camera, const Keypoints2d& rows, const SpacePose& pose,
                   std::vector<double>& errors) {
  for (Index k = 0; k < rows.rows(); ++k) {
    const SpacePoint& point = pose.points[static_cast<std::size_t>(k)];
    if (rows(k, 2) < kConfident || point.confidence <= 0 || point.bridged) {
      continue;
    }
    const auto pixel = project(camera, point.place);
    errors.push_back(pixel ? (*pixel - rows.row(k).head<2>().transpose()).norm() * 1000 /
                                 camera.height
                           : kNowhere);
  }
}

/// Median error of a camera's detections against the person `shift` frames later, over frames
/// begin <= f < end, or a hundred of them. 0: too little was seen.
double error_of(const Camera& camera, const SeenPerson& seen, std::size_t c,
                const Triangulation& found, const Window& window, int shift = 0,
                const Reading* reading = nullptr) {
  constexpr int kEnough = 100;
  std::vector<double> errors;
  const int step = std::max(1, (window.end - window.begin) / kEnough);
  for (int f = std::max(window.begin, 0); f < window.end; f += step) {
    const int then = f + shift;
    if (then < 0 || then >= static_cast<int>(found.frames.size())) {
      continue;
    }
    const Keypoints2d& rows = seen.detections[static_cast<std::size_t>(f)][c];
    append_errors(camera, reading == nullptr ? rows : rows_read_as(rows, seen, camera, *reading),
                  found.frames[static_cast<std::size_t>(then)], errors);
  }
  constexpr std::size_t kFew = 30;
  return errors.size() < kFew ? 0 : median(std::move(errors));
}

/// Median error of each frame against the person `shift` frames later; negative: too little seen.
std::vector<double> frame_errors(const SeenPerson& seen, std::size_t c, const Triangulation& found,
                                 int shift) {
  std::vector<double> all(found.frames.size(), -1);
  for (std::size_t f = 0; f < all.size(); ++f) {
    const int then = static_cast<int>(f) + shift;
    if (then >= 0 && then < static_cast<int>(all.size())) {
      std::vector<double> errors;
      append_errors(seen.cameras[c], seen.detections[f][c],
                    found.frames[static_cast<std::size_t>(then)], errors);
      constexpr std::size_t kFew = 5;
      all[f] = errors.size() < kFew ? -1 : median(std::move(errors));
    }
  }
  return all;
}

/// The frames later at which a camera's pictures fit best, and the errors.
struct Step {
  int frames = 0;
  double now = 0;
  double then = 0;
};

Step best_step(const SeenPerson& seen, std::size_t c, const Triangulation& found,
               const Window& window) {
  const auto frames = static_cast<int>(found.frames.size());
  const int longest = std::min(15, (window.end - window.begin) / 3);
  // The same frames for every shift, where there are enough of them.
  const Window inner{std::max(window.begin, longest), std::min(window.end, frames - longest)};
  const Window& used = inner.end - inner.begin >= 5 ? inner : window;
  Step best;
  best.now = best.then = error_of(seen.cameras[c], seen, c, found, used);
  for (int shift = -longest; shift <= longest; ++shift) {
    const double error = error_of(seen.cameras[c], seen, c, found, used, shift);
    if (error > 0 && error < best.then) {
      best.then = error;
      best.frames = shift;
    }
  }
  if (!(best.then < 0.7 * best.now) || !(best.now - best.then > 1)) {
    best.frames = 0;
    best.then = best.now;
  }
  return best;
}

std::optional<Finding> explain_time(const SeenPerson& seen, std::size_t c,
                                    const Triangulation& found, double usual) {
  const auto frames = static_cast<int>(found.frames.size());
  if (frames < 12) {
    return std::nullopt;
  }
  const std::string& id = seen.cameras[c].id;
  const Step all = best_step(seen, c, found, {0, frames});
  const Step first = best_step(seen, c, found, {0, frames / 2});
  const Step last = best_step(seen, c, found, {frames / 2, frames});
  // A step explains a camera only if it then fits as well as the others.
  const double fits = std::max(1.6 * usual, 1.0);
  if (all.frames != 0 && first.frames == last.frames && all.then < fits) {
    return Finding{
        Severity::Error,
        "camera-out-of-sync",
        id,
        sentence("its picture of a frame fits %d frames %s (error %.1f px, then %.1f)",
                 std::abs(all.frames), all.frames > 0 ? "later" : "earlier", all.now, all.then),
        sentence("shift its frames by %d", all.frames),
        setting_of("sync", id, std::to_string(all.frames))};
  }
  if (first.frames != last.frames && first.then < fits && last.then < fits) {
    // The frame from which the later step fits better than the earlier one.
    int best = frames / 2;
    double least = 1e300;
    const std::vector<double> early = frame_errors(seen, c, found, first.frames);
    const std::vector<double> late = frame_errors(seen, c, found, last.frames);
    for (int split = 2; split + 2 < frames; ++split) {
      double sum = 0;
      for (int f = 0; f < frames; ++f) {
        sum += std::max(0.0, f < split ? early[static_cast<std::size_t>(f)]
                                       : late[static_cast<std::size_t>(f)]);
      }
      if (sum < least) {
        least = sum;
        best = split;
      }
    }
    return Finding{Severity::Error,
                   "camera-drops-frames",
                   id + " frame " + std::to_string(seen.frame_ids[static_cast<std::size_t>(best)]),
                   sentence("up to about there its pictures fit %d frames later, then %d: frames "
                            "were dropped or repeated",
                            first.frames, last.frames),
                   "number its frames by the recorder's time stamps, or leave it out",
                   "--capture.leave_out " + id};
  }
  return std::nullopt;
}

std::optional<Finding> explain_move(const SeenPerson& seen, std::size_t c,
                                    const Triangulation& found, double usual) {
  const auto frames = static_cast<int>(found.frames.size());
  constexpr int kLeast = 3;
  const std::vector<double> of_frame = frame_errors(seen, c, found, 0);
  const auto part = [&](int begin, int end) {
    std::vector<double> errors(of_frame.begin() + begin, of_frame.begin() + end);
    std::erase_if(errors, [](double error) { return error < 0; });
    return errors.size() < kLeast ? 0 : median(std::move(errors));
  };
  int best = 0;
  double most = 2.5;  // times the error of the other part
  double before = 0;
  double after = 0;
  for (int split = kLeast; split + kLeast <= frames; ++split) {
    const double a = part(0, split);
    const double b = part(split, frames);
    if (a > 0 && b > 0 && std::min(a, b) < 1.5 * usual && std::max(a, b) / std::min(a, b) > most) {
      most = std::max(a, b) / std::min(a, b);
      best = split;
      before = a;
      after = b;
    }
  }
  if (best == 0) {
    return std::nullopt;
  }
  const std::string& id = seen.cameras[c].id;
  return Finding{
      Severity::Error,
      "camera-moved",
      id + " frame " + std::to_string(seen.frame_ids[static_cast<std::size_t>(best)]),
      sentence("its error is %.1f px before, %.1f px from there on: it was moved", before, after),
      "calibrate both parts apart, or leave it out",
      "--capture.leave_out " + id};
}

/// The best of all other calibrations and readings.
struct Explanation {
  double error = kNowhere;
  std::optional<Finding> finding;
};

Explanation explain_calibration(const SeenPerson& seen, std::size_t c, const Triangulation& found,
                                double now, double usual) {
  const Window all{0, static_cast<int>(found.frames.size())};
  const std::string& id = seen.cameras[c].id;
  Explanation best;
  const auto offer = [&](double error, Finding finding) {
    // What is asked first is likelier, and wins where it is about as good.
    if (error > 0 && error < 0.5 * now && error < std::max(2.5 * usual, 1.0) &&
        error < 0.9 * best.error) {
      finding.what += sentence(" (error %.1f px, then %.1f)", std::min(now, 999.0), error);
      best = {error, std::move(finding)};
    }
  };
  for (const Reading& reading : all_readings()) {
    const Camera camera = camera_read_as(seen.cameras[c], seen.file_world, reading);
    if (loses_centre(seen.cameras[c], camera)) {
      continue;
    }
    offer(error_of(camera, seen, c, found, all, 0, &reading),
          {Severity::Error, std::string(reading.code), id, std::string(reading.what),
           "read it so, or write its file anew", setting_of(reading.option, id, reading.value)});
  }
  for (std::size_t d = 0; d < seen.cameras.size(); ++d) {
    if (d != c) {
      offer(error_of(seen.cameras[d], seen, c, found, all),
            {Severity::Error, "camera-mislabelled", id,
             "its pictures are those of the calibration of " + seen.cameras[d].id,
             "give it that calibration, or rename its folder",
             setting_of("calibration_of", id, seen.cameras[d].id)});
    }
  }
  return best;
}

}  // namespace

std::optional<Finding> explain_all(const SeenPerson& seen, const TriangulationOptions& options) {
  const SeenPerson some = some_frames(seen);
  const Fit now = fit_of(some, options);
  std::optional<Finding> best;
  Fit least;
  least.share = 0;
  for (const Reading& reading : all_readings()) {
    if (reading.alone) {
      continue;
    }
    const SeenPerson meant = all_read_as(some, reading);
    if (!is_stage(meant.cameras) || loses_centre(some.cameras[0], meant.cameras[0])) {
      continue;
    }
    const Fit fit = fit_of(meant, options);
    constexpr double kMeet = 0.8;
    constexpr double kMore = 0.1;
    const bool better = fit.share > least.share + 0.03 ||
                        (fit.share > least.share - 0.03 && fit.error < 0.9 * least.error);
    if (fit.share > kMeet && fit.share > now.share + kMore && fit.error < kFits && better) {
      least = fit;
      best = finding_of_all(reading, now, fit);
    }
  }
  return best;
}

std::optional<Finding> explain_distortion(const SeenPerson& seen,
                                          const TriangulationOptions& options) {
  const SeenPerson some = some_frames(seen);
  const Fit now = fit_of(some, options);
  std::optional<Finding> best;
  constexpr double kBetter = 0.93;
  double least = kBetter * now.error;
  for (const Reading& reading : all_readings()) {
    if (reading.option == "distortion") {
      const Fit fit = fit_of(all_read_as(some, reading), options);
      if (fit.error < least && fit.share >= now.share && surely_less(fit.points, now.points)) {
        least = fit.error;
        best = finding_of_all(reading, now, fit);
      }
    }
  }
  return best;
}

std::vector<Finding> explain_cameras(const SeenPerson& seen, const Triangulation& found) {
  const Window all{0, static_cast<int>(found.frames.size())};
  std::vector<double> errors;
  for (std::size_t c = 0; c < seen.cameras.size(); ++c) {
    errors.push_back(error_of(seen.cameras[c], seen, c, found, all));
  }
  std::vector<double> known = errors;
  std::erase(known, 0.0);
  const double usual = std::max(median(known), 0.1);
  std::vector<Finding> findings;
  for (std::size_t c = 0; c < seen.cameras.size(); ++c) {
    const double now = errors[c];
    if (now <= 0) {
      continue;
    }
    // Of few cameras some always agree by chance: there triangulate asks each against the others.
    constexpr std::size_t kFew = 6;
    const bool named = seen.cameras.size() > kFew || now > 100 ||
                       std::any_of(found.findings.begin(), found.findings.end(),
                                   [&](const Finding& f) { return f.place == seen.cameras[c].id; });
    const bool off = named && now > 2 * usual && now - usual > 1;
    if (const auto time = explain_time(seen, c, found, usual)) {
      findings.push_back(*time);
      continue;
    }
    if (off) {
      if (const auto explained = explain_calibration(seen, c, found, now, usual).finding) {
        findings.push_back(*explained);
        continue;
      }
    }
    const auto move = explain_move(seen, c, found, usual);
    if (move) {
      findings.push_back(*move);
    } else if (off) {
      findings.push_back(
          {Severity::Warning, "camera-off", seen.cameras[c].id,
           sentence("reprojection error %.1f px, %.1f in the median camera", std::min(now, 999.0),
                    usual),
           "it was moved or badly calibrated and counts less; calibrate it again or leave it out",
           "--capture.leave_out " + seen.cameras[c].id});
    }
  }
  return findings;
}

std::optional<CommonShift> common_shift(const SeenPerson& seen, const Triangulation& found) {
  // Detection = projection + J dX + s: dX is eliminated point by point (Schur complement), s is
  // what all have in common. Far detections are left out.
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Zero();
  Eigen::Vector2d vector = Eigen::Vector2d::Zero();
  double squares = 0;
  int count = 0;
  for (std::size_t f = 0; f < found.frames.size(); ++f) {
    for (std::size_t k = 0; k < found.frames[f].points.size(); ++k) {
      const SpacePoint& point = found.frames[f].points[k];
      if (point.confidence <= 0 || point.bridged || point.views < 3) {
        continue;
      }
      Eigen::Matrix3d points = Eigen::Matrix3d::Zero();
      Eigen::Matrix<double, 2, 3> mixed = Eigen::Matrix<double, 2, 3>::Zero();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
      Eigen::Vector2d sum = Eigen::Vector2d::Zero();
      int views = 0;
      for (std::size_t c = 0; c < seen.cameras.size(); ++c) {
        const Keypoints2d& rows = seen.detections[f][c];
        const auto row = static_cast<Index>(k);
        if (rows.rows() == 0 || rows(row, 2) < kConfident) {
          continue;
        }
        const auto pixel = project(seen.cameras[c], point.place);
        const auto jacobian = project_jacobian(seen.cameras[c], point.place);
        if (!pixel || !jacobian) {
          continue;
        }
        const Eigen::Vector2d off = rows.row(row).head<2>().transpose() - *pixel;
        constexpr double kFar = 10;
        if (off.norm() * 1000 / seen.cameras[c].height > kFar) {
          continue;
        }
        points += jacobian->transpose() * *jacobian;
        mixed += *jacobian;
        right += jacobian->transpose() * off;
        sum += off;
        squares += off.squaredNorm();
        ++views;
      }
      if (views < 3) {
        continue;
      }
      const Eigen::Matrix3d inverse = points.inverse();
      matrix += views * Eigen::Matrix2d::Identity() - mixed * inverse * mixed.transpose();
      vector += sum - mixed * inverse * right;
      count += views;
    }
  }
  constexpr int kFew = 200;
  if (count < kFew) {
    return std::nullopt;
  }
  const Eigen::Matrix2d inverse = matrix.inverse();
  if (!inverse.allFinite()) {
    return std::nullopt;
  }
  CommonShift common;
  common.shift = inverse * vector;
  common.deviation = (inverse.diagonal().cwiseMax(0) * (squares / (2.0 * count))).cwiseSqrt();
  return common;
}

}  // namespace atelier
