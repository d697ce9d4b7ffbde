#include "registration/remove_slivers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/topology.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr int kSliverRounds = 30;
constexpr double kWider = 1e-6;       // deg: what counts as widened
constexpr double kTurnedMost = 0.5;   // cosine of how far a triangle may turn
constexpr double kTooThinToFace = 2;  // deg: a triangle with a smaller corner faces anywhere

double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

/// How far apart two lines through points are at their nearest, m; 0 for parallel ones.
double lines_apart(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   const Eigen::Vector3d& d) {
  const Eigen::Vector3d across = (b - a).cross(d - c);
  const double length = across.norm();
  return length > 0 ? std::abs(across.dot(c - a)) / length : 0;
}

/// A surface whose corners are widened.
class SliverRemoval {
 public:
  SliverRemoval(const Mesh& mesh, const RemoveSliversOptions& options)
      : points_(mesh.vertices), faces_(mesh.faces), options_(options) {
    look();
  }

  bool has_slivers() const { return (corners_.array() < options_.least).any(); }
  const Points& points() const { return points_; }
  const Triangles& faces() const { return faces_; }

  /// Flips edges of slivers, none beside another; true if any was.
  bool flip() {
    std::vector<char> touched(static_cast<std::size_t>(points_.rows()), 0);
    const Adjacency beside = vertex_neighbors(topology_);
    bool any = false;
    for (Index f = 0; f < faces_.rows(); ++f) {
      if (corners_[f] >= options_.least) {
        continue;
      }
      int best_edge = -1;
      double best = 0;
      for (int k = 0; k < 3; ++k) {
        const double wider = flip_widens(f, k, beside, touched);
        if (wider > best) {
          best = wider;
          best_edge = k;
        }
      }
      if (best_edge >= 0) {
        flip_edge(f, best_edge, touched);
        any = true;
      }
    }
    if (any) {
      look();
    }
    return any;
  }

  /// Slides vertices of slivers; true if any moved.
  bool slide(const TriangleTree& surface) {
    bool any = false;
    std::vector<char> tried(static_cast<std::size_t>(points_.rows()), 0);
    for (Index f = 0; f < faces_.rows(); ++f) {
      for (int k = 0; k < 3 && corners_[f] < options_.least; ++k) {
        const int v = faces_(f, k);
        if (tried[static_cast<std::size_t>(v)] == 0) {
          tried[static_cast<std::size_t>(v)] = 1;
          any = slide_vertex(v, surface) || any;
        }
      }
    }
    return any;
  }

 private:
  Eigen::Vector3d point(int vertex) const { return points_.row(vertex).transpose(); }

  /// Twice the area along the normal.
  Eigen::Vector3d facing(int a, int b, int c) const {
    return (point(b) - point(a)).cross(point(c) - point(a));
  }

  double corner_of(Index face) const {
    return min_corner(point(faces_(face, 0)), point(faces_(face, 1)), point(faces_(face, 2)));
  }

  double min_around(int vertex) const {
    double least = 180;
    for (const int face : around_[vertex]) {
      least = std::min(least, corner_of(face));
    }
    return least;
  }

  void look() {
    topology_ = topology_of(faces_, points_.rows());
    around_ = vertex_faces(topology_);
    corners_ = min_corners(points_, faces_);
    rim_.assign(static_cast<std::size_t>(points_.rows()), {});
    branching_.assign(static_cast<std::size_t>(points_.rows()), 0);
    for (Index e = 0; e < topology_.edges.rows(); ++e) {
      const std::size_t sharing = corners_of_edge(topology_, e).size();
      for (int k = 0; k < 2; ++k) {
        const auto v = static_cast<std::size_t>(topology_.edges(e, k));
        if (sharing == 1) {
          rim_[v].push_back(topology_.edges(e, 1 - k));
        } else if (sharing > 2) {
          branching_[v] = 1;
        }
      }
    }
  }

