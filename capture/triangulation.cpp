#include "capture/triangulation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "capture/keep_distances.h"
#include "core/error.h"
#include "core/median.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr double kMinAngle = 0.052;    // rad between the rays of a pair that starts a point
constexpr double kRobustSigmas = 4.5;  // where the weight of a detection is a quarter
constexpr double kOffFactor = 2;       // times the others' median error: the camera is named

/// How far a detector's points are off, by the confidence that it gives them. Heat maps are sharp
/// where a joint is seen and blurred under cloth, and what a confidence stands for differs between
/// detectors: the sequence itself tells.
struct DetectorError {
  std::vector<double> confidences;  ///< rising; none: nothing was measured
  std::vector<double> sigmas;       ///< px of an image 1000 rows high
};

/// @param sigma  px of a confident detection where nothing was measured
double error_at(const DetectorError& error, double confidence, double sigma) {
  if (error.sigmas.empty()) {  // a detector's confident points are its good ones
    return sigma / std::sqrt(confidence);
  }
  const auto above =
      std::upper_bound(error.confidences.begin(), error.confidences.end(), confidence);
  if (above == error.confidences.begin()) {
    return error.sigmas.front();
  }
  if (above == error.confidences.end()) {
    return error.sigmas.back();
  }
  const auto i = static_cast<std::size_t>(above - error.confidences.begin());
  const double low = error.confidences[i - 1];
  const double t = (confidence - low) / (error.confidences[i] - low);
  return (1 - t) * error.sigmas[i - 1] + t * error.sigmas[i];
}

/// One camera's view of a keypoint.
struct ViewRay {
  std::size_t camera;
  Eigen::Vector2d pixel;
  double confidence;
  double sigma;   // px of this camera
  double inlier;  // px
  double robust;  // px, scale of the weights
  Eigen::Vector3d origin, direction;
};

double rows_factor(const Camera& camera) {
  return camera.height / 1000.0;
}

std::vector<ViewRay> sightings_of(const std::vector<Camera>& cameras, const Keypoints2d& detections,
                                  const TriangulationOptions& options,
                                  const std::vector<double>& scale, const DetectorError& error) {
  std::vector<ViewRay> all;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const auto row = static_cast<Index>(i);
    const double confidence = detections(row, 2);
    if (!(confidence >= options.min_confidence) || confidence <= 0) {
      continue;
    }
    const Eigen::Vector2d pixel(detections(row, 0), detections(row, 1));
    const auto direction = ray_direction(cameras[i], pixel);
    if (!direction) {
      continue;
    }
    const double factor = rows_factor(cameras[i]) * (scale.empty() ? 1 : scale[i]);
    const double sigma = error_at(error, std::min(confidence, 1.0), options.sigma) * factor;
    // Blurred points are given the room that they need: a narrow weight would leave few of them.
    const double inlier = options.inlier * factor;
    const double robust = error.sigmas.empty()
                              ? 0.5 * inlier
                              : std::clamp(kRobustSigmas * sigma, 0.3 * inlier, 3 * inlier);
    all.push_back({i, pixel, std::min(confidence, 1.0), sigma, std::max(inlier, 2 * robust), robust,
                   camera_center(cameras[i]), *direction});
  }
  return all;
}

/// Middle of the shortest line between two rays; nothing where they are nearly parallel or meet
/// behind a camera.
std::optional<Eigen::Vector3d> between(const ViewRay& a, const ViewRay& b) {
  const double cosine = a.direction.dot(b.direction);
  const double sine2 = 1 - cosine * cosine;
  if (sine2 < kMinAngle * kMinAngle) {
    return std::nullopt;
  }
  const Eigen::Vector3d offset = b.origin - a.origin;
  const double s = (offset.dot(a.direction) - offset.dot(b.direction) * cosine) / sine2;
  const double t = (offset.dot(a.direction) * cosine - offset.dot(b.direction)) / sine2;
  if (s <= 0 || t <= 0) {
    return std::nullopt;
  }
  return 0.5 * (a.origin + s * a.direction + b.origin + t * b.direction);
}

std::optional<Eigen::Vector2d> residual(const std::vector<Camera>& cameras, const ViewRay& sighting,
                                        const Eigen::Vector3d& place) {
  const auto pixel = project(cameras[sighting.camera], place);
  if (!pixel) {
    return std::nullopt;
  }
  return *pixel - sighting.pixel;
}

