#include "capture/surface/refine_cameras.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/median.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kRadius = 5;  // px: patches of 11 x 11
constexpr int kSamples = (2 * kRadius + 1) * (2 * kRadius + 1);
constexpr std::size_t kMaxViews = 5;      // of a place, those that face it most
constexpr double kMinContrast = 0.012;    // standard deviation of a patch of values in [0,1]
constexpr double kSteepestCosine = 0.45;  // of view and normal: beyond, patches look different
constexpr double kSecondBest = 0.04;      // of correlation, that another place must be worse by
constexpr double kNoise = 0.3;            // px of a match
constexpr double kMinOff = 0.1;           // px, that calibrations are off by at least
constexpr double kLoss = 1;               // px beyond which a match counts less and less
constexpr int kMinPlaces = 100;

using Patch = Eigen::Matrix<double, kSamples, 1>;
using Pixels = Eigen::Matrix<double, kSamples, 2>;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Jacobian6 = Eigen::Matrix<double, 2, 6>;

/// Where a place was found in a view.
struct Match {
  int camera = 0;
  Eigen::Vector2d pixel;
};

struct Track {
  Eigen::Vector3d point;
  std::vector<Match> matches;
};

/// Values between pixels, less their mean, of length 1; nothing at the border or without texture.
std::optional<Patch> patch_at(const Image& image, const Pixels& pixels,
                              const Eigen::Vector2d& shift) {
  Patch patch;
  for (int k = 0; k < kSamples; ++k) {
    const double x = pixels(k, 0) + shift.x() - 0.5;
    const double y = pixels(k, 1) + shift.y() - 0.5;
    if (!(x >= 0 && y >= 0 && x < image.width - 1 && y < image.height - 1)) {
      return std::nullopt;
    }
    const int column = saturating_cast<int>(x);
    const int row = saturating_cast<int>(y);
    const double u = x - column;
    const double v = y - row;
    const float* at = &image.data[static_cast<std::size_t>(row) * image.width + column];
    const float* below = at + image.width;
    patch(k) = (1 - v) * ((1 - u) * at[0] + u * at[1]) + v * ((1 - u) * below[0] + u * below[1]);
  }
  patch.array() -= patch.mean();
  const double length = patch.norm();
  if (length < kMinContrast * std::sqrt(kSamples)) {
    return std::nullopt;
  }
  return patch / length;
}

/// Where the samples of a patch on the place's tangent plane are in a view.
std::optional<Pixels> pixels_of(const Camera& camera, const SeenPlace& place,
                                const Eigen::Vector3d& right, const Eigen::Vector3d& down) {
  Pixels pixels;
  for (int k = 0; k < kSamples; ++k) {
    const int i = k % (2 * kRadius + 1) - kRadius;
    const int j = k / (2 * kRadius + 1) - kRadius;
    const auto pixel = project(camera, place.point + i * right + j * down);
    if (!pixel) {
      return std::nullopt;
    }
    pixels.row(k) = pixel->transpose();
  }
  return pixels;
}

/// The whole pixel by which the patch is shifted in a view; nothing where it fits badly, at the
/// rim of what is looked at, or at two places.
std::optional<Eigen::Vector2d> coarse_shift(const Image& image, const Pixels& pixels,
                                            const Patch& wanted,
                                            const RefineCameraOptions& options) {
  const int reach = options.search;
  const int side = 2 * reach + 1;
  Eigen::MatrixXd fit = Eigen::MatrixXd::Constant(side, side, -1);
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      if (const auto patch = patch_at(image, pixels, {i - reach, j - reach})) {
        fit(i, j) = patch->dot(wanted);
      }
    }
  }
  Index i = 0;
  Index j = 0;
  const double best = fit.maxCoeff(&i, &j);
  constexpr double kCoarse = 0.15;  // of correlation, that half a pixel off may cost
  if (best < options.correlation - kCoarse || i == 0 || j == 0 || i == side - 1 || j == side - 1) {
    return std::nullopt;
  }
  for (Index b = 0; b < side; ++b) {
    for (Index a = 0; a < side; ++a) {
      if (std::max(std::abs(a - i), std::abs(b - j)) > 1 && fit(a, b) > best - kSecondBest) {
        return std::nullopt;
      }
    }
  }
  return Eigen::Vector2d(static_cast<double>(i - reach), static_cast<double>(j - reach));
}

