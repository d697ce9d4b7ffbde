#include "capture/rig_convention.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "capture/camera_conventions.h"
#include "capture/camera_readings.h"

namespace atelier {
namespace {

constexpr double kRadiansOfDegree = 3.14159265358979323846 / 180;
constexpr std::size_t kMostPairs = 4000;

Eigen::Vector3d axis_of_view(const Camera& camera) {
  return camera.camera_from_world_rotation.row(2).transpose();
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Gaze gaze_at(const std::vector<Camera>& cameras, const Eigen::Vector3d& place) {
  Gaze gaze{place, {}, 0, false};
  for (const Camera& camera : cameras) {
    gaze.angle.push_back(angle_between(axis_of_view(camera), place - camera_center(camera)));
    gaze.agreeing += gaze.angle.back() < kLooksAt ? 1 : 0;
  }
  return gaze;
}

/// The place nearest to the axes of the cameras that look at it already.
Gaze refined(const std::vector<Camera>& cameras, const Gaze& gaze) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (gaze.angle[c] < kLooksAt) {
      const Eigen::Vector3d axis = axis_of_view(cameras[c]);
      const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
      matrix += across;
      right += across * camera_center(cameras[c]);
    }
  }
  const Eigen::Vector3d place = matrix.ldlt().solve(right);
  if (!place.allFinite()) {
    return gaze;
  }
  Gaze better = gaze_at(cameras, place);
  return better.agreeing >= gaze.agreeing ? better : gaze;
}

double middle_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The direction that cameras have above them, upright or all turned by a quarter.
struct CommonUp {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  ///< unit
  double tilt = 0;                               ///< root mean square sine of the cameras' roll
};

std::optional<CommonUp> common_up(const std::vector<Camera>& cameras, const Eigen::Vector3d& said) {
  std::optional<CommonUp> best;
  for (const bool upright : {true, false}) {
    Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Camera& camera : cameras) {
      const Eigen::Vector3d x = camera.camera_from_world_rotation.row(0).transpose();
      const Eigen::Vector3d y = camera.camera_from_world_rotation.row(1).transpose();
      across += upright ? x * x.transpose() : y * y.transpose();
      mean += upright ? Eigen::Vector3d(-y) : x;
    }
    mean /= static_cast<double>(cameras.size());
    constexpr double kCoherent = 0.5;
    if (mean.norm() < kCoherent) {
      continue;
    }
    // Cameras without roll have their x axis across the common up: the least of these squares. Of
    // an arc that direction may be the one of view; it is not near to what is above.
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
        across / static_cast<double>(cameras.size()));
    const Eigen::Vector3d& squares = solver.eigenvalues();
    for (Eigen::Index k = 0; k < 3; ++k) {
      // Of cameras whose x axes are parallel, as of two face to face, a plane is across them: what
      // is above them within it.
      constexpr double kAlike = 0.01;  // squares of what cameras are rolled by
      Eigen::Vector3d axis = Eigen::Vector3d::Zero();
      for (Eigen::Index j = k; j < 3 && squares[j] <= squares[k] + kAlike; ++j) {
        axis += solver.eigenvectors().col(j).dot(mean) * solver.eigenvectors().col(j);
      }
      constexpr double kNear = 0.6;
      if (axis.norm() < kNear * mean.norm()) {
        continue;
      }
      axis.normalize();
      const double count = static_cast<double>(cameras.size());
      CommonUp found{axis, std::sqrt(std::max(0.0, axis.dot(across * axis) / count))};
      if (!upright && found.up.dot(said) < 0) {
        found.up = -found.up;  // a quarter to the left or to the right
      }
      constexpr double kLess = 0.3;
      if (!best || found.tilt < best->tilt - kLess) {
        best = found;
      }
      break;
    }
  }
  return best;
}

double squared(double value) {
  return value * value;
}

