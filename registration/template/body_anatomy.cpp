#include "registration/template/body_anatomy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <string>
#include <utility>

#include "core/error.h"

namespace atelier {
namespace {

/// +1 or -1 where the segment goes through the triangle along or against its normal, else 0.
int crossing(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
             const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const auto volume = [](const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                         const Eigen::Vector3d& r,
                         const Eigen::Vector3d& s) { return (q - p).cross(r - p).dot(s - p); };
  const bool before = volume(a, b, c, from) < 0;
  const bool after = volume(a, b, c, to) < 0;
  if (before == after) {
    return 0;
  }
  const bool ab = volume(from, to, a, b) < 0;
  const bool bc = volume(from, to, b, c) < 0;
  const bool ca = volume(from, to, c, a) < 0;
  return ab == bc && bc == ca ? (before ? 1 : -1) : 0;
}

}  // namespace

void check_anatomy(const BodyAnatomy& anatomy, Index vertices) {
  ATELIER_CHECK(static_cast<Index>(anatomy.lumps.size()) == vertices, "one lump for each vertex");
  for (const std::vector<int>& limb : anatomy.limbs) {
    ATELIER_CHECK(limb.size() >= 2, "a limb of two lumps or more");
    for (const int lump : limb) {
      ATELIER_CHECK(
          std::find(anatomy.lumps.begin(), anatomy.lumps.end(), lump) != anatomy.lumps.end(),
          "lump " + std::to_string(lump) + " has no vertex");
    }
  }
}

Eigen::Vector3d body_facing(const BodyAnatomy& anatomy, const Points& body) {
  constexpr double kLies = 0.2;  // of the way that goes along the ground
  check_anatomy(anatomy, body.rows());
  const auto middle = [&](int lump) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0;
    for (Index v = 0; v < body.rows(); ++v) {
      if (anatomy.lumps[static_cast<std::size_t>(v)] == lump) {
        sum += body.row(v).transpose();
        count += 1;
      }
    }
    return Eigen::Vector3d(sum / count);
  };
  const auto limb = [&](Extremity extremity) -> const std::vector<int>& {
    return anatomy.limbs[static_cast<std::size_t>(extremity)];
  };
  Eigen::Vector3d left = Eigen::Vector3d::Zero();
  for (const auto& [l, r] : {std::pair{Extremity::LeftHand, Extremity::RightHand},
                             std::pair{Extremity::LeftFoot, Extremity::RightFoot}}) {
    const auto [at, other] =
        std::mismatch(limb(l).begin(), limb(l).end(), limb(r).begin(), limb(r).end());
    if (at != limb(l).end() && other != limb(r).end()) {
      left += middle(*at) - middle(*other);
    }
  }
  const Eigen::Vector3d facing = left.cross(Eigen::Vector3d::UnitY());
  return facing.norm() > kLies * left.norm() ? Eigen::Vector3d(facing.normalized())
                                             : Eigen::Vector3d::Zero();
}

Points limb_axis(const BodyAnatomy& anatomy, Extremity extremity, const Points& body,
                 const Triangles& faces) {
  check_anatomy(anatomy, body.rows());
  const std::vector<int>& limb = anatomy.limbs[static_cast<std::size_t>(extremity)];
  const auto lump_of = [&](Index v) { return anatomy.lumps[static_cast<std::size_t>(v)]; };
  std::vector<Eigen::RowVector3d> axis;
  for (std::size_t i = 0; i < limb.size(); ++i) {
    Eigen::RowVector3d ring = Eigen::RowVector3d::Zero();
    double edges = 0;
    for (Index f = 0; i > 0 && f < faces.rows(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const int a = faces(f, k);
        const int b = faces(f, (k + 1) % 3);
        if (lump_of(a) == limb[i - 1] && lump_of(b) == limb[i]) {
          ring += (body.row(a) + body.row(b)) / 2;
          edges += 1;
        }
      }
    }
    if (edges > 0) {
      axis.emplace_back(ring / edges);
    }
    Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
    double count = 0;
    for (Index v = 0; v < body.rows(); ++v) {
      if (lump_of(v) == limb[i]) {
        middle += body.row(v);
        count += 1;
      }
    }
    axis.emplace_back(middle / count);
  }
  double farthest = -1;
  Index tip = 0;
  for (Index v = 0; v < body.rows(); ++v) {
    const double distance = (body.row(v) - axis[axis.size() - 2]).squaredNorm();
    if (lump_of(v) == limb.back() && distance > farthest) {
      farthest = distance;
      tip = v;
    }
  }
  axis.emplace_back(body.row(tip));
  Points line(static_cast<Index>(axis.size()), 3);
  for (std::size_t i = 0; i < axis.size(); ++i) {
    line.row(static_cast<Index>(i)) = axis[i];
  }
  return line;
}

int crossings(const Points& loop, const Points& line) {
  return crossings(loop, line, loop.colwise().mean().transpose());
}

int crossings(const Points& loop, const Points& line, const Eigen::Vector3d& tip) {
  int sum = 0;
  for (Index s = 0; s + 1 < line.rows(); ++s) {
    for (Index i = 0; i < loop.rows(); ++i) {
      sum += crossing(tip, loop.row(i).transpose(), loop.row((i + 1) % loop.rows()).transpose(),
                      line.row(s).transpose(), line.row(s + 1).transpose());
    }
  }
  return sum;
}

}  // namespace atelier