  /// By how much flipping an edge would widen the smallest corner beside it, deg; 0 where it may
  /// not be flipped.
  double flip_widens(Index face, int k, const Adjacency& beside,
                     const std::vector<char>& touched) const {
    const int edge = topology_.face_edges(face, k);
    if (edge < 0 || corners_of_edge(topology_, edge).size() != 2) {
      return 0;
    }
    const auto sharing = corners_of_edge(topology_, edge);
    const int other = sharing[0] / 3 == face ? sharing[1] : sharing[0];
    const int a = faces_(face, k);
    const int b = faces_(face, (k + 1) % 3);
    const int c = faces_(face, (k + 2) % 3);
    const int d = faces_(other / 3, (other % 3 + 2) % 3);
    for (const int v : {a, b, c, d}) {
      if (touched[static_cast<std::size_t>(v)] != 0) {
        return 0;
      }
    }
    const auto row = beside[c];
    const bool one_way_round = faces_(other / 3, other % 3) == b;
    if (c == d || !one_way_round || std::binary_search(row.begin(), row.end(), d) ||
        lines_apart(point(a), point(b), point(c), point(d)) > options_.off) {
      return 0;
    }
    const Eigen::Vector3d before = facing(a, b, c) + facing(b, a, d);
    for (const Eigen::Vector3d& after : {facing(a, d, c), facing(d, b, c)}) {
      if (!(after.dot(before) > kTurnedMost * after.norm() * before.norm())) {
        return 0;
      }
    }
    const double was = std::min(corners_[face], corners_[other / 3]);
    const double is = std::min(min_corner(point(a), point(d), point(c)),
                               min_corner(point(d), point(b), point(c)));
    return is > was + kWider ? is - was : 0;
  }

  void flip_edge(Index face, int k, std::vector<char>& touched) {
    const auto sharing = corners_of_edge(topology_, topology_.face_edges(face, k));
    const int other = sharing[0] / 3 == face ? sharing[1] : sharing[0];
    const int a = faces_(face, k);
    const int b = faces_(face, (k + 1) % 3);
    const int c = faces_(face, (k + 2) % 3);
    const int d = faces_(other / 3, (other % 3 + 2) % 3);
    faces_.row(face) << a, d, c;
    faces_.row(other / 3) << d, b, c;
    for (const int v : {a, b, c, d}) {
      touched[static_cast<std::size_t>(v)] = 1;
    }
  }

  /// Where a vertex might go.
  std::vector<Eigen::Vector3d> places_of(int vertex, const Eigen::Vector3d& normal, double reach,
                                         const TriangleTree& surface) const {
    const Eigen::Vector3d at = point(vertex);
    const std::vector<int>& rim = rim_[static_cast<std::size_t>(vertex)];
    std::vector<Eigen::Vector3d> places;
    constexpr int kSteps = 5;
    for (int step = 0; step < kSteps; ++step) {
      const double share = std::ldexp(1.0, -step - 1);
      if (rim.size() == 2) {
        for (const int end : {0, 1}) {
          const Eigen::Vector3d to = at + share * (point(rim[static_cast<std::size_t>(end)]) - at);
          const Eigen::Vector3d from = point(rim[static_cast<std::size_t>(1 - end)]);
          const Eigen::Vector3d along = (to - from).normalized();
          if ((at - from).cross(along).norm() <= options_.off) {
            places.push_back(to);
          }
        }
        continue;
      }
      const Eigen::Vector3d across = normal.unitOrthogonal();
      constexpr int kWays = 8;
      for (int way = 0; way < kWays; ++way) {
        const double angle = 2 * std::numbers::pi * way / kWays;
        const Eigen::Vector3d to =
            at +
            share * reach * (std::cos(angle) * across + std::sin(angle) * normal.cross(across));
        places.push_back(closest_point(surface, to).point);
      }
    }
    return places;
  }