/// The shift to a fraction of a pixel (Lucas and Kanade 1981 on normalised patches).
std::optional<Eigen::Vector2d> fine_shift(const Image& image, const Pixels& pixels,
                                          const Patch& wanted, Eigen::Vector2d shift,
                                          const RefineCameraOptions& options) {
  constexpr int kIterations = 5;
  constexpr double kStep = 0.5;  // px, of central differences
  const Eigen::Vector2d start = shift;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const auto patch = patch_at(image, pixels, shift);
    Eigen::Matrix<double, kSamples, 2> slope;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
      const auto after = patch_at(image, pixels, shift + step);
      const auto before = patch_at(image, pixels, shift - step);
      if (!patch || !after || !before) {
        return std::nullopt;
      }
      slope.col(axis) = (*after - *before) / (2 * kStep);
    }
    const Eigen::Matrix2d normal = slope.transpose() * slope;
    if (!(normal.determinant() > 1e-8)) {
      return std::nullopt;
    }
    shift += normal.ldlt().solve(slope.transpose() * (wanted - *patch));
    if (!((shift - start).lpNorm<Eigen::Infinity>() < 1.5)) {
      return std::nullopt;
    }
  }
  const auto patch = patch_at(image, pixels, shift);
  return patch && patch->dot(wanted) >= options.correlation ? std::optional(shift) : std::nullopt;
}

/// Looks for a place in the views that have it.
Track find_track(const std::vector<Camera>& cameras, const std::vector<Image>& images,
                 const SeenPlace& place, const RefineCameraOptions& options) {
  Track track{place.point, {}};
  std::vector<std::pair<double, int>> views;
  for (const int view : place.views) {
    const Eigen::Vector3d to_camera =
        camera_center(cameras[static_cast<std::size_t>(view)]) - place.point;
    const double cosine = place.normal.dot(to_camera.normalized());
    if (cosine > kSteepestCosine) {
      views.emplace_back(-cosine, view);
    }
  }
  if (views.size() < 2) {
    return track;
  }
  std::sort(views.begin(), views.end());
  views.resize(std::min(views.size(), kMaxViews));
  const auto first = static_cast<std::size_t>(views[0].second);
  const Eigen::Vector3d axis = cameras[first].camera_from_world_rotation.row(0).transpose();
  const double spacing = camera_from_world(cameras[first], place.point).z() / cameras[first].fx;
  const Eigen::Vector3d down = place.normal.cross(axis).normalized() * spacing;
  const Eigen::Vector3d right = down.cross(place.normal);
  const auto pixels = pixels_of(cameras[first], place, right, down);
  const auto wanted = pixels ? patch_at(images[first], *pixels, {0, 0}) : std::nullopt;
  if (!wanted) {
    return track;
  }
  track.matches.push_back({views[0].second, *project(cameras[first], place.point)});
  for (std::size_t k = 1; k < views.size(); ++k) {
    const auto view = static_cast<std::size_t>(views[k].second);
    const auto there = pixels_of(cameras[view], place, right, down);
    const auto coarse = there ? coarse_shift(images[view], *there, *wanted, options) : std::nullopt;
    const auto shift =
        coarse ? fine_shift(images[view], *there, *wanted, *coarse, options) : std::nullopt;
    if (shift) {
      track.matches.push_back({views[k].second, *project(cameras[view], place.point) + *shift});
    }
  }
  return track;
}

double cauchy(double squared_error) {
  return 1 / (1 + squared_error / (kLoss * kLoss));
}

/// Pose changes of every camera since calibration: rotation (rad) and translation (m), both in the
/// camera's frame.
Vector6d change_of(const Camera& camera, const Camera& calibrated) {
  const Eigen::Matrix3d turn =
      camera.camera_from_world_rotation * calibrated.camera_from_world_rotation.transpose();
  const Eigen::AngleAxisd rotation(turn);
  Vector6d change;
  change << rotation.angle() * rotation.axis(),
      camera.camera_from_world_translation - turn * calibrated.camera_from_world_translation;
  return change;
}

void apply_change(Camera& camera, const Vector6d& change) {
  const double angle = change.head<3>().norm();
  const Eigen::Matrix3d turn =
      angle > 0 ? Eigen::AngleAxisd(angle, change.head<3>() / angle).toRotationMatrix()
                : Eigen::Matrix3d::Identity();
  camera.camera_from_world_rotation = turn * camera.camera_from_world_rotation;
  camera.camera_from_world_translation =
      turn * camera.camera_from_world_translation + change.tail<3>();
}

