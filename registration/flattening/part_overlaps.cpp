#include "registration/flattening/part_overlaps.h"

#include <array>
#include <limits>
#include <queue>
#include <utility>

#include "core/error.h"
#include "core/topology.h"
#include "registration/edge_paths.h"
#include "registration/flattening/cut_to_disks.h"
#include "registration/flattening/flat_overlaps.h"

namespace atelier {
namespace {

/// Triangles of a surface and the ways between those that share an edge, each in a part.
class FaceParts {
 public:
  FaceParts(const Mesh& mesh, const Topology& topology, std::vector<int> parts, int count)
      : topology_(topology), parts_(std::move(parts)), count_(count) {
    middles_.resize(mesh.faces.rows(), 3);
    for (Index f = 0; f < mesh.faces.rows(); ++f) {
      middles_.row(f) = (mesh.vertices.row(mesh.faces(f, 0)) + mesh.vertices.row(mesh.faces(f, 1)) +
                         mesh.vertices.row(mesh.faces(f, 2))) /
                        3;
    }
  }

  int of(int face) const { return parts_[static_cast<std::size_t>(face)]; }

  /// Makes the triangles of their part that are nearer to `b` than to `a`, and `b` in any case, a
  /// part of its own.
  void split(int a, int b, const std::vector<char>& cut) {
    ATELIER_CHECK(a != b, "two triangles of a panel that lies over itself");
    const std::vector<double> to_a = ways_from(a, cut);
    const std::vector<double> to_b = ways_from(b, cut);
    const int part = of(a);
    for (std::size_t f = 0; f < parts_.size(); ++f) {
      if (parts_[f] == part && (to_b[f] < to_a[f] || static_cast<int>(f) == b)) {
        parts_[f] = count_;
      }
    }
    ++count_;
  }

  /// The triangle of a part that is farthest from `face`.
  int farthest(int face, const std::vector<char>& cut) const {
    const std::vector<double> ways = ways_from(face, cut);
    int far = face;
    for (std::size_t f = 0; f < parts_.size(); ++f) {
      if (parts_[f] == of(face) && ways[f] > ways[static_cast<std::size_t>(far)]) {
        far = static_cast<int>(f);
      }
    }
    return far;
  }

 private:
  /// Length of the shortest way to each triangle of the same part, from middle to middle, m.
  std::vector<double> ways_from(int face, const std::vector<char>& cut) const {
    std::vector<double> ways(parts_.size(), std::numeric_limits<double>::infinity());
    using Reached = std::pair<double, int>;
    std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
    ways[static_cast<std::size_t>(face)] = 0;
    next.emplace(0, face);
    while (!next.empty()) {
      const auto [way, f] = next.top();
      next.pop();
      if (way > ways[static_cast<std::size_t>(f)]) {
        continue;
      }
      for (int k = 0; k < 3; ++k) {
        const int edge = topology_.face_edges(f, k);
        const auto sharing = corners_of_edge(topology_, edge);
        if (sharing.size() != 2 || cut[static_cast<std::size_t>(edge)] != 0) {
          continue;
        }
        const int g = (sharing[0] / 3 == f ? sharing[1] : sharing[0]) / 3;
        const double there = way + (middles_.row(g) - middles_.row(f)).norm();
        if (of(g) == of(face) && there < ways[static_cast<std::size_t>(g)]) {
          ways[static_cast<std::size_t>(g)] = there;
          next.emplace(there, g);
        }
      }
    }
    return ways;
  }

  const Topology& topology_;
  Points middles_;
  std::vector<int> parts_;
  int count_;
};

/// The triangles of each panel.
std::vector<std::vector<int>> faces_of_panels(const SurfaceCut& cut) {
  std::vector<std::vector<int>> faces(static_cast<std::size_t>(cut.panel_count));
  for (std::size_t f = 0; f < cut.panels.size(); ++f) {
    faces[static_cast<std::size_t>(cut.panels[f])].push_back(static_cast<int>(f));
  }
  return faces;
}

}  // namespace

std::vector<char> cut_where_overlapping(const Mesh& mesh, const std::vector<char>& cut,
                                        const FlatPattern& pattern) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  ATELIER_CHECK(static_cast<Index>(cut.size()) == topology.edges.rows() &&
                    pattern.cut.faces.rows() == mesh.faces.rows(),
                "a flag for each edge, and the pattern of this mesh");
  FaceParts parts(mesh, topology, pattern.cut.panels, pattern.cut.panel_count);
  const std::vector<std::vector<int>> panels = faces_of_panels(pattern.cut);
  for (const int panel : pattern.overlapping) {
    const std::vector<int>& faces = panels[static_cast<std::size_t>(panel)];
    Triangles of_panel(std::ssize(faces), 3);
    for (std::size_t i = 0; i < faces.size(); ++i) {
      of_panel.row(static_cast<Index>(i)) = pattern.cut.faces.row(faces[i]);
    }
    const auto pairs = overlapping_faces(pattern.vertices, of_panel);
    if (pairs.empty()) {
      const int end = parts.farthest(faces.front(), cut);
      parts.split(end, parts.farthest(end, cut), cut);
    }
    for (const auto& [i, j] : pairs) {
      const int a = faces[static_cast<std::size_t>(i)];
      const int b = faces[static_cast<std::size_t>(j)];
      if (parts.of(a) == parts.of(b)) {
        parts.split(a, b, cut);
      }
    }
  }
  std::vector<char> further = cut;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto sharing = corners_of_edge(topology, e);
    if (sharing.size() == 2 && parts.of(sharing[0] / 3) != parts.of(sharing[1] / 3)) {
      further[static_cast<std::size_t>(e)] = 1;
    }
  }
  return cut_to_disks(topology, further, edge_lengths(topology, mesh.vertices));
}

FlatPattern flatten_apart(const Mesh& mesh, std::vector<char> cut, const FlattenOptions& options,
                          const std::function<void(std::size_t panels)>& parted) {
  for (;;) {
    FlatPattern pattern = flatten_surface(mesh, cut, options);
    if (pattern.overlapping.empty()) {
      return pattern;
    }
    if (parted) {
      parted(pattern.overlapping.size());
    }
    cut = cut_where_overlapping(mesh, cut, pattern);
  }
}

}  // namespace atelier