  /// Moves a vertex to where the smallest corner around it is widest; false where it is.
  bool slide_vertex(int vertex, const TriangleTree& surface) {
    const auto v = static_cast<std::size_t>(vertex);
    if (branching_[v] != 0 || (!rim_[v].empty() && rim_[v].size() != 2)) {
      return false;
    }
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector3d> facings;
    double reach = 0;
    for (const int face : around_[vertex]) {
      facings.push_back(facing(faces_(face, 0), faces_(face, 1), faces_(face, 2)));
      normal += facings.back();
      for (int k = 0; k < 3; ++k) {
        reach = std::max(reach, (point(faces_(face, k)) - point(vertex)).norm());
      }
    }
    if (!(normal.norm() > 0)) {
      return false;
    }
    normal.normalize();
    for (std::size_t i = 0; i < facings.size(); ++i) {
      const bool thin = corners_[around_[vertex][i]] < kTooThinToFace;
      facings[i] = thin ? normal : facings[i].normalized();
    }
    const auto turned = [&] {
      for (std::size_t i = 0; i < facings.size(); ++i) {
        const auto corner = faces_.row(around_[vertex][i]);
        const Eigen::Vector3d now = facing(corner[0], corner[1], corner[2]);
        if (!(now.dot(facings[i]) > kTurnedMost * now.norm())) {
          return true;
        }
      }
      return false;
    };
    const Eigen::Vector3d before = point(vertex);
    Eigen::Vector3d best = before;
    double widest = min_around(vertex) + kWider;
    for (const Eigen::Vector3d& place : places_of(vertex, normal, reach, surface)) {
      points_.row(vertex) = place.transpose();
      const double least = min_around(vertex);
      if (least > widest && !turned()) {
        widest = least;
        best = place;
      }
    }
    points_.row(vertex) = best.transpose();
    for (const int face : around_[vertex]) {
      corners_[face] = corner_of(face);
    }
    return best != before;
  }

  Points points_;
  Triangles faces_;
  RemoveSliversOptions options_;
  Topology topology_;
  Adjacency around_;
  Eigen::VectorXd corners_;
  std::vector<std::vector<int>> rim_;  ///< neighbours along the rim, of vertices in one
  std::vector<char> branching_;        ///< vertices where three triangles and more share an edge
};

}  // namespace

double min_corner(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d bc = c - b;
  const Eigen::Vector3d ca = a - c;
  if (!(ab.cross(ca).squaredNorm() > 0)) {
    return 0;
  }
  return std::min({degrees_between(ab, -ca), degrees_between(bc, -ab), degrees_between(ca, -bc)});
}

Eigen::VectorXd min_corners(const Points& vertices, const Triangles& faces) {
  Eigen::VectorXd least(faces.rows());
  for (Index f = 0; f < faces.rows(); ++f) {
    least[f] =
        min_corner(vertices.row(faces(f, 0)).transpose(), vertices.row(faces(f, 1)).transpose(),
                   vertices.row(faces(f, 2)).transpose());
  }
  return least;
}

Eigen::VectorXd min_corners(const Points2& vertices, const Triangles& faces) {
  Points lifted = Points::Zero(vertices.rows(), 3);
  lifted.leftCols<2>() = vertices;
  return min_corners(lifted, faces);
}

Mesh remove_slivers(const Mesh& mesh, const RemoveSliversOptions& options) {
  ATELIER_CHECK(options.least >= 0 && options.least <= 30 && options.off >= 0,
                "a corner of 0 to 30 degrees, a distance of 0 or more");
  SliverRemoval blunting(mesh, options);
  if (!blunting.has_slivers()) {
    return mesh;
  }
  const TriangleTree surface = build_tree(mesh.vertices, mesh.faces);
  for (int round = 0; round < kSliverRounds && blunting.has_slivers(); ++round) {
    const bool flipped = options.flips && blunting.flip();
    const bool slid = blunting.slide(surface);
    if (!flipped && !slid) {
      break;
    }
  }
  Mesh blunt = mesh;
  blunt.vertices = blunting.points();
  if (blunt.faces != blunting.faces()) {
    blunt.faces = blunting.faces();
    blunt.uv_faces.resize(0, 3);
    blunt.uvs.resize(0, 2);
  }
  blunt.normals.resize(0, 3);
  return blunt;
}

}  // namespace atelier
