#include "capture/check_cameras.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "capture/camera_conventions.h"
#include "capture/rig_convention.h"
#include "capture/sentence.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr double kDegrees = 3.14159265358979323846 / 180;
constexpr double kTwins = 1e-4;  // m: cameras nearer to each other stand in one place

/// How far the corners of the image are from its principal point, over how far they would be
/// without distortion; the most. 1 where no ray is.
double corner_stretch(const Camera& camera) {
  double most = 1;
  for (const double x : {0.0, static_cast<double>(camera.width)}) {
    for (const double y : {0.0, static_cast<double>(camera.height)}) {
      const auto ray = ray_direction(camera, {x, y});
      const Eigen::Vector3d seen = ray ? Eigen::Vector3d(camera.camera_from_world_rotation * *ray)
                                       : Eigen::Vector3d::UnitZ();
      const double straight = seen.head<2>().norm() / seen.z();
      const double there = std::hypot((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy);
      if (straight > 0) {
        most = std::max(most, there / straight);
      }
    }
  }
  return most;
}

/// Distortion that folds nowhere and that no lens has: the worst pincushions stretch by a tenth.
void doubt_stretch(const Camera& camera, std::vector<Finding>& findings) {
  constexpr double kMost = 1.5;
  const double stretch = corner_stretch(camera);
  if (stretch > kMost) {
    findings.push_back({Severity::Warning, "camera-distortion", camera.id,
                        "the distortion pulls the image's corners to " + short_number(stretch, 3) +
                            " times as far from the centre, as no lens does",
                        "are the coefficients in OpenCV's order (k1 k2 p1 p2 k3), not scaled?"});
  }
}

void check_lens(const Camera& camera, std::vector<Finding>& findings) {
  const double angle = 2 * std::atan(0.5 * camera.width / camera.fx) / kDegrees;
  if (camera.distortion_model != Distortion::Fisheye && (angle < 2 || angle > 150)) {
    findings.push_back({Severity::Error, "camera-focal", camera.id,
                        sentence("fx %.6g over %d px is a field of view of %.1f degrees", camera.fx,
                                 camera.width, angle),
                        "are the intrinsics those of this image size, in pixels?"});
  }
  if (std::abs(camera.fx / camera.fy - 1) > 0.1) {
    findings.push_back(
        {Severity::Warning, "camera-aspect", camera.id,
         sentence("fx %.6g and fy %.6g differ by more than a tenth", camera.fx, camera.fy),
         "pixels of today's cameras are square"});
  }
  const double off_x = camera.cx / camera.width - 0.5;
  const double off_y = camera.cy / camera.height - 0.5;
  if (std::max(std::abs(off_x), std::abs(off_y)) > 0.25) {
    findings.push_back({Severity::Warning, "camera-principal-point", camera.id,
                        sentence("the principal point (%.6g, %.6g) is far from the middle of "
                                 "%d x %d px",
                                 camera.cx, camera.cy, camera.width, camera.height),
                        "is the image cropped, turned, or of another size than when calibrated?"});
  }
  // Every pixel of the rim must have a ray, and the ray must come back to it.
  int lost = 0;
  constexpr int kSteps = 16;
  for (int i = 0; i < 4 * kSteps; ++i) {
    const double t = static_cast<double>(i % kSteps) / kSteps;
    const double x = i < 2 * kSteps ? t * camera.width : (i < 3 * kSteps ? 0.0 : camera.width);
    const double y = i < kSteps       ? 0.0
                     : i < 2 * kSteps ? static_cast<double>(camera.height)
                                      : t * camera.height;
    const auto ray = ray_direction(camera, {x, y});
    const auto back = ray ? project(camera, camera_center(camera) + *ray) : std::nullopt;
    lost += back && (*back - Eigen::Vector2d(x, y)).norm() < 0.5 ? 0 : 1;
  }
  if (lost == 0) {
    doubt_stretch(camera, findings);
    return;
  }
  // A fisheye's image may reach beyond 90 degrees, where no ray is: that is a wide lens, unless it
  // folds before.
  const Eigen::Vector3d aside(std::sin(89.9 * kDegrees), 0, std::cos(89.9 * kDegrees));
  if (camera.distortion_model == Distortion::Fisheye &&
      project(camera,
              camera_center(camera) + camera.camera_from_world_rotation.transpose() * aside)) {
    findings.push_back({Severity::Note, "camera-distortion", camera.id,
                        sentence("%d of %d places of the image's rim look 90 degrees and more "
                                 "aside",
                                 lost, 4 * kSteps),
                        "nothing: pixels there are not used"});
    return;
  }
  findings.push_back({lost > kSteps ? Severity::Error : Severity::Warning, "camera-distortion",
                      camera.id,
                      sentence("the distortion folds over at %d of %d places of the image's rim",
                               lost, 4 * kSteps),
                      "are the coefficients in OpenCV's order (k1 k2 p1 p2 k3), not scaled?"});
}

/// The one unit among the usual that makes it some metres, or no setting.
std::string unit_setting(double distance) {
  std::string setting;
  for (const char* unit : {"0.001", "0.01"}) {
    const double then = distance * std::strtod(unit, nullptr);
    if (then > 1 && then < 10) {
      setting = std::string("--capture.metres-per-unit ") + unit;
    }
  }
  return setting;
}

/// "opengl" or, of several, "inverse or transposed" of conventions; "" are those as read.
std::string listed_values(const std::vector<std::string>& values) {
  std::string text;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const char* between = i == 0 ? "" : i + 1 == values.size() ? " or " : ", ";
    text += between + (values[i].empty() ? "as they are" : "all=" + values[i]);
  }
  return text;
}