RigReading judged_reading(const std::vector<Camera>& cameras, const WorldConvention& world,
                          const std::string& value) {
  RigReading reading;
  reading.value = value;
  const double count = static_cast<double>(cameras.size());
  const Gaze gaze = gaze_of(cameras);
  if (gaze.side_by_side || gaze.agreeing == 0) {
    return reading;
  }
  std::vector<double> distances;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Camera& camera : cameras) {
    distances.push_back((camera_center(camera) - gaze.place).norm());
    mean += camera_center(camera) / count;
  }
  double squares = 0;
  for (const Camera& camera : cameras) {
    squares += (camera_center(camera) - mean).squaredNorm() / count;
  }
  const double apart = std::sqrt(squares) / std::max(middle_of(distances), 1e-9);
  constexpr double kOnePlace = 0.02;
  const double least = value.empty() ? 0.5 : 0.8;
  reading.possible = gaze.agreeing > least * count && apart > kOnePlace;
  // Terms are capped, so that none outweighs all others.
  constexpr double kAim = 4 * kRadiansOfDegree;
  constexpr double kRoll = 0.08;
  constexpr double kUp = 8 * kRadiansOfDegree;
  constexpr double kApart = 0.1;
  constexpr double kMost = 25;
  const Eigen::Vector3d said = Eigen::Vector3d::UnitY();
  const double aim = middle_of(gaze.angle);
  reading.aimed = aim < kAim && world.up_guessed;
  reading.doubt =
      squared(aim / kAim) + std::min(kMost, squared(kApart / std::max(apart, kOnePlace)));
  if (const auto up = common_up(cameras, said)) {
    reading.doubt += std::min(kMost, squared(up->tilt / kRoll));
    reading.doubt +=
        world.up_guessed ? 0 : std::min(kMost, squared(angle_between(up->up, said) / kUp));
  } else {
    reading.doubt += 2 * kMost;
  }
  return reading;
}

/// Beyond this another reading is not worth a word.
double far_more(double doubt) {
  return 3 * doubt + 2;
}

}  // namespace

Gaze gaze_of(const std::vector<Camera>& cameras) {
  Gaze best;
  double best_sum = 1e300;
  const std::size_t pairs =
      cameras.size() * (cameras.size() - std::min<std::size_t>(1, cameras.size())) / 2;
  const std::size_t step = std::max<std::size_t>(1, pairs / kMostPairs);
  std::size_t pair = 0;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    for (std::size_t j = i + 1; j < cameras.size(); ++j) {
      if (pair++ % step != 0) {
        continue;
      }
      const Eigen::Vector3d a = axis_of_view(cameras[i]);
      const Eigen::Vector3d b = axis_of_view(cameras[j]);
      const Eigen::Vector3d offset = camera_center(cameras[j]) - camera_center(cameras[i]);
      const double cosine = a.dot(b);
      const double sine2 = 1 - cosine * cosine;
      constexpr double kParallel = 0.01;
      Eigen::Vector3d place;
      if (sine2 < kParallel) {
        best.side_by_side = best.side_by_side && cosine > 0;
        if (cosine > 0 || offset.dot(a) <= 0 || offset.dot(b) >= 0) {
          continue;
        }
        place = 0.5 * (camera_center(cameras[i]) + camera_center(cameras[j]));  // face to face
      } else {
        best.side_by_side = false;
        const double s = (offset.dot(a) - offset.dot(b) * cosine) / sine2;
        const double t = (offset.dot(a) * cosine - offset.dot(b)) / sine2;
        if (s <= 0 || t <= 0) {
          continue;
        }
        place = 0.5 * (camera_center(cameras[i]) + s * a + camera_center(cameras[j]) + t * b);
      }
      Gaze gaze = gaze_at(cameras, place);
      double sum = 0;
      for (const double angle : gaze.angle) {
        sum += std::min(angle, kLooksAt);
      }
      if (sum < best_sum) {
        best_sum = sum;
        best = std::move(gaze);
      }
    }
  }
  return best.agreeing > 2 ? refined(cameras, best) : best;
}

Camera extrinsics_read_as(const Camera& camera, const WorldConvention& world,
                          const std::string& value) {
  return value.empty()
             ? camera
             : in_our_world(read_as(in_file_world(camera, world), "extrinsics", value), world);
}

std::vector<RigReading> rig_readings(const std::vector<Camera>& cameras,
                                     const WorldConvention& world) {
  std::vector<RigReading> all = {judged_reading(cameras, world, "")};
  for (const Reading& reading : all_readings()) {
    if (reading.option == "extrinsics") {
      const std::string value(reading.value);
      std::vector<Camera> meant;
      meant.reserve(cameras.size());
      for (const Camera& camera : cameras) {
        meant.push_back(extrinsics_read_as(camera, world, value));
      }
      all.push_back(judged_reading(meant, world, value));
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const RigReading& a, const RigReading& b) {
    return a.possible != b.possible ? a.possible : a.possible && a.doubt < b.doubt;
  });
  return all;
}

std::vector<std::string> likely_values(const std::vector<RigReading>& readings) {
  std::vector<std::string> values;
  for (const RigReading& reading : readings) {
    const bool kept = reading.value.empty() && reading.aimed;
    if (reading.possible && (kept || reading.doubt <= far_more(readings.front().doubt))) {
      values.push_back(reading.value);
    }
  }
  return values;
}

}  // namespace atelier
