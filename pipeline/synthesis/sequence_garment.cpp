#include "pipeline/synthesis/sequence_garment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "core/topology.h"

namespace atelier {
namespace {

constexpr double kCoincident = 1e-4;  // m

/// The frames in which vertices are compared.
std::vector<Points> compared_frames(const Sequence& sequence) {
  const Index count = frame_count(sequence);
  std::vector<Points> frames;
  for (const Index f : std::set<Index>{0, count / 2, count - 1}) {
    frames.push_back(frame(sequence, f).vertices);
  }
  return frames;
}

/// [V] of each vertex the first boundary vertex that is at its place in all frames, or itself.
std::vector<int> coincident(const Triangles& faces, const std::vector<Points>& frames) {
  const Index count = frames.front().rows();
  std::vector<int> first(static_cast<std::size_t>(count));
  std::iota(first.begin(), first.end(), 0);
  std::vector<int> rim;
  for (const std::vector<int>& loop : boundary_loops(topology_of(faces, count))) {
    rim.insert(rim.end(), loop.begin(), loop.end());
  }
  const Points& at = frames.front();
  std::sort(rim.begin(), rim.end(),
            [&](int a, int b) { return at(a, 0) != at(b, 0) ? at(a, 0) < at(b, 0) : a < b; });
  for (std::size_t i = 0; i < rim.size(); ++i) {
    for (std::size_t j = i + 1; j < rim.size() && at(rim[j], 0) - at(rim[i], 0) <= kCoincident;
         ++j) {
      const bool together = std::all_of(frames.begin(), frames.end(), [&](const Points& points) {
        return (points.row(rim[i]) - points.row(rim[j])).norm() <= kCoincident;
      });
      if (together) {
        const int a = first[static_cast<std::size_t>(rim[i])];
        const int b = first[static_cast<std::size_t>(rim[j])];
        std::replace(first.begin(), first.end(), std::max(a, b), std::min(a, b));
      }
    }
  }
  return first;
}

/// Metres per unit of the texture coordinates, or 0 where these are no panels.
double panel_scale(const Mesh& mesh) {
  std::vector<double> ratios;
  for (Index f = 0; f < mesh.uv_faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const double flat =
          (mesh.uvs.row(mesh.uv_faces(f, k)) - mesh.uvs.row(mesh.uv_faces(f, next))).norm();
      const double real =
          (mesh.vertices.row(mesh.faces(f, k)) - mesh.vertices.row(mesh.faces(f, next))).norm();
      if (!(flat > 0) || !(real > 0)) {
        return 0;
      }
      ratios.push_back(real / flat);
    }
  }
  if (ratios.empty()) {
    return 0;
  }
  std::sort(ratios.begin(), ratios.end());
  const double median = ratios[ratios.size() / 2];
  const double low = ratios[ratios.size() / 20];
  const double high = ratios[ratios.size() - 1 - ratios.size() / 20];
  if (low < median / 1.33 || high > 1.33 * median) {
    return 0;
  }
  return std::abs(median - 1) < 0.1 ? 1 : median;
}

using Sides = std::pair<int, int>;  ///< of one vertex of a seam: its places on either panel

/// The seams of a welded mesh: runs of edges whose sides lie apart in the texture.
std::vector<Seam> seams_of(const Mesh& mesh) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  std::map<Sides, std::vector<Sides>> next;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const std::span<const int> corners = corners_of_edge(topology, e);
    if (corners.size() != 2) {
      continue;
    }
    // The texture's places of the edge's two ends, on each of the two faces.
    std::array<std::array<int, 2>, 2> places{};
    for (std::size_t side = 0; side < 2; ++side) {
      const int face = corners[side] / 3;
      for (int k : {corners[side] % 3, (corners[side] % 3 + 1) % 3}) {
        places[side][mesh.faces(face, k) == topology.edges(e, 0) ? 0 : 1] = mesh.uv_faces(face, k);
      }
    }
    const auto apart = [&](std::size_t end) {
      return (mesh.uvs.row(places[0][end]) - mesh.uvs.row(places[1][end])).norm() > 0;
    };
    if (!apart(0) && !apart(1)) {
      continue;
    }
    // Either face may come first: of two neighbours the same one has to.
    Sides a{places[0][0], places[1][0]};
    Sides b{places[0][1], places[1][1]};
    const bool known = next.contains(a) || next.contains(b);
    const Sides a_turned{a.second, a.first};
    const Sides b_turned{b.second, b.first};
    if (!known && (next.contains(a_turned) || next.contains(b_turned))) {
      a = a_turned;
      b = b_turned;
    }
    next[a].push_back(b);
    next[b].push_back(a);
  }
  std::vector<Seam> seams;
  std::set<std::pair<Sides, Sides>> walked;
  const auto walk = [&](Sides from, Sides to) {
    Seam seam;
    seam.name = "seam_" + std::to_string(seams.size() + 1);
    seam.a.push_back(from.first);
    seam.b.push_back(from.second);
    for (bool more = true; more;) {
      walked.insert({from, to});
      walked.insert({to, from});
      seam.a.push_back(to.first);
      seam.b.push_back(to.second);
      more = false;
      if (next[to].size() == 2) {
        const Sides onward = next[to][0] == from ? next[to][1] : next[to][0];
        more = !walked.contains({to, onward});
        from = to;
        to = onward;
      }
    }
    seams.push_back(std::move(seam));
  };
  for (const bool ends_first : {true, false}) {  // then rings, which have no end
    for (const auto& [from, all] : next) {
      for (const Sides& to : all) {
        if ((!ends_first || all.size() != 2) && !walked.contains({from, to})) {
          walk(from, to);
        }
      }
    }
  }
  return seams;
}

