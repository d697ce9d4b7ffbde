#include "registration/flattening/worn_rims.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace atelier {
namespace {

std::vector<RimLoop> rim_loops(const Mesh& mesh, const Topology& topology,
                               const Eigen::Vector3d& left, double middle) {
  std::vector<RimLoop> loops;
  for (std::vector<int>& vertices : boundary_loops(topology)) {
    RimLoop loop;
    for (const int v : vertices) {
      loop.middle += mesh.vertices.row(v).transpose() / static_cast<double>(vertices.size());
      loop.low = std::min(loop.low, mesh.vertices(v, 1));
    }
    loop.left = loop.middle.dot(left) - middle;
    loop.vertices = std::move(vertices);
    loops.push_back(std::move(loop));
  }
  return loops;
}

LimbLoops limb_loops(const std::vector<RimLoop>& loops, double half_width, double height) {
  constexpr double kBeside = 0.2;  // of half the width
  LimbLoops limbs;
  std::vector<std::size_t> beside;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const auto is_twin = [&](const RimLoop& other) {
      return &other != &loops[i] &&
             std::abs(other.left + loops[i].left) < 0.4 * std::abs(loops[i].left) &&
             std::abs(other.middle.y() - loops[i].middle.y()) < 0.2 * height;
    };
    if (std::abs(loops[i].left) <= kBeside * half_width) {
      limbs.central.push_back(i);
    } else if (std::any_of(loops.begin(), loops.end(), is_twin)) {
      beside.push_back(i);
    }
  }
  std::sort(beside.begin(), beside.end(), [&](std::size_t a, std::size_t b) {
    return loops[a].middle.y() > loops[b].middle.y();
  });
  const auto is_lower = [&](std::size_t c) {
    return std::all_of(beside.begin(), beside.end(),
                       [&](std::size_t b) { return loops[c].low < loops[b].middle.y(); });
  };
  constexpr std::size_t kPair = 2;
  const bool arms = beside.size() > kPair || limbs.central.size() >= kPair ||
                    std::any_of(limbs.central.begin(), limbs.central.end(), is_lower);
  const std::size_t first_leg = arms ? std::min(kPair, beside.size()) : 0;
  limbs.arms.assign(beside.begin(), beside.begin() + static_cast<std::ptrdiff_t>(first_leg));
  limbs.legs.assign(beside.begin() + static_cast<std::ptrdiff_t>(first_leg), beside.end());
  return limbs;
}

}  // namespace

WornRims worn_rims(const Mesh& mesh, const Topology& topology, const Eigen::Vector3d& facing) {
  ATELIER_CHECK(std::abs(facing.norm() - 1) < 1e-6, "a direction of length 1");
  WornRims rims;
  rims.left = Eigen::Vector3d::UnitY().cross(facing);
  const Eigen::VectorXd across = mesh.vertices * rims.left;
  rims.middle = (across.minCoeff() + across.maxCoeff()) / 2;
  rims.loops = rim_loops(mesh, topology, rims.left, rims.middle);
  rims.limbs = limb_loops(rims.loops, (across.maxCoeff() - across.minCoeff()) / 2,
                          mesh.vertices.col(1).maxCoeff() - mesh.vertices.col(1).minCoeff());
  return rims;
}

}  // namespace atelier
