#include "capture/input/keypoint_rig.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "capture/calibration/rig_from_points.h"
#include "capture/detections.h"
#include "capture/frame_reader.h"
#include "capture/keypoint_schema.h"
#include "core/error.h"
#include "core/median.h"

namespace atelier {
namespace {

using Vector3 = Eigen::Vector3d;

/// Frames and what was seen in them: point number `frame index * points + keypoint`.
struct KeypointSights {
  std::vector<int> frames;
  int points = 0;  ///< of a person
  std::vector<PointSight> sights;
  std::vector<std::set<int>> seen_by;  ///< [C] frames in which a camera sees the person
};

std::vector<int> spread_frames(const Dataset& capture, int most) {
  std::set<int> with;
  for (const CameraFrames& frames : capture.frames) {
    for (const auto& [frame, place] : frames.keypoints) {
      with.insert(frame);
    }
  }
  const std::vector<int> all(with.begin(), with.end());
  if (static_cast<int>(all.size()) <= most) {
    return all;
  }
  std::vector<int> some;
  for (std::size_t i = 0; i < static_cast<std::size_t>(most); ++i) {
    some.push_back(all[i * all.size() / static_cast<std::size_t>(most)]);
  }
  return some;
}

KeypointSights keypoint_sights(const Dataset& capture, const KeypointSchema& schema,
                               const KeypointRigOptions& options) {
  KeypointSights all;
  all.frames = spread_frames(capture, options.max_frames);
  all.points = static_cast<int>(schema.points.size());
  all.seen_by.resize(capture.cameras.size());
  FrameReader reader(capture);
  const auto people = main_person(read_detections(reader, all.frames));
  for (std::size_t f = 0; f < people.size(); ++f) {
    for (std::size_t c = 0; c < people[f].size(); ++c) {
      const Keypoints2d& points = people[f][c];
      for (Index k = 0; k < points.rows(); ++k) {
        if (points(k, 2) >= options.min_confidence && points(k, 2) > 0) {
          all.sights.push_back({static_cast<int>(c),
                                static_cast<int>(f) * all.points + static_cast<int>(k),
                                points.row(k).head<2>().transpose()});
          all.seen_by[c].insert(all.frames[f]);
        }
      }
    }
  }
  return all;
}

/// The places of one keypoint over the frames; NaN where it has none.
class Skeleton {
 public:
  Skeleton(const PointRig& rig, const KeypointSights& sights, const KeypointSchema& schema)
      : rig_(rig), sights_(sights), schema_(schema) {}

  std::size_t frames() const { return sights_.frames.size(); }

  Vector3 at(std::size_t frame, const std::string& name) const {
    const int k = find_keypoint(schema_, name);
    const std::size_t point =
        frame * static_cast<std::size_t>(sights_.points) + static_cast<std::size_t>(std::max(k, 0));
    return k < 0 || point >= rig_.points.size() ? Vector3::Constant(NAN) : rig_.points[point];
  }

  /// Middle of left and right.
  Vector3 middle(std::size_t frame, const std::string& name) const {
    return 0.5 * (at(frame, "left_" + name) + at(frame, "right_" + name));
  }

