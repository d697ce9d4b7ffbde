#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/options.h"
#include "core/types.h"

namespace atelier {

/// Space that no mask rules out, as cubes. Contains everything that the masks show (Laurentini
/// 1994), up to `tolerated` wrong masks.
struct VisualHull {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< m, corner of cell (0,0,0)
  double voxel_size = 0;                             ///< m
  int nx = 0, ny = 0, nz = 0;
  std::vector<std::uint8_t> occupied;  ///< [nz,ny,nx]

  bool at(int x, int y, int z) const {
    return occupied[(static_cast<std::size_t>(z) * ny + y) * nx + x] != 0;
  }
};

struct VisualHullOptions {
  double voxel_size = 0.02;  ///< m; smaller bounds tighter and costs its cube
  double half_extent = 2;    ///< m: half the side of the cube round where the cameras look
  double min_share = 0.3;  ///< of the views that must have a place in their image; at least two do
  int tolerated = 0;       ///< views whose masks may be wrong about a place
};
OptionTable describe(VisualHullOptions& options);

/// Carves. A cell stays if its mask is set anywhere within the cell's outline, in all views that
/// have it in their image but `tolerated`. Cameras may have distortion. Empty masks do not carve.
/// Throws LogicError for masks of another size than their camera's. Cost: cells x views.
VisualHull visual_hull(const std::vector<Camera>& cameras, const std::vector<ByteImage>& masks,
                       const VisualHullOptions& options = {});

/// Where rays through a camera's pixels enter and leave the hull.
struct DepthBounds {
  Image near_depth;  ///< [H,W,1] metres along the optical axis, less a cell; 0: outside
  Image far_depth;
};

/// @param camera  without distortion
/// @param mask    pixels to look at, of the camera's size; empty: all
DepthBounds depth_bounds(const VisualHull& hull, const Camera& camera, const ByteImage& mask);

}  // namespace atelier
