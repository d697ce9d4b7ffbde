#include "capture/check_keypoints.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "capture/keypoint_schema.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr double kWorstError = 12;  // px of a picture 1000 rows high: no detector is so far off
constexpr int kLongestShift = 5;    // frames by which a camera may be out of step

using Frames = std::vector<std::vector<Keypoints2d>>;

template <class... Values>
std::string sentence(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

double median(std::vector<double> values) {
  if (values.empty()) {
    return 0;
  }
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

void check_rows(const Dataset& dataset, const Frames& detections, std::vector<Finding>& findings) {
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const Camera& camera = dataset.cameras[c];
    double outside = 0;
    double found = 0;
    double wrong = 0;
    for (const auto& frame : detections) {
      for (Index k = 0; k < frame[c].rows(); ++k) {
        const double confidence = frame[c](k, 2);
        wrong += confidence < 0 || confidence > 1.2 ? 1 : 0;
        if (confidence > 0.2) {
          found += 1;
          outside += frame[c](k, 0) < 0 || frame[c](k, 1) < 0 || frame[c](k, 0) > camera.width ||
                             frame[c](k, 1) > camera.height
                         ? 1
                         : 0;
        }
      }
    }
    if (found == 0) {
      findings.push_back({Severity::Warning, "keypoints-none", camera.id,
                          "no confident keypoint in any frame", "does it see the person?"});
    } else if (outside > 0.05 * found) {
      findings.push_back({Severity::Error, "keypoints-outside", camera.id,
                          sentence("%.0f%% of the confident points lie outside the picture",
                                   100 * outside / found),
                          "are they of pictures of another size, or in shares of it?"});
    }
    if (wrong > 0) {
      findings.push_back({Severity::Warning, "keypoint-confidence", camera.id,
                          "confidences outside 0 to 1", "what do they mean?"});
    }
  }
}

std::optional<double> length_of(const SpacePose& pose, const KeypointSchema& schema,
                                const char* from, const char* to) {
  const int a = find_keypoint(schema, from);
  const int b = find_keypoint(schema, to);
  if (a < 0 || b < 0 || pose.points[static_cast<std::size_t>(a)].confidence <= 0 ||
      pose.points[static_cast<std::size_t>(b)].confidence <= 0) {
    return std::nullopt;
  }
  return (pose.points[static_cast<std::size_t>(a)].place -
          pose.points[static_cast<std::size_t>(b)].place)
      .norm();
}

/// Median over the frames; 0: never found.
double usual_length(const Triangulation& found, const KeypointSchema& schema, const char* from,
                    const char* to) {
  std::vector<double> lengths;
  for (const SpacePose& pose : found.frames) {
    if (const auto length = length_of(pose, schema, from, to)) {
      lengths.push_back(*length);
    }
  }
  return median(std::move(lengths));
}

void check_person(const Triangulation& found, const KeypointSchema& schema,
                  std::vector<Finding>& findings) {
  const double thigh = usual_length(found, schema, "left_hip", "left_knee");
  const double shin = usual_length(found, schema, "left_knee", "left_ankle");
  const double arm = usual_length(found, schema, "left_shoulder", "left_elbow");
  const double fore = usual_length(found, schema, "left_elbow", "left_wrist");
  if (thigh <= 0 || shin <= 0) {
    return;
  }
  const double leg = thigh + shin;
  const auto odd = [](double ratio, double most) { return ratio > most || ratio < 1 / most; };
  if (odd(thigh / shin, 2) ||
      (arm > 0 && fore > 0 && (odd(arm / fore, 2) || odd(leg / (arm + fore), 2.5)))) {
    findings.push_back({Severity::Error, "keypoint-order", "",
                        sentence("thigh %.2f, shin %.2f, upper arm %.2f, forearm %.2f m are no "
                                 "person's",
                                 thigh, shin, arm, fore),
                        "is the order of the keypoints another? --keypoint_schema says which"});
  } else if (leg < 0.35 || leg > 1.3) {
    findings.push_back({Severity::Error, "person-size", "", sentence("hip to ankle is %.3g m", leg),
                        leg > 100  ? "is the calibration in millimetres? --metres_per_unit 0.001"
                        : leg > 10 ? "is the calibration in centimetres? --metres_per_unit 0.01"
                                   : "which unit is the calibration in? --metres_per_unit says"});
  }
}

/// Median error of a camera against the poses `shift` frames later.
double shifted_error(const Camera& camera, const Frames& detections, std::size_t c,
                     const Triangulation& found, int shift) {
  std::vector<double> errors;
  const auto frames = static_cast<int>(found.frames.size());
  for (int f = kLongestShift; f < frames - kLongestShift; ++f) {
    const Keypoints2d& rows = detections[static_cast<std::size_t>(f)][c];
    const int then = f + shift;
    const SpacePose& pose = found.frames[static_cast<std::size_t>(then)];
    for (Index k = 0; k < rows.rows(); ++k) {
      const SpacePoint& point = pose.points[static_cast<std::size_t>(k)];
      if (rows(k, 2) < 0.3 || point.confidence <= 0 || point.bridged) {
        continue;
      }
      if (const auto pixel = project(camera, point.place)) {
        errors.push_back((*pixel - rows.row(k).head<2>().transpose()).norm() * 1000 /
                         camera.height);
      }
    }
  }
  return errors.size() < 50 ? 0 : median(std::move(errors));
}

void check_sync(const std::vector<Camera>& cameras, const Frames& detections,
                const Triangulation& found, std::vector<Finding>& findings) {
  if (static_cast<int>(found.frames.size()) < 3 * kLongestShift) {
    return;
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const double now = shifted_error(cameras[c], detections, c, found, 0);
    int best = 0;
    double least = now;
    for (int shift = -kLongestShift; shift <= kLongestShift; ++shift) {
      const double error = shifted_error(cameras[c], detections, c, found, shift);
      if (error > 0 && error < least) {
        least = error;
        best = shift;
      }
    }
    if (best != 0 && least < 0.7 * now && now - least > 1) {
      findings.push_back({Severity::Error, "camera-out-of-sync", cameras[c].id,
                          sentence("its picture of a frame fits %d frames %s (error %.1f px, then "
                                   "%.1f)",
                                   std::abs(best), best > 0 ? "later" : "earlier", now, least),
                          sentence("shift its frames by %d", best)});
    }
  }
}

}  // namespace

