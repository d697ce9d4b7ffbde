#include "registration/tracking/unfolded.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "core/error.h"
#include "registration/tracking/register_garment.h"

namespace atelier {
namespace {

/// Faces of `wrong` that hang together with its first one through vertices.
std::vector<int> first_fold(const Topology& topology, const std::vector<int>& wrong) {
  std::vector<int> fold = {wrong.front()};
  std::vector<int> rest(wrong.begin() + 1, wrong.end());
  for (std::size_t i = 0; i < fold.size(); ++i) {
    const auto mine = topology.faces.row(fold[i]);
    const auto apart = std::stable_partition(rest.begin(), rest.end(), [&](int other) {
      for (const int v : topology.faces.row(other)) {
        if ((mine.array() == v).any()) {
          return false;
        }
      }
      return true;
    });
    fold.insert(fold.end(), apart, rest.end());
    rest.erase(apart, rest.end());
  }
  return fold;
}

/// [V] edges between each vertex and the nearest corner of the faces; -1 where no way leads.
std::vector<int> edges_away(const Topology& topology, const Adjacency& around,
                            const std::vector<int>& faces) {
  std::vector<int> away(static_cast<std::size_t>(around.rows()), -1);
  std::vector<int> front;
  for (const int f : faces) {
    for (const int v : topology.faces.row(f)) {
      if (away[static_cast<std::size_t>(v)] < 0) {
        away[static_cast<std::size_t>(v)] = 0;
        front.push_back(v);
      }
    }
  }
  for (std::size_t i = 0; i < front.size(); ++i) {
    for (const int w : around[front[i]]) {
      if (away[static_cast<std::size_t>(w)] < 0) {
        away[static_cast<std::size_t>(w)] = away[static_cast<std::size_t>(front[i])] + 1;
        front.push_back(w);
      }
    }
  }
  return away;
}

/// x with the shape of `from` within `reach` edges.
Points with_shape(Points x, const Points& from, const std::vector<int>& away, int reach) {
  std::vector<Index> region;
  for (std::size_t v = 0; v < away.size(); ++v) {
    if (away[v] >= 0 && away[v] <= reach) {
      region.push_back(static_cast<Index>(v));
    }
  }
  const Points here = x(region, Eigen::all);
  const Points there = from(region, Eigen::all);
  const Eigen::Matrix4d motion = Eigen::umeyama(there.transpose(), here.transpose(), false);
  const Points laid = (there * motion.topLeftCorner<3, 3>().transpose()).rowwise() +
                      motion.topRightCorner<3, 1>().transpose();
  for (std::size_t i = 0; i < region.size(); ++i) {
    const auto at = static_cast<Index>(i);
    const double edges = away[static_cast<std::size_t>(region[i])];
    const double share = std::min(1.0, 2 * (1 - edges / (reach + 1)));
    x.row(region[i]) = (1 - share) * here.row(at) + share * laid.row(at);
  }
  return x;
}

/// True if every face of `fewer` is one of `all`, and none of `fold`; all in increasing order.
bool only_these(const std::vector<int>& fewer, const std::vector<int>& all,
                const std::vector<int>& fold) {
  return std::includes(all.begin(), all.end(), fewer.begin(), fewer.end()) &&
         std::none_of(fold.begin(), fold.end(),
                      [&](int f) { return std::binary_search(fewer.begin(), fewer.end(), f); });
}

}  // namespace

Unfolded unfolded(const Topology& topology, Points x, const std::vector<Points>& shapes) {
  ATELIER_CHECK(x.rows() == topology.vertex_count && x.allFinite(), "places for each vertex");
  for (const Points& shape : shapes) {
    ATELIER_CHECK(shape.rows() == x.rows() && shape.allFinite(), "a shape of another cloth");
  }
  Unfolded result;
  result.vertices = turned_back(topology, x);
  std::vector<int> wrong = inverted_faces(topology, result.vertices);
  if (wrong.empty() || shapes.empty()) {
    result.still_turned = static_cast<int>(wrong.size());
    return result;
  }
  // Places that did not unfold were smoothed far and wide in vain.
  result.vertices = std::move(x);
  wrong = inverted_faces(topology, result.vertices);
  const Adjacency around = vertex_neighbors(topology);
  std::vector<char> given(static_cast<std::size_t>(around.rows()), 0);
  for (bool mended = true; mended && !wrong.empty();) {
    mended = false;
    const std::vector<int> fold = first_fold(topology, wrong);
    const std::vector<int> away = edges_away(topology, around, fold);
    const int farthest = *std::max_element(away.begin(), away.end());
    // At twice the farthest the shape is taken back in full everywhere.
    for (int reach = 2; !mended && reach <= 4 * farthest + 4; reach *= 2) {
      for (std::size_t i = 0; !mended && i < shapes.size(); ++i) {
        Points next = with_shape(result.vertices, shapes[i], away, reach);
        std::vector<int> left = inverted_faces(topology, next);
        if (only_these(left, wrong, fold)) {
          for (std::size_t v = 0; v < away.size(); ++v) {
            if (away[v] >= 0 && away[v] <= reach) {
              given[v] = 1;
            }
          }
          result.vertices = std::move(next);
          wrong = std::move(left);
          mended = true;
        }
      }
    }
  }
  result.given_back = static_cast<int>(std::count(given.begin(), given.end(), 1));
  result.still_turned = static_cast<int>(wrong.size());
  return result;
}

}  // namespace atelier
