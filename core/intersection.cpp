#include "core/intersection.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/error.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"
#include "core/tree.h"

namespace atelier {
namespace {

__extension__ typedef __int128 Int128;

constexpr double kGrid = 1 << 30;  // steps a metre
constexpr double kReach = 256;     // metres; differences stay below 2^39 steps, determinants 2^121

using GridPoint = std::array<std::int64_t, 3>;
using GridTriangle = std::array<GridPoint, 3>;

GridPoint on_grid(const Eigen::Vector3d& p) {
  GridPoint g;
  for (int i = 0; i < 3; ++i) {
    ATELIER_CHECK(std::isfinite(p[i]) && std::abs(p[i]) <= kReach,
                  "intersection tests need finite coordinates within 256 m");
    g[static_cast<std::size_t>(i)] = saturating_cast<std::int64_t>(std::round(p[i] * kGrid));
  }
  return g;
}

int sign(Int128 x) {
  return x > 0 ? 1 : x < 0 ? -1 : 0;
}

// Side of d from the plane through a, b, c: positive where they run clockwise seen from d.
int side(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d) {
  Int128 m[3][3];
  for (std::size_t i = 0; i < 3; ++i) {
    m[0][i] = a[i] - d[i];
    m[1][i] = b[i] - d[i];
    m[2][i] = c[i] - d[i];
  }
  return sign(m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
              m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
              m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]));
}

// Turn a, b, c in the plane of the axes u and v.
int turn(const GridPoint& a, const GridPoint& b, const GridPoint& c, std::size_t u, std::size_t v) {
  return sign(static_cast<Int128>(b[u] - a[u]) * (c[v] - a[v]) -
              static_cast<Int128>(b[v] - a[v]) * (c[u] - a[u]));
}

// Two axes along which a triangle keeps its area; u = v if it has none.
std::array<std::size_t, 2> flat_axes(const GridTriangle& t) {
  for (std::size_t drop = 0; drop < 3; ++drop) {
    const std::size_t u = (drop + 1) % 3;
    const std::size_t v = (drop + 2) % 3;
    if (turn(t[0], t[1], t[2], u, v) != 0) {
      return {u, v};
    }
  }
  return {0, 0};
}

bool segments_meet(const GridPoint& p, const GridPoint& q, const GridPoint& a, const GridPoint& b,
                   std::size_t u, std::size_t v) {
  const int pa = turn(p, q, a, u, v);
  const int pb = turn(p, q, b, u, v);
  const int ap = turn(a, b, p, u, v);
  const int aq = turn(a, b, q, u, v);
  if (pa == 0 && pb == 0) {  // on one line: do the spans overlap?
    const auto overlap = [&](std::size_t i) {
      return std::max(std::min(p[i], q[i]), std::min(a[i], b[i])) <=
             std::min(std::max(p[i], q[i]), std::max(a[i], b[i]));
    };
    return overlap(u) && overlap(v);
  }
  return pa * pb <= 0 && ap * aq <= 0;
}

bool inside_flat(const GridPoint& p, const GridTriangle& t, std::size_t u, std::size_t v) {
  const int a = turn(t[0], t[1], p, u, v);
  const int b = turn(t[1], t[2], p, u, v);
  const int c = turn(t[2], t[0], p, u, v);
  return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

bool segment_meets(const GridPoint& p, const GridPoint& q, const GridTriangle& t) {
  const int sp = side(t[0], t[1], t[2], p);
  const int sq = side(t[0], t[1], t[2], q);
  if (sp * sq > 0) {
    return false;
  }
  if (sp == 0 && sq == 0) {
    const auto [u, v] = flat_axes(t);
    return inside_flat(p, t, u, v) || inside_flat(q, t, u, v) ||
           segments_meet(p, q, t[0], t[1], u, v) || segments_meet(p, q, t[1], t[2], u, v) ||
           segments_meet(p, q, t[2], t[0], u, v);
  }
  const int a = side(p, q, t[0], t[1]);
  const int b = side(p, q, t[1], t[2]);
  const int c = side(p, q, t[2], t[0]);
  return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

bool any_edge_meets(const GridTriangle& s, const GridTriangle& t) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (segment_meets(s[i], s[(i + 1) % 3], t)) {
      return true;
    }
  }
  return false;
}

