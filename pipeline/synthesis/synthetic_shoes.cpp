// Shoes: lofted round the outline of each foot, so that no toe shows.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"
#include "core/smooth_step.h"
#include "pipeline/synthesis/synthetic_look.h"

namespace atelier {
namespace {

using Color = Eigen::Vector3f;

constexpr int kStations = 48;       // cross-sections from heel to toe
constexpr int kArch = 33;           // points of each over the foot
constexpr int kRing = kArch + 6;    // with rim and sole
constexpr double kRoom = 0.006;     // m between foot and shoe
constexpr double kRim = 0.012;      // m above the floor, where sole and upper meet
constexpr double kReach = 0.008;    // m along the foot whose vertices make a cross-section
constexpr double kRounding = 0.02;  // m over which outlines are smoothed

/// A foot seen from its ankle: `along` to the toes, `across` to the person's left, and its outline.
struct Foot {
  Eigen::Vector3d ankle{0, 0, 0}, along{0, 0, 1}, across{1, 0, 0};
  int ankle_joint = 0, toe_joint = -1;
  double toe_at = 0;                                     ///< m along, of the toe joint
  double heel = 1e9, tip = -1e9;                         ///< m along, ends of the shoe
  std::array<double, kStations> left{}, right{}, top{};  ///< m across, m across, m above the floor

  double station(int i) const {
    return heel + (tip - heel) * static_cast<double>(i) / (kStations - 1);
  }
};

/// Means over `kRounding` on both sides.
void round_off(const Foot& foot, std::array<double, kStations>& values) {
  const std::array<double, kStations> before = values;
  for (int i = 0; i < kStations; ++i) {
    double sum = 0;
    double weights = 0;
    for (int j = 0; j < kStations; ++j) {
      const double apart = std::abs(foot.station(j) - foot.station(i)) / kRounding;
      const double weight = std::max(0.0, 1 - apart);
      sum += weight * before[static_cast<std::size_t>(j)];
      weights += weight;
    }
    values[static_cast<std::size_t>(i)] = sum / weights;
  }
}

Foot foot_of(const BodyModel& body, const Leg& leg, double floor, double collar) {
  const Points joints = rest_positions(body.skeleton);
  Foot foot;
  foot.ankle = joints.row(leg.ankle).transpose();
  foot.ankle_joint = leg.ankle;
  foot.toe_joint = leg.toe;
  if (leg.toe >= 0) {
    Eigen::Vector3d way = joints.row(leg.toe).transpose() - foot.ankle;
    way.y() = 0;
    foot.along = way.norm() > 1e-3 ? Eigen::Vector3d(way.normalized()) : foot.along;
    foot.toe_at = way.norm();
  }
  foot.across = Eigen::Vector3d::UnitY().cross(foot.along);
  const double side = foot.ankle.x();
  std::vector<Eigen::Vector3d> points;  // along, across, above the floor
  for (Index v = 0; v < vertex_count(body); ++v) {
    const Eigen::Vector3d p = body.mesh.vertices.row(v).transpose();
    const Eigen::Vector3d q = p - foot.ankle;
    if (p.x() * side > 0 && p.y() < collar && q.dot(foot.along) < 0.4 && q.norm() < 0.45) {
      points.emplace_back(q.dot(foot.along), q.dot(foot.across), p.y() - floor);
      foot.heel = std::min(foot.heel, points.back().x());
      foot.tip = std::max(foot.tip, points.back().x());
    }
  }
  ATELIER_CHECK(foot.tip > foot.heel, "a body without feet");
  foot.heel -= kRoom;
  foot.tip += 1.5 * kRoom;
  for (int i = 0; i < kStations; ++i) {
    const double at = std::clamp(foot.station(i), foot.heel + 1.5 * kReach, foot.tip - 2 * kReach);
    double left = -1e9;
    double right = 1e9;
    double top = kRim;
    for (const Eigen::Vector3d& q : points) {
      if (std::abs(q.x() - at) < kReach) {
        left = std::max(left, q.y());
        right = std::min(right, q.y());
        top = std::max(top, q.z());
      }
    }
    const auto s = static_cast<std::size_t>(i);
    const bool found = left > right;
    foot.left[s] = found ? left + kRoom : foot.left[s > 0 ? s - 1 : 0];
    foot.right[s] = found ? right - kRoom : foot.right[s > 0 ? s - 1 : 0];
    foot.top[s] = top + kRoom;
  }
  round_off(foot, foot.left);
  round_off(foot, foot.right);
  round_off(foot, foot.top);
  return foot;
}

/// A point of a cross-section: across from its middle as a share of its half width, and height.
Eigen::Vector2d ring_point(int i, double top) {
  const auto sole = [&](int k, double side) -> Eigen::Vector2d {
    return k == 0   ? Eigen::Vector2d(0.90 * side, -kSoleHeight)
           : k == 1 ? Eigen::Vector2d(1.02 * side, -kSoleHeight + 0.004)
                    : Eigen::Vector2d(1.02 * side, kRim);
  };
  if (i < 3) {
    return sole(i, -1);
  }
  if (i >= 3 + kArch) {
    return sole(kRing - 1 - i, 1);
  }
  const double angle = std::numbers::pi * (i - 3) / (kArch - 1);
  const double x = -std::cos(angle);
  const double share = std::pow(std::sin(angle), 0.8);
  return {0.97 * std::copysign(std::pow(std::abs(x), 0.75), x), kRim + (top - kRim) * share};
}

/// How much of its width and height a cross-section keeps near the ends, which are round.
double kept(const Foot& foot, int i) {
  const double from_end = std::min(foot.station(i) - foot.heel, foot.tip - foot.station(i));
  const double t = std::clamp(1 - from_end / 0.028, 0.0, 1.0);
  return std::sqrt(std::max(0.0, 1 - t * t * t));
}

struct Paint {
  Color upper, rubber{0.62F, 0.61F, 0.58F}, lace{0.70F, 0.69F, 0.66F};