constexpr const char* kTells =
    "2D keypoints or masks of the person would tell (atelier detect, masks)";

/// What is said of the convention of all extrinsics, as far as cameras alone tell, and the cameras
/// under the one that is advised.
std::vector<Camera> check_convention(const std::vector<Camera>& cameras,
                                     const WorldConvention& world, std::vector<Finding>& findings) {
  const std::vector<RigReading> readings = rig_readings(cameras, world);
  const std::vector<std::string> likely = likely_values(readings);
  const bool as_read = std::find(likely.begin(), likely.end(), "") != likely.end();
  const bool possible = std::any_of(readings.begin(), readings.end(), [](const RigReading& one) {
    return one.value.empty() && one.possible;
  });
  const Gaze gaze = gaze_of(cameras);
  if (as_read && likely.size() == 1) {
    return cameras;
  }
  if (as_read) {
    std::vector<std::string> others = likely;
    std::erase(others, "");
    findings.push_back({Severity::Warning, "extrinsics-untold", "",
                        "the cameras look at one place as they are read, and about as well with "
                        "--capture.extrinsics " +
                            listed_values(others) + ": they alone do not tell which is meant",
                        kTells});
    return cameras;
  }
  if (likely.empty()) {
    if (!possible && !gaze.side_by_side) {
      findings.push_back({Severity::Error, "cameras-apart", "",
                          "the cameras look at no common place",
                          "are extrinsics world-to-camera, is the layout another "
                          "(--capture.layout)? no other convention of extrinsics makes them look "
                          "at one"});
    }
    return cameras;
  }
  const std::string now = possible ? "another convention of extrinsics than the one they are read "
                                     "in fits the cameras far better"
                          : gaze.side_by_side || 2 * gaze.agreeing > std::ssize(cameras)
                              ? "the cameras stand in one place or look past each other"
                              : "the cameras look at no common place";
  const Severity severity = possible ? Severity::Warning : Severity::Error;
  const char* code = possible ? "extrinsics-doubtful" : "cameras-apart";
  if (likely.size() > 1) {
    findings.push_back({severity, code, "",
                        now + "; they do with --capture.extrinsics " + listed_values(likely),
                        std::string("try each: ") + kTells});
    return cameras;
  }
  findings.push_back({severity, code, "", now,
                      "read so, they look at one, upright; --capture.layout, if the layout is "
                      "another",
                      "--capture.extrinsics all=" + likely.front()});
  std::vector<Camera> meant;
  for (const Camera& camera : cameras) {
    meant.push_back(extrinsics_read_as(camera, world, likely.front()));
  }
  return meant;
}

void check_size(const std::vector<Camera>& cameras, const Gaze& gaze, const WorldConvention& world,
                std::vector<Finding>& findings) {
  std::vector<double> distances;
  distances.reserve(cameras.size());
  for (const Camera& camera : cameras) {
    distances.push_back((camera_center(camera) - gaze.place).norm());
  }
  std::nth_element(distances.begin(), distances.begin() + distances.size() / 2, distances.end());
  const double distance = distances[distances.size() / 2];
  if (distance < 0.3 || distance > 100) {
    findings.push_back({Severity::Error, "stage-size", "",
                        sentence("the cameras are %.3g m from what they look at", distance),
                        "which unit is the calibration in? --capture.metres-per-unit says so",
                        unit_setting(distance / world.metres_per_unit)});
  }
}

