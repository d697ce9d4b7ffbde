#include "registration/template/garment_cover.h"

#include <Eigen/SparseCholesky>

#include "core/error.h"
#include "core/normals.h"
#include "core/topology.h"
#include "registration/edge_paths.h"

namespace atelier {
namespace {

constexpr double kUnderSkin =
    0.02;                          // m: cloth of a scan may lie inside of the body that was fitted
constexpr double kReach = 0.4;     // m
constexpr double kBareGap = 0.03;  // m: what is farther off occludes, and says nothing

}  // namespace

GarmentVotes garment_votes(const Mesh& scan, std::uint8_t label, const Points& body,
                           const Triangles& body_faces) {
  const Index count = body.rows();
  GarmentVotes votes{Eigen::VectorXd::Zero(count), Eigen::VectorXd::Zero(count),
                     Eigen::VectorXd::Zero(count)};
  ATELIER_CHECK(static_cast<Index>(scan.labels.size()) == scan.vertices.rows(), "a labelled scan");
  const Points normals = vertex_normals(body, body_faces);
  std::vector<Ray> outwards(static_cast<std::size_t>(count));
  std::vector<Ray> past(static_cast<std::size_t>(count));
  for (Index v = 0; v < count; ++v) {
    Eigen::Vector3d normal = normals.row(v).transpose();
    if (normal.squaredNorm() == 0) {
      normal = Eigen::Vector3d::UnitY();
    }
    const Eigen::Vector3d point = body.row(v).transpose();
    outwards[static_cast<std::size_t>(v)] = {point - kUnderSkin * normal, normal, 0,
                                             kUnderSkin + kReach};
    past[static_cast<std::size_t>(v)] = {point, normal, 0.01, kReach};
  }
  const std::vector<RayHit> seen = first_hits(build_tree(scan.vertices, scan.faces), outwards);
  const std::vector<RayHit> own = first_hits(build_tree(body, body_faces), past);
  for (Index v = 0; v < count; ++v) {
    const RayHit& hit = seen[static_cast<std::size_t>(v)];
    if (hit.face < 0) {
      continue;
    }
    const double gap = hit.t - kUnderSkin;
    if (gap > own[static_cast<std::size_t>(v)].t + 0.01) {
      continue;  // another limb is in between
    }
    Index corner = 0;
    hit.barycentric.maxCoeff(&corner);
    const auto vertex = static_cast<std::size_t>(scan.faces(hit.face, corner));
    if (scan.labels[vertex] == label) {
      votes.covered[v] = 1;
      votes.gap[v] = gap;
    } else if (gap < kBareGap) {
      votes.bare[v] = 1;
    }
  }
  return votes;
}

void add_votes(GarmentVotes& sum, const GarmentVotes& frame) {
  if (sum.covered.size() == 0) {
    sum = frame;
    return;
  }
  ATELIER_CHECK(sum.covered.size() == frame.covered.size(), "votes of the same body");
  sum.covered += frame.covered;
  sum.bare += frame.bare;
  sum.gap += frame.gap;
}

GarmentCover garment_cover(const GarmentVotes& votes, const Points& body,
                           const Triangles& body_faces, double reach) {
  const Index count = votes.covered.size();
  ATELIER_CHECK(body.rows() == count, "votes of this body");
  const Topology topology = topology_of(body_faces, count);
  constexpr double kSmoothing = 1e-2;  // of a vote
  const auto extended = [&](const Eigen::VectorXd& weights, const Eigen::VectorXd& sums) {
    std::vector<Eigen::Triplet<double>> entries;
    for (Index e = 0; e < topology.edges.rows(); ++e) {
      const int a = topology.edges(e, 0);
      const int b = topology.edges(e, 1);
      entries.emplace_back(a, a, kSmoothing);
      entries.emplace_back(b, b, kSmoothing);
      entries.emplace_back(a, b, -kSmoothing);
      entries.emplace_back(b, a, -kSmoothing);
    }
    for (Index v = 0; v < count; ++v) {
      entries.emplace_back(v, v, weights[v] + 1e-9);
    }
    Eigen::SparseMatrix<double> system(count, count);
    system.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
    return Eigen::VectorXd(solver.solve(sums));
  };
  GarmentCover cover{extended(votes.covered + votes.bare, votes.covered),
                     extended(votes.covered, votes.gap)};
  std::vector<int> told;
  for (Index v = 0; v < count; ++v) {
    if (votes.covered[v] + votes.bare[v] > 0) {
      told.push_back(static_cast<int>(v));
    }
  }
  const EdgePaths paths = EdgeGraph(topology).paths_from(told, edge_lengths(topology, body));
  for (Index v = 0; v < count; ++v) {
    if (paths.distances[static_cast<std::size_t>(v)] > reach) {
      cover.share[v] = 0;
    }
  }
  return cover;
}

}  // namespace atelier