  Color at(const Foot& foot, double along, double across, double height) const {
    if (height <= kRim + 0.001 || (along > foot.tip - 0.036 && height < 0.035)) {
      return rubber;
    }
    if (along > 0.035 && along < foot.tip - 0.075 && std::abs(across) < 0.024) {
      return std::fmod(along, 0.014) < 0.0065 ? lace : Color(0.55F * upper);
    }
    return along < -0.03 && height > 0.03 ? Color(0.7F * upper) : upper;
  }
};

Paint drawn_paint(std::uint64_t seed) {
  Random random{seed, 79};
  const double t = uniform(random);
  Paint paint;
  paint.upper = t < 0.30   ? Color(0.05F, 0.05F, 0.06F)
                : t < 0.55 ? Color(0.42F, 0.40F, 0.37F)
                : t < 0.80 ? Color(0.06F, 0.09F, 0.20F)
                           : Color(0.35F, 0.05F, 0.05F);
  return paint;
}

/// Appends one shoe; its rings are `kRing` points each.
void add_shoe(BodyModel& shoes, const Foot& foot, double floor, const Paint& paint) {
  const Index first = shoes.mesh.vertices.rows();
  const Index count = kStations * kRing;
  shoes.mesh.vertices.conservativeResize(first + count, 3);
  shoes.mesh.colors.conservativeResize(first + count, 3);
  shoes.skin.joints.conservativeResize(first + count, 2);
  shoes.skin.weights.conservativeResize(first + count, 2);
  for (int i = 0; i < kStations; ++i) {
    const auto s = static_cast<std::size_t>(i);
    const double along = foot.station(i);
    const double share = std::max(0.3, kept(foot, i));
    const double middle = (foot.left[s] + foot.right[s]) / 2;
    const double half = share * (foot.left[s] - foot.right[s]) / 2;
    const double top = kRim + share * (foot.top[s] - kRim);
    for (int k = 0; k < kRing; ++k) {
      const Eigen::Vector2d p = ring_point(k, top);
      const double across = half * p.x();
      const Index v = first + i * kRing + k;
      Eigen::Vector3d place = foot.ankle + along * foot.along + (middle + across) * foot.across;
      place.y() = floor + p.y();
      shoes.mesh.vertices.row(v) = place.transpose();
      shoes.mesh.colors.row(v) = paint.at(foot, along, across, p.y()).transpose();
      // It bends at the ball of the foot.
      const double toes =
          foot.toe_joint >= 0 ? smooth_step(along, foot.toe_at - 0.015, foot.toe_at + 0.02) : 0;
      shoes.skin.joints.row(v) << foot.ankle_joint, std::max(0, foot.toe_joint);
      shoes.skin.weights.row(v) << 1 - toes, toes;
    }
  }
  const auto at = [&](int i, int k) { return static_cast<int>(first) + i * kRing + k % kRing; };
  const Index faces = shoes.mesh.faces.rows();
  shoes.mesh.faces.conservativeResize(faces + 2 * (kStations - 1) * kRing + 2 * (kRing - 2), 3);
  Index f = faces;
  for (int i = 0; i + 1 < kStations; ++i) {
    for (int k = 0; k < kRing; ++k) {
      shoes.mesh.faces.row(f++) << at(i, k), at(i + 1, k), at(i + 1, k + 1);
      shoes.mesh.faces.row(f++) << at(i, k), at(i + 1, k + 1), at(i, k + 1);
    }
  }
  for (int k = 1; k + 1 < kRing; ++k) {
    shoes.mesh.faces.row(f++) << at(0, 0), at(0, k), at(0, k + 1);
    shoes.mesh.faces.row(f++) << at(kStations - 1, 0), at(kStations - 1, k + 1),
        at(kStations - 1, k);
  }
}

}  // namespace

WornLayer plain_shoes(const BodyModel& body, std::uint64_t seed) {
  const Humanoid person = recognised_humanoid(body.skeleton);
  const Points joints = rest_positions(body.skeleton);
  const double floor = body.mesh.vertices.col(1).minCoeff();
  const double collar = floor + 0.92 * (joints(person.legs[0].ankle, 1) - floor);
  WornLayer layer;
  layer.name = "shoes";
  layer.model.name = layer.name;
  layer.model.skeleton = body.skeleton;
  const Paint paint = drawn_paint(seed);
  for (const Leg& leg : person.legs) {
    add_shoe(layer.model, foot_of(body, leg, floor, collar), floor, paint);
  }
  layer.label = Label::Shoes;
  layer.look.color = Color(1, 1, 1);
  layer.look.roughness = 0.55F;
  return layer;
}

}  // namespace atelier