bool has_area(const GridTriangle& t) {
  const auto axes = flat_axes(t);
  return axes[0] != axes[1];
}

// Shared corner first in both: they meet elsewhere if an opposite edge meets the other triangle.
bool meet_beyond_corner(const GridTriangle& s, const GridTriangle& t) {
  return segment_meets(s[1], s[2], t) || segment_meets(t[1], t[2], s);
}

// Shared edge first in both: they meet elsewhere only where one is folded flat onto the other.
bool meet_beyond_edge(const GridTriangle& s, const GridTriangle& t) {
  if (side(s[0], s[1], s[2], t[2]) != 0) {
    return false;
  }
  const auto [u, v] = flat_axes(s);
  return turn(s[0], s[1], s[2], u, v) == turn(s[0], s[1], t[2], u, v);
}

}  // namespace

std::vector<std::array<int, 2>> self_intersections(const Points& vertices, const Triangles& faces) {
  for (Index i = 0; i < faces.size(); ++i) {
    ATELIER_CHECK(faces.data()[i] >= 0 && faces.data()[i] < vertices.rows(),
                  "face names no vertex");
  }
  std::vector<GridPoint> grid(static_cast<std::size_t>(vertices.rows()));
  for (Index i = 0; i < vertices.rows(); ++i) {
    grid[static_cast<std::size_t>(i)] = on_grid(vertices.row(i));
  }
  const TriangleTree tree = build_tree(vertices, faces);
  const auto corner = [&](Index face, int c) {
    return grid[static_cast<std::size_t>(faces(face, c))];
  };
  const Index grain = 256;
  std::vector<std::vector<std::array<int, 2>>> parts(
      static_cast<std::size_t>((faces.rows() + grain - 1) / grain));
  parallel_for(faces.rows(), grain, [&](Index begin, Index end) {
    std::vector<std::array<int, 2>>& found = parts[static_cast<std::size_t>(begin / grain)];
    const Eigen::RowVector3d margin = Eigen::RowVector3d::Constant(2 / kGrid);
    for (Index f = begin; f < end; ++f) {
      const GridTriangle whole = {corner(f, 0), corner(f, 1), corner(f, 2)};
      if (!has_area(whole)) {
        continue;
      }
      const Eigen::RowVector3d a = vertices.row(faces(f, 0));
      const Eigen::RowVector3d b = vertices.row(faces(f, 1));
      const Eigen::RowVector3d c = vertices.row(faces(f, 2));
      for (int other : faces_in_box(tree, a.cwiseMin(b).cwiseMin(c) - margin,
                                    a.cwiseMax(b).cwiseMax(c) + margin)) {
        if (other <= f) {
          continue;
        }
        // Shared corners first, in the same order in both.
        int mine[3] = {0, 1, 2};
        int theirs[3] = {0, 1, 2};
        int shared = 0;
        for (int i = 0; i < 3; ++i) {
          for (int k = shared; k < 3; ++k) {
            if (faces(f, mine[i]) == faces(other, theirs[k])) {
              std::swap(theirs[shared], theirs[k]);
              std::swap(mine[shared], mine[i]);
              ++shared;
              break;
            }
          }
        }
        const GridTriangle s = {corner(f, mine[0]), corner(f, mine[1]), corner(f, mine[2])};
        const GridTriangle t = {corner(other, theirs[0]), corner(other, theirs[1]),
                                corner(other, theirs[2])};
        if (!has_area(t)) {
          continue;
        }
        const bool meet = shared == 0   ? any_edge_meets(s, t) || any_edge_meets(t, s)
                          : shared == 1 ? meet_beyond_corner(s, t)
                          : shared == 2 ? meet_beyond_edge(s, t)
                                        : true;
        if (meet) {
          found.push_back({static_cast<int>(f), other});
        }
      }
    }
  });
  std::vector<std::array<int, 2>> pairs;
  for (const auto& part : parts) {
    pairs.insert(pairs.end(), part.begin(), part.end());
  }
  return pairs;
}

}  // namespace atelier