/// Support of a place: each sighting adds up to its confidence.
double support(const std::vector<Camera>& cameras, const std::vector<ViewRay>& sightings,
               const Eigen::Vector3d& place) {
  double sum = 0;
  for (const ViewRay& sighting : sightings) {
    const auto off = residual(cameras, sighting, place);
    if (off && off->norm() < sighting.inlier) {
      const double share = off->squaredNorm() / (sighting.inlier * sighting.inlier);
      sum += sighting.confidence * (1 - share);
    }
  }
  return sum;
}

/// Geman-McClure: full weight near, none far.
double robust_weight(double squared_error, double scale) {
  const double x = 1 + squared_error / (scale * scale);
  return 1 / (x * x);
}

struct Normal {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
};

Normal normal_equations(const std::vector<Camera>& cameras, const std::vector<ViewRay>& sightings,
                        const Eigen::Vector3d& place, bool robust) {
  Normal normal;
  for (const ViewRay& sighting : sightings) {
    const auto off = residual(cameras, sighting, place);
    const auto jacobian = project_jacobian(cameras[sighting.camera], place);
    if (!off || !jacobian || (!robust && off->norm() >= sighting.inlier)) {
      continue;
    }
    const double weight = (robust ? robust_weight(off->squaredNorm(), sighting.robust) : 1) /
                          (sighting.sigma * sighting.sigma);
    normal.matrix += weight * jacobian->transpose() * *jacobian;
    normal.vector -= weight * jacobian->transpose() * *off;
  }
  return normal;
}

/// The best of all pairs.
std::optional<Eigen::Vector3d> first_place(const std::vector<Camera>& cameras,
                                           const std::vector<ViewRay>& sightings) {
  std::optional<Eigen::Vector3d> best;
  double most = 0;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    for (std::size_t j = i + 1; j < sightings.size(); ++j) {
      const auto place = between(sightings[i], sightings[j]);
      if (!place) {
        continue;
      }
      const double sum = support(cameras, sightings, *place);
      if (sum > most) {
        most = sum;
        best = place;
      }
    }
  }
  return best;
}

}  // namespace

OptionTable describe(TriangulationOptions& options) {
  OptionTable table;
  table.add("min_confidence", options.min_confidence, 0, 1, "",
            "Minimum confidence of a detection that is used");
  table.add("sigma", options.sigma, 1e-3, 100, "px",
            "Standard deviation of a confident detection in an image 1000 rows high");
  table.add("inlier", options.inlier, 1e-3, 1000, "px",
            "Maximum reprojection error of an inlier in an image 1000 rows high");
  table.add("min_views", options.min_views, 2, 1000, "",
            "Minimum number of views that support a point");
  table.add("swaps", options.swaps, "Correction of left and right swapped within an image");
  table.add("distances", options.distances,
            "Constant lengths of bones, feet and heads over a sequence");
  table.add("bridge", options.bridge, 0, 10, "s",
            "Duration of the longest gap that is interpolated, and flagged so");
  return table;
}

SpacePoint triangulated(const std::vector<Camera>& cameras, const Keypoints2d& detections,
                        const TriangulationOptions& options, const std::vector<double>& scale,
                        const DetectorError& error) {
  ATELIER_CHECK(detections.rows() == static_cast<Index>(cameras.size()), "a row for each camera");
  ATELIER_CHECK(scale.empty() || scale.size() == cameras.size(), "a scale for each camera");
  const std::vector<ViewRay> sightings = sightings_of(cameras, detections, options, scale, error);
  const auto start = first_place(cameras, sightings);
  if (!start) {
    return {};
  }
  Eigen::Vector3d place = *start;
  constexpr int kMaxSteps = 20;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Normal normal = normal_equations(cameras, sightings, place, true);
    const Eigen::Vector3d move = normal.matrix.ldlt().solve(normal.vector);
    if (!move.allFinite() || move.norm() > 1) {
      break;
    }
    place += move;
    if (move.norm() < 1e-6) {
      break;
    }
  }
  SpacePoint point;
  point.place = place;
  double squares = 0;
  double in_sigmas = 0;
  for (const ViewRay& sighting : sightings) {
    const auto off = residual(cameras, sighting, place);
    if (off && off->norm() < sighting.inlier) {
      ++point.views;
      squares += off->squaredNorm();
      in_sigmas += off->squaredNorm() / (sighting.sigma * sighting.sigma);
      point.confidence += sighting.confidence;
    }
  }
  if (point.views < options.min_views) {
    return {};
  }
  point.confidence /= point.views;
  point.error = std::sqrt(squares / point.views);
  // Two views leave one number to judge by, three leave three, ...
  const double freedom = std::max(1, 2 * point.views - 3);
  const Normal normal = normal_equations(cameras, sightings, place, false);
  point.covariance = normal.matrix.inverse() * std::max(1.0, in_sigmas / freedom);
  if (!point.covariance.allFinite()) {
    return {};
  }
  return point;
}