/// One step of Gauss and Newton over poses and places.
/// @param distance  m from cameras to places, about
/// @param off       px that calibration may be off
void adjust(std::vector<Camera>& cameras, const std::vector<Camera>& calibrated,
            std::vector<Track>& tracks, double distance, double off) {
  const auto n = static_cast<Index>(6 * cameras.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const auto at = static_cast<Index>(6 * c);
    const double turn = off / cameras[c].fx;
    Vector6d weight;
    weight << Eigen::Vector3d::Constant(1 / (turn * turn)),
        Eigen::Vector3d::Constant(1 / (turn * turn * distance * distance));
    normal.diagonal().segment<6>(at) += weight;
    right.segment<6>(at) -= weight.cwiseProduct(change_of(cameras[c], calibrated[c]));
  }
  struct Part {  // of one match
    Index at;
    Eigen::Matrix<double, 6, 3> mixed;
  };
  struct Eliminated {
    std::vector<Part> parts;
    Eigen::Matrix3d inverse;
    Eigen::Vector3d right;
  };
  std::vector<Eliminated> eliminated(tracks.size());
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    Eliminated& own = eliminated[t];
    Eigen::Matrix3d places = Eigen::Matrix3d::Identity() * 1e-6;
    own.right.setZero();
    for (const Match& match : tracks[t].matches) {
      const Camera& camera = cameras[static_cast<std::size_t>(match.camera)];
      const auto pixel = project(camera, tracks[t].point);
      const auto by_point = project_jacobian(camera, tracks[t].point);
      if (!pixel || !by_point) {
        continue;
      }
      const Eigen::Vector2d error = match.pixel - *pixel;
      const double weight = cauchy(error.squaredNorm()) / (kNoise * kNoise);
      const Eigen::Matrix<double, 2, 3> by_place =
          *by_point * camera.camera_from_world_rotation.transpose();
      const Eigen::Vector3d p = camera_from_world(camera, tracks[t].point);
      Eigen::Matrix3d cross;  // of a small turn: -[p]x
      cross << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
      Jacobian6 by_pose;
      by_pose << by_place * cross, by_place;
      const auto at = static_cast<Index>(6 * match.camera);
      normal.block<6, 6>(at, at) += weight * by_pose.transpose() * by_pose;
      right.segment<6>(at) += weight * by_pose.transpose() * error;
      places += weight * by_point->transpose() * *by_point;
      own.right += weight * by_point->transpose() * error;
      own.parts.push_back({at, weight * by_pose.transpose() * *by_point});
    }
    own.inverse = places.inverse();
    for (const Part& a : own.parts) {
      const Eigen::Matrix<double, 6, 3> through = a.mixed * own.inverse;
      right.segment<6>(a.at) -= through * own.right;
      for (const Part& b : own.parts) {
        normal.block<6, 6>(a.at, b.at) -= through * b.mixed.transpose();
      }
    }
  }
  const Eigen::VectorXd change = normal.ldlt().solve(right);
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    Eigen::Vector3d moved = eliminated[t].right;
    for (const Part& part : eliminated[t].parts) {
      moved -= part.mixed.transpose() * change.segment<6>(part.at);
    }
    tracks[t].point += eliminated[t].inverse * moved;
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    apply_change(cameras[c], change.segment<6>(static_cast<Index>(6 * c)));
  }
}

double median_error(const std::vector<Camera>& cameras, const std::vector<Track>& tracks) {
  std::vector<double> errors;
  for (const Track& track : tracks) {
    for (const Match& match : track.matches) {
      const auto pixel = project(cameras[static_cast<std::size_t>(match.camera)], track.point);
      errors.push_back(pixel ? (*pixel - match.pixel).norm() : 1e3);
    }
  }
  return median(errors);
}

}  // namespace

OptionTable describe(RefineCameraOptions& options) {
  OptionTable table;
  table.add("search", options.search, 1, 16, "px", "Search radius of a patch");
  table.add("points", options.points, 100, 1000000, "",
            "Number of surface points that are searched in the images");
  table.add("correlation", options.correlation, 0, 1, "",
            "Minimum correlation of a matching patch");
  return table;
}

RefinedCameras refine_cameras(const std::vector<Camera>& cameras, const std::vector<Image>& images,
                              const std::vector<SeenPlace>& places,
                              const RefineCameraOptions& options) {
  ATELIER_CHECK(cameras.size() == images.size(), "an image for each camera");
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    ATELIER_CHECK(images[i].width == cameras[i].width && images[i].height == cameras[i].height &&
                      images[i].channels == 1,
                  "an image of another size than its camera's");
  }
  for (const SeenPlace& place : places) {
    for (const int view : place.views) {
      ATELIER_CHECK(view >= 0 && view < static_cast<int>(cameras.size()), "a view out of range");
    }
  }
  RefinedCameras result;
  result.cameras = cameras;
  result.matches.assign(cameras.size(), 0);
  const std::size_t step =
      std::max<std::size_t>(1, places.size() / static_cast<std::size_t>(options.points));
  std::vector<Track> found((places.size() + step - 1) / step);
  parallel_for(static_cast<Index>(found.size()), 16, [&](Index begin, Index end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      found[i] = find_track(cameras, images, places[i * step], options);
    }
  });
  std::erase_if(found, [](const Track& track) { return track.matches.size() < 2; });
  if (found.size() < kMinPlaces) {
    return result;
  }
  double distance = 0;
  for (const Track& track : found) {
    const auto first = static_cast<std::size_t>(track.matches[0].camera);
    distance +=
        (camera_center(cameras[first]) - track.point).norm() / static_cast<double>(found.size());
    for (const Match& match : track.matches) {
      ++result.matches[static_cast<std::size_t>(match.camera)];
    }
  }
  result.before = median_error(cameras, found);
  // Places take up about half of what calibrations are off by: two or three views have each.
  const double off = std::max(2 * result.before, kMinOff);
  constexpr int kSteps = 10;
  for (int i = 0; i < kSteps; ++i) {
    adjust(result.cameras, cameras, found, distance, off);
  }
  result.after = median_error(result.cameras, found);
  return result;
}

}  // namespace atelier