std::vector<std::vector<Keypoints2d>> main_person(FrameReader& reader,
                                                  const std::vector<int>& frames) {
  const Dataset& dataset = reader.dataset();
  Frames all;
  for (const int frame : frames) {
    std::vector<Keypoints2d>& views = all.emplace_back(dataset.cameras.size(), Keypoints2d(0, 3));
    for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
      double most = 0;
      for (const PersonKeypoints& person : reader.keypoints(static_cast<Index>(c), frame)) {
        const double sum = person.points.col(2).sum();
        if (sum > most) {
          most = sum;
          views[c] = person.points;
        }
      }
    }
  }
  return all;
}

std::vector<Finding> check_keypoints(FrameReader& reader, const TriangulationOptions& options) {
  const Dataset& dataset = reader.dataset();
  std::vector<Finding> findings;
  bool any = false;
  for (const CameraFrames& frames : dataset.frames) {
    any = any || !frames.keypoints.empty();
  }
  if (!any || !dataset.calibrated) {
    return findings;
  }
  const KeypointSchema& schema = keypoint_schema(dataset.info.keypoint_schema);
  const Frames detections = main_person(reader, frame_ids(dataset));
  for (const auto& frame : detections) {
    for (const Keypoints2d& rows : frame) {
      if (rows.rows() != 0 && rows.rows() != static_cast<Index>(schema.points.size())) {
        findings.push_back({Severity::Error, "keypoint-count", dataset.root.string(),
                            sentence("%d points, %s has %zu", static_cast<int>(rows.rows()),
                                     schema.name.c_str(), schema.points.size()),
                            "--keypoint_schema says which order they are in"});
        return findings;
      }
    }
  }
  check_rows(dataset, detections, findings);
  if (dataset.cameras.size() < 2 || detections.empty()) {
    return findings;
  }
  const double fps =
      dataset.info.sequences.empty() ? 30 : std::max(dataset.info.sequences[0].fps, 1.0);
  const Triangulation found = triangulate(dataset.cameras, detections, schema, fps, options);
  std::vector<double> errors = found.camera_error;
  const double usual = median(std::move(errors));
  int seen = 0;
  double wanted = 0;  // points that enough cameras have found
  for (std::size_t f = 0; f < found.frames.size(); ++f) {
    for (std::size_t k = 0; k < schema.points.size(); ++k) {
      int views = 0;
      for (const Keypoints2d& rows : detections[f]) {
        views += rows.rows() > 0 && rows(static_cast<Index>(k), 2) > 0.3 ? 1 : 0;
      }
      if (views >= options.least_views) {
        const SpacePoint& point = found.frames[f].points[k];
        wanted += 1;
        seen += point.confidence > 0 && !point.bridged ? 1 : 0;
      }
    }
  }
  if (wanted < 20) {
    return findings;
  }
  if (usual > kWorstError || seen < 0.2 * wanted) {
    findings.push_back({Severity::Error, "calibration-error", "",
                        sentence("%.0f%% of the keypoints meet in space, with %.1f px of error",
                                 100 * seen / wanted, usual),
                        "are calibration and pictures of the same day, size and layout? is the "
                        "distortion in OpenCV's order?"});
    return findings;
  }
  findings.insert(findings.end(), found.findings.begin(), found.findings.end());
  check_person(found, schema, findings);
  check_sync(dataset.cameras, detections, found, findings);
  return findings;
}

}  // namespace atelier