 private:
  const PointRig& rig_;
  const KeypointSights& sights_;
  const KeypointSchema& schema_;
};

/// The stature of the person in the rig's unit; 0 where too little of the limbs is seen.
double stature_of(const Skeleton& skeleton) {
  struct Limb {
    const char* from;
    const char* to;
    double share;
  };
  constexpr Limb kLimbs[] = {{"hip", "knee", 0.245},
                             {"knee", "ankle", 0.246},
                             {"shoulder", "elbow", 0.186},
                             {"elbow", "wrist", 0.146}};
  constexpr std::size_t kFew = 5;
  double length = 0;
  double share = 0;
  for (const Limb& limb : kLimbs) {
    for (const std::string side : {"left_", "right_"}) {
      std::vector<double> lengths;
      for (std::size_t f = 0; f < skeleton.frames(); ++f) {
        const double one =
            (skeleton.at(f, side + limb.from) - skeleton.at(f, side + limb.to)).norm();
        if (std::isfinite(one)) {
          lengths.push_back(one);
        }
      }
      if (lengths.size() >= kFew) {
        length += median(lengths);
        share += limb.share;
      }
    }
  }
  constexpr double kEnough = 0.4;  // a leg or two arms and more
  return share > kEnough ? length / share : 0;
}

/// World of the result: y_new = scale * turn * (x - origin).
struct Standing {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Vector3 origin = Vector3::Zero();
  double scale = 1;
};

Standing standing_of(const Skeleton& skeleton, double scale) {
  Standing standing;
  standing.scale = scale;
  Vector3 up = Vector3::Zero();
  Vector3 hips = Vector3::Zero();
  double count = 0;
  for (std::size_t f = 0; f < skeleton.frames(); ++f) {
    const Vector3 one = skeleton.middle(f, "shoulder") - skeleton.middle(f, "ankle");
    const Vector3 hip = skeleton.middle(f, "hip");
    if (one.allFinite() && hip.allFinite() && one.norm() > 0) {
      up += one.normalized();
      hips += hip;
      count += 1;
    }
  }
  if (count == 0 || up.norm() < 1e-6) {
    return standing;
  }
  up.normalize();
  hips /= count;
  standing.turn = Eigen::Quaterniond::FromTwoVectors(up, Vector3::UnitY()).toRotationMatrix();
  std::vector<double> heights;
  for (std::size_t f = 0; f < skeleton.frames(); ++f) {
    for (const char* part : {"ankle", "heel", "big_toe", "small_toe"}) {
      for (const std::string side : {"left_", "right_"}) {
        const double height = up.dot(skeleton.at(f, side + part) - hips);
        if (std::isfinite(height)) {
          heights.push_back(height);
        }
      }
    }
  }
  constexpr double kGround = 0.05;
  standing.origin = hips + percentile(heights, kGround) * up;
  return standing;
}

Camera stood_up(Camera camera, const Standing& standing) {
  camera.camera_from_world_translation =
      standing.scale *
      (camera.camera_from_world_rotation * standing.origin + camera.camera_from_world_translation);
  camera.camera_from_world_rotation *= standing.turn.transpose();
  return camera;
}

/// Errors, coverage and deviations of one camera.
CameraQuality quality_of(const PointRig& rig, const KeypointSights& sights, std::size_t c,
                         double scale) {
  CameraQuality quality;
  quality.lens = "known";
  quality.in_rig = rig.in_rig[c];
  quality.views_seen = static_cast<int>(sights.seen_by[c].size());
  constexpr int kGrid = 8;
  std::set<int> cells;
  std::set<int> frames;
  std::vector<double> errors;
  const Camera& camera = rig.cameras[c];
  for (std::size_t i = 0; i < sights.sights.size(); ++i) {
    const PointSight& sight = sights.sights[i];
    if (sight.camera_idx != static_cast<int>(c) || !std::isfinite(rig.errors[i])) {
      continue;
    }
    errors.push_back(rig.errors[i]);
    frames.insert(sight.point / sights.points);
    const auto cell = [](double at, int size) {
      return static_cast<int>(std::clamp(kGrid * at / size, 0.0, kGrid - 1.0));
    };
    cells.insert(cell(sight.pixel.y(), camera.height) * kGrid +
                 cell(sight.pixel.x(), camera.width));
  }
  quality.views_used = static_cast<int>(frames.size());
  quality.corners = static_cast<int>(errors.size());
  quality.rms = root_mean_square(errors);
  quality.p95 = percentile(errors, 0.95);
  quality.coverage = static_cast<double>(cells.size()) / (kGrid * kGrid);
  const Eigen::Matrix<double, 6, 6>& covariance = rig.pose_covariance[c];
  quality.rotation_deviation = covariance.diagonal().head<3>().cwiseMax(0).cwiseSqrt();
  quality.centre_deviation =
      scale * centre_deviation(
                  rigid_of(camera.camera_from_world_rotation, camera.camera_from_world_translation),
                  covariance);
  return quality;
}

}  // namespace

OptionTable describe(KeypointRigOptions& options) {
  OptionTable table;
  table.add("stature", options.stature, 0, 2.5, "m",
            "Height of the person without shoes, which sets the scale; 0: not known");
  table.add("min_confidence", options.min_confidence, 0, 1, "",
            "Minimum confidence of a keypoint that cameras are posed by");
  table.add("max_frames", options.max_frames, 10, 100000, "",
            "Maximum number of frames that cameras are posed by, spread evenly");
  return table;
}

Calibration calibrate_by_keypoints(const std::vector<RigCamera>& rig, const Dataset& capture,
                                   const KeypointRigOptions& options) {
  ATELIER_CHECK(rig.size() == capture.cameras.size(), "a lens for each camera");
  ATELIER_CHECK(options.stature > 0, "a person without a stature");
  if (capture.info.keypoint_schema.empty()) {
    throw DataError(capture.root.string(), "", "no 2D keypoints",
                    "detections of a person in every camera, such as OpenPose writes");
  }
  const KeypointSchema& schema = keypoint_schema(capture.info.keypoint_schema);
  const KeypointSights sights = keypoint_sights(capture, schema, options);
  std::vector<Camera> cameras;
  cameras.reserve(rig.size());
  for (const RigCamera& camera : rig) {
    cameras.push_back(camera.camera);
  }
  const PointRig found = rig_from_points(cameras, sights.sights);
  const Skeleton skeleton(found, sights, schema);
  const double stature = stature_of(skeleton);
  if (std::none_of(found.in_rig.begin(), found.in_rig.end(), [](bool in) { return in; }) ||
      stature <= 0) {
    throw DataError(capture.root.string(), "keypoints",
                    "no two cameras see enough of one person at once (" +
                        std::to_string(sights.sights.size()) + " keypoints in " +
                        std::to_string(sights.frames.size()) + " frames)",
                    "frames of one instant under one number, a person who moves through what "
                    "all cameras see, and the right lenses");
  }
  const Standing standing = standing_of(skeleton, options.stature / stature);
  Calibration result;
  std::vector<double> errors;
  for (const double error : found.errors) {
    if (std::isfinite(error)) {
      errors.push_back(error);
    }
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    result.quality.push_back(quality_of(found, sights, c, standing.scale));
    result.cameras.push_back(found.in_rig[c] ? stood_up(found.cameras[c], standing) : cameras[c]);
    if (!found.in_rig[c]) {
      result.findings.push_back(
          {Severity::Error, "calibration-unconnected", cameras[c].id,
           "it shares too few keypoints with the other cameras to be posed",
           "record the person where this camera sees them too, or calibrate it by a board"});
    }
  }
  result.points =
      static_cast<int>(std::count_if(found.points.begin(), found.points.end(),
                                     [](const Vector3& point) { return point.allFinite(); }));
  result.rms = root_mean_square(errors);
  result.p95 = percentile(errors, 0.95);
  result.sigma = found.sigma;
  result.converged = found.converged;
  judge_adjustment(result);
  return result;
}

}  // namespace atelier
