#include "capture/explain_cameras.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "capture/camera_conventions.h"
#include "capture/camera_readings.h"
#include "capture/explain_rig.h"
#include "capture/refit_pose.h"
#include "capture/sentence.h"
#include "core/median.h"

namespace atelier {
namespace {

/// Times the usual error of a camera whose detections fit: one that counts less is held against
/// points that the others alone made, and fits them less well than those do.
constexpr double kFitsAlone = 2.5;

struct Window {
  int begin = 0;
  int end = 0;
};

/// Errors, px at 1000 rows, of a camera's detections in a window against the person `shift` frames
/// later, [frames x K]; negative: not known.
std::vector<double> point_errors(const Camera& camera, const SeenPerson& seen, std::size_t c,
                                 const Triangulation& found, const Window& window, int shift = 0,
                                 const Reading* reading = nullptr) {
  constexpr int kEnough = 100;  // frames
  const int step = std::max(1, (window.end - window.begin) / kEnough);
  const std::size_t points = seen.schema->points.size();
  std::vector<double> errors;
  for (int f = std::max(window.begin, 0); f < window.end; f += step) {
    errors.resize(errors.size() + points, -1);
    const int then = f + shift;
    if (then < 0 || then >= static_cast<int>(found.frames.size())) {
      continue;
    }
    const SpacePose& pose = found.frames[static_cast<std::size_t>(then)];
    const Keypoints2d& as_read = seen.detections[static_cast<std::size_t>(f)][c];
    const Keypoints2d rows =
        reading == nullptr ? as_read : rows_read_as(as_read, seen, camera, *reading);
    for (Index k = 0; k < rows.rows(); ++k) {
      const SpacePoint& point = pose.points[static_cast<std::size_t>(k)];
      if (rows(k, 2) < kConfidentDetection || point.confidence <= 0 || point.bridged) {
        continue;
      }
      const auto pixel = project(camera, point.place);
      errors[errors.size() - points + static_cast<std::size_t>(k)] =
          pixel
              ? std::min((*pixel - rows.row(k).head<2>().transpose()).norm() * 1000 / camera.height,
                         kNowhere)
              : kNowhere;
    }
  }
  return errors;
}

/// Of those that are known; 0: too few.
double median_error(std::vector<double> errors, std::size_t few = 30) {
  std::erase_if(errors, [](double error) { return error < 0; });
  return errors.size() < few ? 0 : median(std::move(errors));
}

/// Median error of each frame against the person `shift` frames later; negative: too little seen.
std::vector<double> frame_errors(const SeenPerson& seen, std::size_t c, const Triangulation& found,
                                 int shift) {
  constexpr std::size_t kFew = 5;
  std::vector<double> all;
  for (int f = 0; f < static_cast<int>(found.frames.size()); ++f) {
    const double error =
        median_error(point_errors(seen.cameras[c], seen, c, found, {f, f + 1}, shift), kFew);
    all.push_back(error > 0 ? error : -1);
  }
  return all;
}

/// The frames later at which a camera's images fit best, and the errors.
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
  const std::vector<double> now = point_errors(seen.cameras[c], seen, c, found, used);
  Step best;
  best.now = best.then = median_error(now);
  for (int shift = -longest; shift <= longest; ++shift) {
    const std::vector<double> then = point_errors(seen.cameras[c], seen, c, found, used, shift);
    const double error = median_error(then);
    if (error > 0 && error < best.then && surely_less(then, now)) {
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
  const double fits = std::max(kFitsAlone * usual, 1.0);
  if (all.frames != 0 && first.frames == last.frames && all.then < fits) {
    return Finding{
        Severity::Error,
        "camera-out-of-sync",
        id,
        sentence("its image of a frame fits %d frames %s (error %.3g px, then %.3g)",
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
                   sentence("up to about there its images fit %d frames later, then %d: frames "
                            "were dropped or repeated",
                            first.frames, last.frames),
                   "number its frames by the recorder's time stamps, or leave it out",
                   "--capture.leave-out " + id};
  }
  return std::nullopt;
}

/// Whether from another pose a camera would see the person of a window where it found it, within an
/// error.
bool fits_elsewhere(const SeenPerson& seen, std::size_t c, const Triangulation& found,
                    const Window& window, double error) {
  std::vector<Sighting> sightings;
  for (int f = window.begin; f < window.end; ++f) {
    const Keypoints2d& rows = seen.detections[static_cast<std::size_t>(f)][c];
    for (Index k = 0; k < rows.rows(); ++k) {
      const SpacePoint& point =
          found.frames[static_cast<std::size_t>(f)].points[static_cast<std::size_t>(k)];
      if (rows(k, 2) >= kConfidentDetection && point.confidence > 0 && !point.bridged) {
        sightings.push_back({point.place, rows.row(k).head<2>().transpose()});
      }
    }
  }
  const Camera moved = refit_pose(seen.cameras[c], sightings);
  const std::vector<double> now = point_errors(seen.cameras[c], seen, c, found, window);
  const std::vector<double> then = point_errors(moved, seen, c, found, window);
  const double left = median_error(then);
  return left > 0 && left < error && surely_less(then, now);
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
    if (a > 0 && b > 0 && std::min(a, b) < kFitsAlone * usual &&
        std::max(a, b) / std::min(a, b) > most) {
      most = std::max(a, b) / std::min(a, b);
      best = split;
      before = a;
      after = b;
    }
  }
  // Errors change from frame to frame for other reasons too: of a camera that was moved, another
  // pose explains the part that does not fit as well as the first explains the other.
  const Window part_off = before > after ? Window{0, best} : Window{best, frames};
  if (best == 0 ||
      !fits_elsewhere(seen, c, found, part_off, 1.6 * std::max(std::min(before, after), usual))) {
    return std::nullopt;
  }
  const std::string& id = seen.cameras[c].id;
  return Finding{
      Severity::Error,
      "camera-moved",
      id + " frame " + std::to_string(seen.frame_ids[static_cast<std::size_t>(best)]),
      sentence("its error is %.3g px before, %.3g px from there on: it was moved", before, after),
      "calibrate both parts apart, or leave it out",
      "--capture.leave-out " + id};
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
  const std::vector<double> as_read = point_errors(seen.cameras[c], seen, c, found, all);
  Explanation best;
  const auto offer = [&](const std::vector<double>& errors, Finding finding) {
    const double error = median_error(errors);
    // The first explanation is likelier, and wins where it is about as good.
    if (error > 0 && error < 0.5 * now && error < std::max(kFitsAlone * usual, 1.0) &&
        error < 0.9 * best.error && surely_less(errors, as_read)) {
      finding.what += sentence(" (error %.3g px, then %.3g)", std::min(now, 999.0), error);
      best = {error, std::move(finding)};
    }
  };
  for (const Reading& reading : all_readings()) {
    const Camera camera = camera_read_as(seen.cameras[c], seen.world_convention, reading);
    if (loses_centre(seen.cameras[c], camera)) {
      continue;
    }
    offer(point_errors(camera, seen, c, found, all, 0, &reading),
          {Severity::Error, std::string(reading.code), id, std::string(reading.what),
           "read it so, or rewrite its file", setting_of(reading.option, id, reading.value)});
  }
  for (const int quarters : {2, 1, 3}) {
    const std::string degrees = std::to_string(90 * quarters);
    if (quarters == 2 || seen.cameras[c].width == seen.cameras[c].height) {
      offer(point_errors(turned_camera(seen.cameras[c], quarters), seen, c, found, all),
            {Severity::Error, "camera-turned", id,
             "its images were turned by " + degrees + " degrees clockwise since the calibration",
             "read them so, or write them as they were calibrated",
             setting_of("turned", id, degrees)});
    }
  }
  for (const Reading& reading : turned_keypoint_readings()) {
    offer(point_errors(seen.cameras[c], seen, c, found, all, 0, &reading),
          {Severity::Error, std::string(reading.code), id, std::string(reading.what),
           "read them so", setting_of(reading.option, id, reading.value)});
  }
  for (std::size_t d = 0; d < seen.cameras.size(); ++d) {
    if (d != c) {
      offer(point_errors(seen.cameras[d], seen, c, found, all),
            {Severity::Error, "camera-mislabelled", id,
             "its images are those of the calibration of " + seen.cameras[d].id,
             "give it that calibration, or rename its folder",
             setting_of("calibration_of", id, seen.cameras[d].id)});
    }
  }
  return best;
}

}  // namespace

std::vector<Finding> explain_cameras(const SeenPerson& seen, const Triangulation& found) {
  const Window all{0, static_cast<int>(found.frames.size())};
  std::vector<double> errors;
  for (std::size_t c = 0; c < seen.cameras.size(); ++c) {
    errors.push_back(median_error(point_errors(seen.cameras[c], seen, c, found, all)));
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
           sentence("reprojection error %.3g px, %.3g in the median camera", std::min(now, 999.0),
                    usual),
           "it was moved or badly calibrated and counts less; calibrate it again or leave it out",
           "--capture.leave-out " + seen.cameras[c].id});
    }
  }
  return findings;
}

}  // namespace atelier
