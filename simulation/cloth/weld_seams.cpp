#include "simulation/cloth/weld_seams.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "core/error.h"

namespace atelier {
namespace {

// For every vertex the number of the point that it becomes; points are numbered in the order of
// their first vertices.
std::vector<int> sewn_points(const Garment& garment) {
  std::vector<int> first(static_cast<std::size_t>(garment.mesh.vertices.rows()));
  std::iota(first.begin(), first.end(), 0);
  const auto find = [&](int vertex) {
    while (first[static_cast<std::size_t>(vertex)] != vertex) {
      int& next = first[static_cast<std::size_t>(vertex)];
      next = first[static_cast<std::size_t>(next)];
      vertex = next;
    }
    return vertex;
  };
  for (const Seam& seam : garment.seams) {
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      const auto [low, high] = std::minmax({find(seam.a[i]), find(seam.b[i])});
      first[static_cast<std::size_t>(high)] = low;
    }
  }
  std::vector<int> points(first.size());
  int count = 0;
  for (std::size_t vertex = 0; vertex < first.size(); ++vertex) {
    const int root = find(static_cast<int>(vertex));
    points[vertex] =
        root == static_cast<int>(vertex) ? count++ : points[static_cast<std::size_t>(root)];
  }
  return points;
}

}  // namespace

Garment weld_seams(const Garment& garment) {
  check_garment(garment);
  const std::vector<int> points = sewn_points(garment);
  const auto point = [&](int vertex) { return points[static_cast<std::size_t>(vertex)]; };
  const int count = points.empty() ? 0 : *std::max_element(points.begin(), points.end()) + 1;

  Garment sewn = garment;
  sewn.seams.clear();
  sewn.mesh.vertices = Points::Zero(count, 3);
  Eigen::VectorXd joined = Eigen::VectorXd::Zero(count);
  for (Index vertex = 0; vertex < garment.mesh.vertices.rows(); ++vertex) {
    const int to = point(static_cast<int>(vertex));
    sewn.mesh.vertices.row(to) += garment.mesh.vertices.row(vertex);
    joined[to] += 1;
  }
  sewn.mesh.vertices.array().colwise() /= joined.array();
  // Attributes of vertices would differ across a seam; positions and texture are what is kept.
  sewn.mesh.normals.resize(0, 3);
  sewn.mesh.colors.resize(0, 3);
  sewn.mesh.labels.clear();
  sewn.mesh.confidence.resize(0);
  for (Index face = 0; face < sewn.mesh.faces.rows(); ++face) {
    for (int i = 0; i < 3; ++i) {
      sewn.mesh.faces(face, i) = point(garment.mesh.faces(face, i));
    }
    const auto corners = sewn.mesh.faces.row(face);
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      throw DataError(garment.name, "face " + std::to_string(face),
                      "a seam that joins two of its corners", "panels with more points there");
    }
  }
  for (std::vector<int>& loop : sewn.boundaries) {
    std::vector<int> distinct;
    for (const int vertex : loop) {
      if (distinct.empty() || distinct.back() != point(vertex)) {
        distinct.push_back(point(vertex));
      }
    }
    if (distinct.size() > 1 && distinct.front() == distinct.back()) {
      distinct.pop_back();
    }
    loop = std::move(distinct);
  }
  std::set<int> attached;
  sewn.attachments.clear();
  for (Attachment attachment : garment.attachments) {
    attachment.vertex = point(attachment.vertex);
    if (attached.insert(attachment.vertex).second) {
      sewn.attachments.push_back(attachment);
    }
  }
  return sewn;
}

}  // namespace atelier
