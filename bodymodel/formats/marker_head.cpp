#include "bodymodel/formats/marker_head.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "bodymodel/rotation.h"
#include "core/error.h"

namespace atelier {
namespace {

Eigen::Matrix3d rigid_turn(const Points& from, const Points& to) {
  const Eigen::Matrix3d moment =
      (to.rowwise() - to.colwise().mean()).transpose() * (from.rowwise() - from.colwise().mean());
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moment, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  signs.z() = signs.z() < 0 ? -1 : 1;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

Points taken(const Points& all, const std::vector<std::size_t>& rows) {
  Points some(static_cast<Index>(rows.size()), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    some.row(static_cast<Index>(i)) = all.row(static_cast<Index>(rows[i]));
  }
  return some;
}

}  // namespace

double head_pitch(const Points& places, const std::vector<std::size_t>& band,
                  const std::vector<Points>& recorded, const std::vector<std::vector<bool>>& seen) {
  ATELIER_CHECK(recorded.size() == seen.size(), "frames of markers and of what was seen");
  double sum = 0;
  int count = 0;
  for (std::size_t f = 0; f < recorded.size(); ++f) {
    ATELIER_CHECK(
        recorded[f].rows() == places.rows() && static_cast<Index>(seen[f].size()) == places.rows(),
        "a place for each marker");
    std::vector<std::size_t> rows;
    std::copy_if(band.begin(), band.end(), std::back_inserter(rows),
                 [&](std::size_t m) { return seen[f][m]; });
    if (rows.size() >= 3) {
      const Eigen::Matrix3d turn = rigid_turn(taken(places, rows), taken(recorded[f], rows));
      sum += std::asin(std::clamp(turn(1, 2), -1.0, 1.0));
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

Points levelled(Points places, const std::vector<std::size_t>& band, double pitch) {
  const Points on_head = taken(places, band);
  const Eigen::RowVector3d middle = on_head.colwise().mean();
  const Eigen::Matrix3d turn = rotation_matrix({-pitch, 0, 0});
  for (std::size_t i = 0; i < band.size(); ++i) {
    places.row(static_cast<Index>(band[i])) =
        middle + (on_head.row(static_cast<Index>(i)) - middle) * turn.transpose();
  }
  return places;
}

}  // namespace atelier