SpacePoint triangulate_point(const std::vector<Camera>& cameras, const Keypoints2d& detections,
                             const TriangulationOptions& options,
                             const std::vector<double>& scale) {
  return triangulated(cameras, detections, options, scale, {});
}

namespace {

using Frames = std::vector<std::vector<Keypoints2d>>;

/// Points that a detector swaps together.
struct Limbs {
  std::vector<std::vector<int>> groups;
};

Limbs limbs_of(const KeypointSchema& schema) {
  constexpr std::array kArms = {"shoulder", "elbow", "wrist"};
  constexpr std::array kLegs = {"hip", "knee", "ankle", "heel", "big_toe", "small_toe"};
  Limbs limbs;
  const auto group = [&](const auto& names) {
    std::vector<int> rows;
    for (const char* name : names) {
      const int row = find_keypoint(schema, std::string("left_") + name);
      if (row >= 0) {
        rows.push_back(row);
      }
    }
    if (!rows.empty()) {
      limbs.groups.push_back(rows);
    }
  };
  group(kArms);
  group(kLegs);
  return limbs;
}

Keypoints2d of_point(const std::vector<Keypoints2d>& cameras, Index row) {
  Keypoints2d detections = Keypoints2d::Zero(static_cast<Index>(cameras.size()), 3);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (cameras[i].rows() > row) {
      detections.row(static_cast<Index>(i)) = cameras[i].row(row);
    }
  }
  return detections;
}

SpacePose pose_of(const std::vector<Camera>& cameras, const std::vector<Keypoints2d>& detections,
                  Index count, const TriangulationOptions& options,
                  const std::vector<double>& scale, const DetectorError& error) {
  SpacePose pose;
  for (Index k = 0; k < count; ++k) {
    pose.points.push_back(triangulated(cameras, of_point(detections, k), options, scale, error));
  }
  return pose;
}

/// Robust cost of an image's limb against the points in space, as it is and mirrored.
struct SwapCosts {
  double as_is = 0;
  double mirrored = 0;
  int points = 0;
};

SwapCosts swap_costs(const Camera& camera, const Keypoints2d& detections, const SpacePose& pose,
                     const KeypointSchema& schema, const std::vector<int>& group,
                     const TriangulationOptions& options) {
  SwapCosts costs;
  const double inlier = options.inlier * rows_factor(camera);
  const auto cost = [&](int detected, int point) {
    const auto pixel = project(camera, pose.points[static_cast<std::size_t>(point)].place);
    if (!pixel) {
      return 1.0;
    }
    const double off = (*pixel - detections.row(detected).head<2>().transpose()).squaredNorm();
    return std::min(off / (inlier * inlier), 1.0);
  };
  for (const int left : group) {
    const int right = schema.mirror[static_cast<std::size_t>(left)];
    if (pose.points[static_cast<std::size_t>(left)].confidence <= 0 ||
        pose.points[static_cast<std::size_t>(right)].confidence <= 0) {
      continue;
    }
    for (const int row : {left, right}) {
      if (detections(row, 2) >= options.min_confidence) {
        costs.as_is += cost(row, row);
        costs.mirrored += cost(row, row == left ? right : left);
        ++costs.points;
      }
    }
  }
  return costs;
}

/// Swaps back what fits clearly better mirrored; says in which cameras.
std::vector<int> undo_swaps(const std::vector<Camera>& cameras,
                            std::vector<Keypoints2d>& detections, const SpacePose& pose,
                            const KeypointSchema& schema, const TriangulationOptions& options) {
  std::vector<int> swapped;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (detections[i].rows() == 0) {
      continue;
    }
    for (const std::vector<int>& group : limbs_of(schema).groups) {
      const SwapCosts costs = swap_costs(cameras[i], detections[i], pose, schema, group, options);
      if (costs.points >= 3 && costs.as_is > 0.5 * costs.points &&
          costs.mirrored < 0.5 * costs.as_is) {
        for (const int left : group) {
          const int right = schema.mirror[static_cast<std::size_t>(left)];
          detections[i].row(left).swap(detections[i].row(right));
        }
        if (swapped.empty() || swapped.back() != static_cast<int>(i)) {
          swapped.push_back(static_cast<int>(i));
        }
      }
    }
  }
  return swapped;
}