/// Panels are seen from outside: those that the texture has mirrored are turned over.
void turn_over_mirrored(Garment& garment, int panels) {
  std::vector<double> areas(static_cast<std::size_t>(panels), 0);
  for (Index f = 0; f < garment.rest_faces.rows(); ++f) {
    const auto corner = [&](int k) -> Eigen::RowVector2d {
      return garment.rest.row(garment.rest_faces(f, k));
    };
    const Eigen::RowVector2d a = corner(1) - corner(0);
    const Eigen::RowVector2d b = corner(2) - corner(0);
    areas[static_cast<std::size_t>(garment.panels[static_cast<std::size_t>(f)])] +=
        a.x() * b.y() - a.y() * b.x();
  }
  std::vector<char> turned(static_cast<std::size_t>(garment.rest.rows()), 0);
  for (Index f = 0; f < garment.rest_faces.rows(); ++f) {
    const int panel = garment.panels[static_cast<std::size_t>(f)];
    for (int k = 0; areas[static_cast<std::size_t>(panel)] < 0 && k < 3; ++k) {
      turned[static_cast<std::size_t>(garment.rest_faces(f, k))] = 1;
    }
  }
  for (Index v = 0; v < garment.rest.rows(); ++v) {
    garment.rest(v, 0) *= turned[static_cast<std::size_t>(v)] != 0 ? -1 : 1;
  }
}

/// Into the unit square, which the fabric is made for, where they leave it.
void fit_texture(Points2& uvs) {
  const Eigen::RowVector2d low = uvs.colwise().minCoeff();
  const double extent = (uvs.colwise().maxCoeff() - low).maxCoeff();
  if ((low.minCoeff() < 0 || uvs.maxCoeff() > 1) && extent > 0) {
    uvs = ((uvs.rowwise() - low) / extent).eval();
  }
}

}  // namespace

SequenceGarment sequence_garment(const MeshSequenceFile& cloth) {
  SequenceGarment garment;
  GroundTruthGarment& truth = garment.truth;
  Mesh mesh = cloth.shared;
  const std::vector<Points> frames = compared_frames(cloth.sequence);
  mesh.vertices = frames.front();
  mesh.labels.clear();
  truth.garment.name = "cloth";
  garment.rows.resize(static_cast<std::size_t>(mesh.vertices.rows()));
  std::iota(garment.rows.begin(), garment.rows.end(), 0);
  const double scale = mesh.uvs.rows() > 0 ? panel_scale(mesh) : 0;
  if (scale == 0) {
    truth.garment.mesh = std::move(mesh);
    return garment;
  }
  const std::vector<int> first = coincident(mesh.faces, frames);
  std::vector<int> place(first.size(), -1);
  garment.rows.clear();
  for (std::size_t v = 0; v < first.size(); ++v) {
    if (first[v] == static_cast<int>(v)) {
      place[v] = static_cast<int>(garment.rows.size());
      garment.rows.push_back(static_cast<int>(v));
    }
  }
  Mesh welded = mesh;
  welded.normals.resize(0, 3);
  welded.colors.resize(0, 3);
  welded.confidence.resize(0);
  welded.vertices.resize(static_cast<Index>(garment.rows.size()), 3);
  for (std::size_t v = 0; v < garment.rows.size(); ++v) {
    welded.vertices.row(static_cast<Index>(v)) = mesh.vertices.row(garment.rows[v]);
  }
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int joined = first[static_cast<std::size_t>(mesh.faces(f, k))];
      welded.faces(f, k) = place[static_cast<std::size_t>(joined)];
    }
  }
  truth.garment.rest = scale * mesh.uvs;
  truth.garment.rest_faces = mesh.uv_faces;
  const Components parts =
      connected_components(topology_of(mesh.uv_faces, truth.garment.rest.rows()));
  std::map<int, int> panels;  // by component: vertices without faces are some, too
  for (const int part : parts.of_face) {
    const int panel = panels.emplace(part, static_cast<int>(panels.size())).first->second;
    truth.garment.panels.push_back(panel);
  }
  for (std::size_t p = 0; p < panels.size(); ++p) {
    truth.garment.panel_names.push_back("panel_" + std::to_string(p + 1));
  }
  turn_over_mirrored(truth.garment, static_cast<int>(panels.size()));
  fit_texture(welded.uvs);
  truth.garment.mesh = std::move(welded);
  truth.seams = seams_of(truth.garment.mesh);
  return garment;
}

}  // namespace atelier
