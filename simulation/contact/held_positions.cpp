#include "simulation/contact/held_positions.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "core/error.h"
#include "simulation/cloth/attached_position.h"
#include "simulation/contact/contact_distance.h"

namespace atelier {
namespace {

constexpr double kAlong = 25000;  // N/m2, hold of a place along the skin, per metre of band
constexpr double kAcross = 1000;  // N/m2, and off it
constexpr double kMostStrain = 0.15;
constexpr int kHeldRounds = 40;

/// A vertex of a band and where the body would have it.
struct BandNode {
  Eigen::Vector3d place;   // m
  Eigen::Vector3d normal;  // of its triangle
  double height;           // m over the triangle
  double lowest;           // m, that it keeps
  double length;           // m of band that is its own
};

Eigen::Vector3d normal_at(const Attachment& a, const Points& body, const Triangles& faces) {
  const Eigen::Vector3d p = body.row(faces(a.triangle, 0));
  const Eigen::Vector3d q = body.row(faces(a.triangle, 1));
  const Eigen::Vector3d r = body.row(faces(a.triangle, 2));
  return (q - p).cross(r - p).normalized();
}

/// One band in its balance.
class BandSolve {
 public:
  BandSolve(const ClothBand& band, std::vector<BandNode> nodes)
      : band_(band), nodes_(std::move(nodes)) {
    x_.reserve(nodes_.size());
    for (const BandNode& node : nodes_) {
      x_.push_back(node.place);
    }
    const double whole = std::accumulate(band.rest.begin(), band.rest.end(), 0.0);
    share_ = whole > 0 ? band.rest_girth / whole : 0;
  }

  std::vector<Eigen::Vector3d> solved() {
    // The forces first, then the lengths alone: cloth slides before it tears.
    for (int round = 0; round < 2 * kHeldRounds; ++round) {
      for (std::size_t i = 0; i < x_.size() && round < kHeldRounds; ++i) {
        balance(i);
      }
      for (std::size_t i = 0; i < links(); ++i) {
        limit(i);
      }
      for (std::size_t i = 0; i < x_.size(); ++i) {
        keep_off(i);
      }
    }
    return x_;
  }

 private:
  std::size_t links() const { return x_.size() - (band_.closed ? 0 : 1); }
  std::size_t next(std::size_t i) const { return (i + 1) % x_.size(); }

  /// A Newton step of one vertex, its neighbours where they are.
  void balance(std::size_t i) {
    const BandNode& node = nodes_[i];
    const Eigen::Vector3d off = x_[i] - node.place;
    const Eigen::Matrix3d across = node.normal * node.normal.transpose();
    Eigen::Matrix3d stiffness =
        node.length * (kAlong * (Eigen::Matrix3d::Identity() - across) + kAcross * across);
    Eigen::Vector3d force = -stiffness * off;
    const auto pull = [&](std::size_t link, std::size_t other) {
      const double rest = share_ * band_.rest[link];
      const Eigen::Vector3d to = x_[other] - x_[i];
      const double length = to.norm();
      if (!(rest > 0) || !(length > rest)) {
        return;
      }
      const Eigen::Vector3d direction = to / length;
      const double k = band_.stiffness / rest;
      force += k * (length - rest) * direction;
      const Eigen::Matrix3d along = direction * direction.transpose();
      stiffness += k * along + k * (1 - rest / length) * (Eigen::Matrix3d::Identity() - along);
    };
    if (band_.closed || i > 0) {
      const std::size_t before = i == 0 ? x_.size() - 1 : i - 1;
      pull(before, before);
    }
    if (band_.closed || i + 1 < x_.size()) {
      pull(i, next(i));
    }
    x_[i] += stiffness.inverse() * force;
    keep_off(i);
  }

  /// Brings the two ends of a link to a length that cloth takes.
  void limit(std::size_t link) {
    Eigen::Vector3d& a = x_[link];
    Eigen::Vector3d& b = x_[next(link)];
    const Eigen::Vector3d between = b - a;
    const double length = between.norm();
    const double rest = band_.rest[link];
    const double wanted = std::clamp(length, (1 - kMostStrain) * rest, (1 + kMostStrain) * rest);
    if (length > 0 && wanted != length) {
      const Eigen::Vector3d half = 0.5 * (wanted / length - 1) * between;
      a -= half;
      b += half;
    }
  }

  void keep_off(std::size_t i) {
    const BandNode& node = nodes_[i];
    const double height = node.height + (x_[i] - node.place).dot(node.normal);
    if (height < node.lowest) {
      x_[i] += (node.lowest - height) * node.normal;
    }
  }

  const ClothBand& band_;
  std::vector<BandNode> nodes_;
  std::vector<Eigen::Vector3d> x_;
  double share_ = 0;  // of the band's rest lengths over the cloth's
};

}  // namespace

ClothBand make_band(const Points& rest, std::vector<int> vertices, bool closed, double rest_girth,
                    double stiffness) {
  ATELIER_CHECK(vertices.size() >= 2, "a band of two vertices or more");
  for (const int v : vertices) {
    ATELIER_CHECK(v >= 0 && v < rest.rows(),
                  "vertex " + std::to_string(v) + " of a band is no vertex");
  }
  ClothBand band{std::move(vertices), {}, closed, rest_girth, stiffness};
  const std::size_t n = band.vertices.size();
  for (std::size_t i = 0; i + (closed ? 0 : 1) < n; ++i) {
    band.rest.push_back((rest.row(band.vertices[i]) - rest.row(band.vertices[(i + 1) % n])).norm());
  }
  return band;
}

Points held_positions(const HeldCloth& held, const Points& body, const Triangles& body_faces) {
  Points at = Points::Zero(held.vertices, 3);
  std::map<int, const Attachment*> attachment_of;
  for (const Attachment& a : held.attachments) {
    ATELIER_CHECK(a.triangle >= 0 && a.triangle < body_faces.rows(),
                  "attachment to triangle " + std::to_string(a.triangle) + " of the body");
    at.row(a.vertex) = attached_position(a, body, body_faces).transpose();
    attachment_of[a.vertex] = &a;
  }
  for (const ClothBand& band : held.bands) {
    const double whole = std::accumulate(band.rest.begin(), band.rest.end(), 0.0);
    const double keep =
        std::max(held.thickness, contact_distance(whole / static_cast<double>(band.rest.size())));
    std::vector<BandNode> nodes;
    for (const int v : band.vertices) {
      const auto found = attachment_of.find(v);
      ATELIER_CHECK(found != attachment_of.end(), "an attachment of each vertex of a band");
      const Attachment& a = *found->second;
      nodes.push_back({at.row(v).transpose(), normal_at(a, body, body_faces), a.distance,
                       std::min(a.distance, keep),
                       whole / static_cast<double>(band.vertices.size())});
    }
    const std::vector<Eigen::Vector3d> solved = BandSolve(band, std::move(nodes)).solved();
    for (std::size_t i = 0; i < solved.size(); ++i) {
      at.row(band.vertices[i]) = solved[i].transpose();
    }
  }
  return at;
}

}  // namespace atelier
