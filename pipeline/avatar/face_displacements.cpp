#include "pipeline/avatar/face_displacements.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "core/error.h"
#include "core/types.h"

namespace atelier {
namespace {

constexpr std::size_t kFewest = 4;  // points that tell how a head is turned

/// Of these rows those that were found.
std::vector<Index> found_among(const Keypoints3d& face, const std::vector<Index>& rows) {
  std::vector<Index> found;
  for (const Index k : rows) {
    if (face(k, 3) > 0) {
      found.push_back(k);
    }
  }
  return found;
}

/// The points that tell how the head is turned; none where too few were found.
std::vector<Index> steady_points(const Keypoints3d& face) {
  constexpr Index kIbug = 68;
  std::vector<Index> all(static_cast<std::size_t>(face.rows()));
  for (std::size_t k = 0; k < all.size(); ++k) {
    all[k] = static_cast<Index>(k);
  }
  if (face.rows() == kIbug) {
    std::vector<Index> stiff = found_among(face, {27, 28, 29, 30, 36, 39, 42, 45});
    if (stiff.size() >= kFewest) {
      return stiff;
    }
  }
  std::vector<Index> found = found_among(face, all);
  return found.size() >= kFewest ? found : std::vector<Index>{};
}

/// A face where the mean one is; no rows where nobody knows how.
Points laid_on(const Keypoints3d& face, const Points& mean) {
  const std::vector<Index> steady = steady_points(face);
  if (steady.empty()) {
    return Points(0, 3);
  }
  const Points points = face.leftCols<3>();
  const Eigen::Matrix3Xd from = points(steady, Eigen::all).transpose();
  const Eigen::Matrix3Xd to = mean(steady, Eigen::all).transpose();
  const Eigen::Matrix4d motion = Eigen::umeyama(from, to, false);
  return (points * motion.topLeftCorner<3, 3>().transpose()).rowwise() +
         motion.topRightCorner<3, 1>().transpose();
}

/// The mean of the faces laid on it; points that no frame has stay where they are.
Points mean_face(const std::vector<Keypoints3d>& faces, const Points& before) {
  Points sum = Points::Zero(before.rows(), 3);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(before.rows());
  for (const Keypoints3d& face : faces) {
    const Points own = laid_on(face, before);
    for (Index k = 0; k < own.rows(); ++k) {
      if (face(k, 3) > 0) {
        sum.row(k) += own.row(k);
        count[k] += 1;
      }
    }
  }
  for (Index k = 0; k < sum.rows(); ++k) {
    sum.row(k) = count[k] > 0 ? Eigen::RowVector3d(sum.row(k) / count[k])
                              : Eigen::RowVector3d(before.row(k));
  }
  return sum;
}

}  // namespace

std::vector<int> face_keypoints(const std::vector<std::string>& names) {
  std::vector<int> places;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i].starts_with("face_")) {
      places.push_back(static_cast<int>(i));
    }
  }
  return places;
}

std::vector<std::vector<float>> face_displacements(const std::vector<Keypoints3d>& faces) {
  constexpr int kRounds = 4;
  constexpr double kCentimetre = 100;
  constexpr double kMost = 3;
  if (faces.empty()) {
    return {};
  }
  const Index count = faces[0].rows();
  std::size_t best = 0;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    ATELIER_CHECK(faces[f].rows() == count, "faces of one schema have as many points");
    const auto found = [&](std::size_t at) { return (faces[at].col(3).array() > 0).count(); };
    best = found(f) > found(best) ? f : best;
  }
  Points mean = faces[best].leftCols<3>();
  for (int round = 0; round < kRounds; ++round) {
    mean = mean_face(faces, mean);
  }
  std::vector<std::vector<float>> all;
  for (const Keypoints3d& face : faces) {
    std::vector<float>& off = all.emplace_back(3 * static_cast<std::size_t>(count), 0.0F);
    const Points own = laid_on(face, mean);
    for (Index k = 0; k < own.rows(); ++k) {
      for (Index c = 0; c < 3 && face(k, 3) > 0; ++c) {
        off[static_cast<std::size_t>(3 * k + c)] =
            static_cast<float>(std::clamp(kCentimetre * (own(k, c) - mean(k, c)), -kMost, kMost));
      }
    }
  }
  return all;
}

}  // namespace atelier