/// Median reprojection error of each camera, pixels of an image 1000 rows high.
std::vector<double> camera_errors(const std::vector<Camera>& cameras, const Frames& detections,
                                  const std::vector<SpacePose>& poses) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    std::vector<double> of_camera;
    for (std::size_t f = 0; f < poses.size(); ++f) {
      const Keypoints2d& points = detections[f][i];
      for (Index k = 0; k < points.rows(); ++k) {
        const SpacePoint& point = poses[f].points[static_cast<std::size_t>(k)];
        const auto pixel = point.confidence > 0 && points(k, 2) > 0.3
                               ? project(cameras[i], point.place)
                               : std::nullopt;
        if (pixel) {
          of_camera.push_back((*pixel - points.row(k).head<2>().transpose()).norm() /
                              rows_factor(cameras[i]));
        }
      }
    }
    errors.push_back(median(of_camera));
  }
  return errors;
}

/// Median of what cameras that are not off say against the points in space, by confidence: medians,
/// so that outliers change little. Nothing where there are too few to tell.
DetectorError detector_error(const std::vector<Camera>& cameras, const Frames& detections,
                             const std::vector<SpacePose>& poses,
                             const std::vector<double>& scale) {
  constexpr std::size_t kBins = 12;
  constexpr std::size_t kMinInBin = 50;
  constexpr double kMinSigma = 0.3;            // px
  constexpr double kMedianOfSigma = 1.177;     // of a distance in the plane, Rayleigh's
  std::vector<std::pair<double, double>> all;  // confidence, px
  for (std::size_t f = 0; f < poses.size(); ++f) {
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const Keypoints2d& points = detections[f][i];
      for (Index k = 0; k < points.rows(); ++k) {
        const SpacePoint& point = poses[f].points[static_cast<std::size_t>(k)];
        const auto pixel = point.confidence > 0 && points(k, 2) > 0 && scale[i] == 1
                               ? project(cameras[i], point.place)
                               : std::nullopt;
        if (pixel) {
          all.emplace_back(
              std::min(points(k, 2), 1.0),
              (*pixel - points.row(k).head<2>().transpose()).norm() / rows_factor(cameras[i]));
        }
      }
    }
  }
  DetectorError error;
  if (all.size() < kBins * kMinInBin) {
    return error;
  }
  std::sort(all.begin(), all.end());
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const std::size_t begin = bin * all.size() / kBins;
    const std::size_t end = (bin + 1) * all.size() / kBins;
    std::vector<double> off;
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) {
      sum += all[i].first;
      off.push_back(all[i].second);
    }
    const double confidence = sum / static_cast<double>(off.size());
    // A detector that gives all the same confidence has one error.
    if (error.confidences.empty() || confidence > error.confidences.back() + 1e-6) {
      error.confidences.push_back(confidence);
      error.sigmas.push_back(std::max(median(off) / kMedianOfSigma, kMinSigma));
    }
  }
  return error;
}

/// The same of one camera against what the others alone say, over some frames: where cameras are
/// few, those that agree by chance make the rest look wrong.
double error_left_out(const std::vector<Camera>& cameras, const Frames& detections, std::size_t c,
                      Index count, const TriangulationOptions& options) {
  constexpr std::size_t kSamples = 24;
  const std::size_t step = std::max<std::size_t>(1, detections.size() / kSamples);
  std::vector<std::vector<Keypoints2d>> some;
  std::vector<SpacePose> poses;
  for (std::size_t f = 0; f < detections.size(); f += step) {
    some.push_back(detections[f]);
    std::vector<Keypoints2d> others = detections[f];
    others[c] = Keypoints2d(0, 3);
    poses.push_back(pose_of(cameras, others, count, options, {}, {}));
  }
  return camera_errors(cameras, some, poses)[c];
}

