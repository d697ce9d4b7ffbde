#include "simulation/contact/min_gap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/triangle_math.h"
#include "simulation/contact/contact_tree.h"
#include "simulation/contact/self_contact_math.h"

namespace atelier {
namespace {

/// A triangle with its corners' numbers.
using Face = Corners<double>;

Face face_of(const Points& x, const Triangles& faces, Index f) {
  const auto at = [&](int corner) {
    const auto p = x.row(faces(f, corner));
    return Vec3d{p[0], p[1], p[2]};
  };
  return {at(0), at(1), at(2), faces(f, 0), faces(f, 1), faces(f, 2)};
}

Box<double> box_of(const Face& face, double margin) {
  Box<double> box = empty_box<double>();
  for (const Vec3d& p : {face.a, face.b, face.c}) {
    grow(box, p - Vec3d{margin, margin, margin});
    grow(box, p + Vec3d{margin, margin, margin});
  }
  return box;
}

/// Squared distances of the fifteen pairs of two triangles: corners and triangles, edges and edges.
constexpr int kPairs = 15;
void squared_distances(const Face& one, const Face& other, double (&squared)[kPairs]) {
  const Vec3d p[] = {one.a, one.b, one.c};
  const Vec3d q[] = {other.a, other.b, other.c};
  int n = 0;
  for (int k = 0; k < 3; ++k) {
    squared[n++] = nearest_on_triangle(p[k], other).squared_distance;
    squared[n++] = nearest_on_triangle(q[k], one).squared_distance;
    for (int l = 0; l < 3; ++l) {
      const Vec3d& p1 = p[(k + 1) % 3];
      const Vec3d& q1 = q[(l + 1) % 3];
      const SegmentShares<double> near = nearest_on_segments(p[k], p1, q[l], q1);
      squared[n++] = squared_norm(between(p[k], p1, near.s) - between(q[l], q1, near.t));
    }
  }
}

/// Which of them share a vertex of one mesh.
void shared_vertices(const Face& one, const Face& other, bool (&shared)[kPairs]) {
  const int i[] = {one.ia, one.ib, one.ic};
  const int j[] = {other.ia, other.ib, other.ic};
  const auto among = [](int v, const int(&all)[3]) {
    return v == all[0] || v == all[1] || v == all[2];
  };
  int n = 0;
  for (int k = 0; k < 3; ++k) {
    shared[n++] = among(i[k], j);
    shared[n++] = among(j[k], i);
    for (int l = 0; l < 3; ++l) {
      const int k1 = (k + 1) % 3;
      const int l1 = (l + 1) % 3;
      shared[n++] = i[k] == j[l] || i[k] == j[l1] || i[k1] == j[l] || i[k1] == j[l1];
    }
  }
}

/// The least of `pair(f, g, reach)`, a share of 0 to 1, over faces of two meshes that come within
/// `reach` metres: what is asked for falls with the share that is found.
template <class Pair>
double min_share(const Points& x, const Triangles& faces, const Points& y, const Triangles& other,
                 double reach, const Pair& pair) {
  ATELIER_CHECK(reach > 0, "a thickness above 0");
  if (faces.rows() == 0 || other.rows() == 0) {
    return 1;
  }
  std::vector<Box<double>> boxes;
  boxes.reserve(static_cast<std::size_t>(other.rows()));
  for (Index f = 0; f < other.rows(); ++f) {
    boxes.push_back(box_of(face_of(y, other, f), 0));
  }
  const ContactTree<double> tree = build_contact_tree(boxes);
  constexpr Index kChunk = 256;
  std::vector<double> least(static_cast<std::size_t>((faces.rows() + kChunk - 1) / kChunk), 1.0);
  parallel_for(faces.rows(), kChunk, [&](Index begin, Index end) {
    double& found = least[static_cast<std::size_t>(begin / kChunk)];
    for (Index f = begin; f < end; ++f) {
      visit_tree(tree.nodes.data(), box_of(face_of(x, faces, f), found * reach),
                 [&](int g) { found = std::min(found, pair(f, static_cast<Index>(g), found)); });
    }
  });
  return *std::min_element(least.begin(), least.end());
}

}  // namespace

double min_gap(const Points& vertices, const Triangles& faces, double thickness,
               const RestPlaces& rest) {
  constexpr double kOfRest = 0.9;  // as contact does, self_search_math.h
  const auto layer_of = [&](int v) {
    return rest.layer == nullptr || rest.layer->empty() ? 0 : (*rest.layer)[v];
  };
  const auto pair = [&](Index f, Index g, double found) {
    if (g <= f) {
      return 1.0;
    }
    const Face one = face_of(vertices, faces, f);
    const Face other = face_of(vertices, faces, g);
    double squared[kPairs];
    bool shared[kPairs];
    squared_distances(one, other, squared);
    shared_vertices(one, other, shared);
    const bool near = std::any_of(squared, squared + kPairs, [&](double d) {
      return d < found * found * thickness * thickness;
    });
    if (!near) {
      return 1.0;
    }
    double at_rest[kPairs];
    std::fill(at_rest, at_rest + kPairs, std::numeric_limits<double>::infinity());
    if (rest.positions != nullptr && layer_of(one.ia) == layer_of(other.ia)) {
      squared_distances(face_of(*rest.positions, faces, f), face_of(*rest.positions, faces, g),
                        at_rest);
    }
    double least = 1;
    for (int n = 0; n < kPairs; ++n) {
      const double kept = std::min(thickness, kOfRest * std::sqrt(at_rest[n]));
      if (!shared[n] && kept > 0) {
        least = std::min(least, std::sqrt(squared[n]) / kept);
      }
    }
    return least;
  };
  return min_share(vertices, faces, vertices, faces, thickness, pair);
}

double min_gap(const Points& vertices, const Triangles& faces, const Points& other_vertices,
               const Triangles& other_faces, double thickness) {
  const auto pair = [&](Index f, Index g, double /*found*/) {
    double squared[kPairs];
    squared_distances(face_of(vertices, faces, f), face_of(other_vertices, other_faces, g),
                      squared);
    return std::min(1.0, std::sqrt(*std::min_element(squared, squared + kPairs)) / thickness);
  };
  return min_share(vertices, faces, other_vertices, other_faces, thickness, pair);
}

}  // namespace atelier
