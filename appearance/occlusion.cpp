#include "appearance/occlusion.h"

#include <Eigen/Geometry>
#include <vector>

#ifdef ATELIER_HAS_CUDA
#include "appearance/occlusion_cuda.h"
#endif
#include "appearance/occlusion_math.h"
#include "core/error.h"
#include "core/parallel.h"

namespace atelier {

OptionTable describe(OcclusionOptions& options) {
  OptionTable table;
  table.add("strata", options.strata, 1, 32, "",
            "Square root of the number of occlusion rays of a vertex; more for less noise");
  table.add("reach", options.reach, 1e-6, 100, "m",
            "Distance beyond which geometry does not occlude");
  table.add("offset", options.offset, 0, 0.1, "m",
            "Distance from the surface at which occlusion rays start; more where the surface "
            "occludes itself");
  return table;
}

TransferRows light_transfer(const SurfaceFrame& frame, const TriangleTree& tree,
                            const OcclusionOptions& options, Device device) {
  ATELIER_CHECK(options.strata >= 1 && options.strata <= 32 && options.reach > 0 &&
                    options.reach <= 100 && options.offset >= 0 && options.offset <= 0.1,
                "options of the occlusion are out of range");
  const AmbientRays rays = {options.strata, options.reach, options.offset};
  const Index count = frame.position.rows();
  std::vector<Vec3d> positions(static_cast<std::size_t>(count));
  std::vector<Vec3d> normals(static_cast<std::size_t>(count));
  for (Index v = 0; v < count; ++v) {
    const Eigen::Vector3d outward = frame.normal.row(v).cast<double>().transpose();
    const Eigen::Vector3d unit =
        outward.norm() > 0 ? outward.normalized() : Eigen::Vector3d::UnitY();
    const auto i = static_cast<std::size_t>(v);
    positions[i] = {frame.position(v, 0), frame.position(v, 1), frame.position(v, 2)};
    normals[i] = {unit.x(), unit.y(), unit.z()};
  }
  std::vector<OpenRays> open(2 * positions.size(), OpenRays{});
  if (device == Device::Cuda) {
#ifdef ATELIER_HAS_CUDA
    open = open_rays_cuda(tree, positions, normals, rays);
#else
    throw EnvironmentError("CUDA", "this build has none");
#endif
  } else {
    const TreeView<double> view = view_of(tree);
    constexpr Index kGrain = 64;
    parallel_for(2 * count, kGrain, [&](Index begin, Index end) {
      for (auto side = static_cast<std::size_t>(begin); side < static_cast<std::size_t>(end);
           ++side) {
        const Vec3d normal = side % 2 == 0 ? normals[side / 2] : -normals[side / 2];
        for (int row = 0; row < rays.strata; ++row) {
          const OpenRays more = open_rays(view, positions[side / 2], normal, side / 2, row, rays);
          for (int i = 0; i < kTransferTerms; ++i) {
            open[side].terms[i] += more.terms[i];
          }
        }
      }
    });
  }
  TransferRows transfer(count, 2 * kTransferTerms);
  for (std::size_t side = 0; side < open.size(); ++side) {
    for (std::size_t i = 0; i < kTransferTerms; ++i) {
      transfer.data()[kTransferTerms * side + i] =
          transfer_of(open[side].terms[i], rays.strata * rays.strata);
    }
  }
  return transfer;
}

}  // namespace atelier