/// Cameras whose error stands out: by how much more than the others'; 1 of all others.
std::vector<double> standing_out(const std::vector<Camera>& cameras, const Frames& detections,
                                 const std::vector<double>& errors, Index count,
                                 const TriangulationOptions& options) {
  std::vector<double> sorted = errors;
  const double usual = std::max(median(sorted), 0.1);
  std::vector<double> ratios;
  bool any = false;
  for (const double error : errors) {
    ratios.push_back(error > kOffFactor * usual ? error / usual : 1);
    any = any || ratios.back() > 1;
  }
  constexpr std::size_t kFewCameras = 6;
  if (!any || cameras.size() > kFewCameras) {
    return ratios;
  }
  std::vector<double> left_out;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    left_out.push_back(error_left_out(cameras, detections, c, count, options));
  }
  sorted = left_out;
  const double usual_left_out = std::max(median(sorted), 0.1);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    ratios[c] = left_out[c] > kOffFactor * usual_left_out ? ratios[c] : 1;
  }
  return ratios;
}

void bridge_gaps(std::vector<SpacePose>& frames, std::size_t k, double fps, double longest) {
  constexpr double kAcceleration = 20;  // m/s2 of a limb: how far a straight line may be wrong
  std::optional<std::size_t> before;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    if (frames[f].points[k].confidence <= 0) {
      continue;
    }
    if (before && f - *before > 1 && static_cast<double>(f - *before) / fps <= longest) {
      const SpacePoint& a = frames[*before].points[k];
      const SpacePoint& b = frames[f].points[k];
      for (std::size_t at = *before + 1; at < f; ++at) {
        const double t = static_cast<double>(at - *before) / static_cast<double>(f - *before);
        const double from_ends =
            static_cast<double>(at - *before) * static_cast<double>(f - at) / (fps * fps);  // s2
        const double off = 0.5 * kAcceleration * from_ends;
        SpacePoint& point = frames[at].points[k];
        point.place = (1 - t) * a.place + t * b.place;
        point.covariance =
            (1 - t) * a.covariance + t * b.covariance + off * off * Eigen::Matrix3d::Identity();
        point.confidence = 0.1 * std::min(a.confidence, b.confidence);
        point.bridged = true;
      }
    }
    before = f;
  }
}

}  // namespace

Triangulation triangulate(const std::vector<Camera>& cameras, const Frames& detections,
                          const KeypointSchema& schema, double fps,
                          const TriangulationOptions& options) {
  ATELIER_CHECK(fps > 0, "frames per second > 0");
  const auto count = static_cast<Index>(schema.points.size());
  for (const auto& frame : detections) {
    ATELIER_CHECK(frame.size() == cameras.size(), "detections for each camera");
    for (const Keypoints2d& points : frame) {
      ATELIER_CHECK(points.rows() == 0 || points.rows() == count, "points of the schema");
    }
  }
  Frames used = detections;
  Triangulation result;
  result.frames.resize(used.size());
  std::vector<double> scale;
  DetectorError error;
  const auto pass = [&](bool swaps) {
    parallel_for(static_cast<Index>(used.size()), 1, [&](Index begin, Index end) {
      for (auto f = static_cast<std::size_t>(begin); f < static_cast<std::size_t>(end); ++f) {
        std::vector<int> swapped = std::move(result.frames[f].swapped);
        result.frames[f] = pose_of(cameras, used[f], count, options, scale, error);
        if (swaps) {
          swapped = undo_swaps(cameras, used[f], result.frames[f], schema, options);
        }
        result.frames[f].swapped = std::move(swapped);
      }
    });
  };
  pass(options.swaps);
  result.camera_error = camera_errors(cameras, used, result.frames);
  std::vector<double> sorted = result.camera_error;
  const double usual = std::max(median(sorted), 0.1);
  scale.assign(cameras.size(), 1);
  const std::vector<double> ratios =
      standing_out(cameras, used, result.camera_error, count, options);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const double ratio = ratios[i];
    if (ratio > 1) {
      scale[i] = ratio * ratio;
      char what[128];
      std::snprintf(what, sizeof what, "reprojection error %.3g px, %.3g in the median camera",
                    result.camera_error[i], usual);
      result.findings.push_back({Severity::Warning, "camera-off", cameras[i].id, what,
                                 "it counts less; calibrate it again or leave it out"});
    }
  }
  error = detector_error(cameras, used, result.frames, scale);
  pass(false);
  if (options.distances) {
    keep_distances(result.frames, schema);
  }
  for (Index k = 0; k < count; ++k) {
    bridge_gaps(result.frames, static_cast<std::size_t>(k), fps, options.bridge);
  }
  return result;
}

}  // namespace atelier