/// @return  the cameras under the convention that is advised
std::vector<Camera> check_gaze(const std::vector<Camera>& cameras, const WorldConvention& world,
                               std::vector<Finding>& findings) {
  if (cameras.size() < 2) {
    return cameras;
  }
  std::vector<Camera> meant = check_convention(cameras, world, findings);
  const Gaze gaze = gaze_of(meant);
  constexpr std::size_t kFew = 3;  // two axes nearly always meet somewhere
  if (meant.size() < kFew || gaze.side_by_side || gaze.agreeing * 2 <= std::ssize(meant)) {
    return meant;
  }
  for (std::size_t i = 0; i < meant.size(); ++i) {
    if (gaze.angle[i] >= kLooksAt) {
      findings.push_back({Severity::Warning, "camera-looks-away", meant[i].id,
                          sentence("it looks %.0f degrees past the place that %d of %zu cameras "
                                   "look at",
                                   gaze.angle[i] / kDegrees, gaze.agreeing, meant.size()),
                          "is its extrinsic inverted or transposed, or its translation the "
                          "camera's position?"});
    }
  }
  check_size(meant, gaze, world, findings);
  return meant;
}

/// The axis of the files' world that is nearest to a direction of ours.
std::string axis_name(const Eigen::Vector3d& direction, const WorldConvention& world) {
  const Eigen::Vector3d in_file = y_up_from(world.up).transpose() * direction;
  Eigen::Index axis = 0;
  in_file.cwiseAbs().maxCoeff(&axis);
  return std::string(in_file[axis] < 0 ? "-" : "") + "xyz"[axis];
}

void check_up(const std::vector<Camera>& cameras, const WorldConvention& world,
              std::vector<Finding>& findings) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const Camera& camera : cameras) {
    up -= camera.camera_from_world_rotation.row(1).transpose();
  }
  if (up.norm() < 0.5 * static_cast<double>(cameras.size())) {
    return;  // cameras above and below, or turned: they do not say
  }
  const double off = std::acos(std::clamp(up.normalized().y(), -1.0, 1.0)) / kDegrees;
  if (off <= 45) {
    return;
  }
  const std::string axis = axis_name(up, world);
  const Eigen::Vector3d in_file = y_up_from(world.up).transpose() * up.normalized();
  const double then = std::acos(std::clamp(in_file.cwiseAbs().maxCoeff(), 0.0, 1.0)) / kDegrees;
  const std::string what = sentence("the cameras' mean up direction is %.0f degrees off Y", off);
  constexpr double kNear = 35;
  constexpr double kAround = 135;
  if (then > kNear) {
    findings.push_back({Severity::Error, "stage-up", "",
                        what + sentence(", and %.0f off the nearest axis of the calibration", then),
                        "turn the calibration so that one of its axes points up"});
  } else if (gaze_of(cameras).side_by_side && off > kAround) {
    findings.push_back({Severity::Error, "stage-up", "", what,
                        "say --capture.up " + axis +
                            ", or --capture.extrinsics all=opengl if the cameras' y axes point up: "
                            "cameras side by side do not tell which"});
  } else {
    findings.push_back({Severity::Error, "stage-up", "", what,
                        "which axis of the calibration points up?", "--capture.up " + axis});
  }
}

}  // namespace

std::vector<Finding> check_cameras(const std::vector<Camera>& cameras,
                                   const WorldConvention& world) {
  std::vector<Finding> findings;
  for (const Camera& camera : cameras) {
    check_lens(camera, findings);
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    for (std::size_t j = i + 1; j < cameras.size(); ++j) {
      if ((camera_center(cameras[i]) - camera_center(cameras[j])).norm() < kTwins) {
        findings.push_back({Severity::Error, "camera-twins", cameras[j].id,
                            "it stands where " + cameras[i].id + " stands",
                            "is one camera's calibration copied, or are both at the origin?"});
      }
    }
  }
  check_up(check_gaze(cameras, world, findings), world, findings);
  return findings;
}

std::vector<Finding> check_cameras(const Dataset& dataset) {
  std::vector<Camera> cameras;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    cameras.push_back(turned_camera(dataset.cameras[c], -dataset.frames[c].turn));
  }
  return check_cameras(cameras, dataset.world_convention);
}

}  // namespace atelier
