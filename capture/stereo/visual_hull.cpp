#include "capture/stereo/visual_hull.h"

#include <algorithm>
#include <cmath>

#include "capture/stereo/choose_sources.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kHalfDiagonal = 0.8660254037844386;

/// How many pixels of a mask are set above and left of each: any box is asked in four reads.
class MaskSums {
 public:
  explicit MaskSums(const ByteImage& mask) : width_(mask.width), height_(mask.height) {
    sums_.assign(static_cast<std::size_t>(width_ + 1) * (height_ + 1), 0);
    for (int y = 0; y < height_; ++y) {
      int row = 0;
      for (int x = 0; x < width_; ++x) {
        row += mask.at(x, y) != 0 ? 1 : 0;
        sums_[index(x + 1, y + 1)] = sums_[index(x + 1, y)] + row;
      }
    }
  }
  bool empty() const { return width_ == 0; }
  bool any_near(double x, double y, double radius) const {
    const auto bound = [](double value, int size) {
      return saturating_cast<int>(std::clamp(value, 0.0, static_cast<double>(size)));
    };
    const int x0 = bound(std::floor(x - radius), width_);
    const int x1 = bound(std::ceil(x + radius), width_);
    const int y0 = bound(std::floor(y - radius), height_);
    const int y1 = bound(std::ceil(y + radius), height_);
    return sums_[index(x1, y1)] - sums_[index(x0, y1)] - sums_[index(x1, y0)] +
               sums_[index(x0, y0)] >
           0;
  }

 private:
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * (width_ + 1) + x; }
  int width_;
  int height_;
  std::vector<int> sums_;
};

struct Carver {
  const std::vector<Camera>& cameras;
  std::vector<MaskSums> masks;
  const VisualHullOptions& options;

  bool keeps(const Eigen::Vector3d& centre, double cell) const {
    int seen = 0;
    int against = 0;  // most of space is against several masks: the views after them need no look
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const Camera& camera = cameras[i];
      const auto pixel = project(camera, centre);
      if (!pixel || masks[i].empty()) {
        continue;
      }
      const double depth = camera_from_world(camera, centre).z();
      const double radius = kHalfDiagonal * cell * std::max(camera.fx, camera.fy) / depth + 0.5;
      if (pixel->x() < -radius || pixel->y() < -radius || pixel->x() > camera.width + radius ||
          pixel->y() > camera.height + radius) {
        continue;
      }
      ++seen;
      against += masks[i].any_near(pixel->x(), pixel->y(), radius) ? 0 : 1;
      if (against > options.tolerated) {
        return false;
      }
    }
    const auto views = static_cast<double>(cameras.size());
    return seen >= std::max(2.0, options.min_share * views);
  }
};

VisualHull carved(const Carver& carver, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                  double cell) {
  VisualHull hull;
  hull.origin = low;
  hull.voxel_size = cell;
  const Eigen::Vector3d sides = (high - low) / cell;
  hull.nx = std::max(1, saturating_cast<int>(std::ceil(sides.x())));
  hull.ny = std::max(1, saturating_cast<int>(std::ceil(sides.y())));
  hull.nz = std::max(1, saturating_cast<int>(std::ceil(sides.z())));
  hull.occupied.assign(static_cast<std::size_t>(hull.nx) * hull.ny * hull.nz, 0);
  parallel_for(hull.nz, 1, [&](Index begin, Index end) {
    for (Index z = begin; z < end; ++z) {
      for (int y = 0; y < hull.ny; ++y) {
        for (int x = 0; x < hull.nx; ++x) {
          const Eigen::Vector3d centre =
              low + cell * Eigen::Vector3d(x + 0.5, y + 0.5, static_cast<double>(z) + 0.5);
          hull.occupied[(static_cast<std::size_t>(z) * hull.ny + y) * hull.nx + x] =
              carver.keeps(centre, cell) ? 1 : 0;
        }
      }
    }
  });
  return hull;
}

}  // namespace

OptionTable describe(VisualHullOptions& options) {
  OptionTable table;
  table.add("voxel_size", options.voxel_size, 0.001, 1, "m", "Edge length of a voxel");
  table.add("half_extent", options.half_extent, 0.01, 100, "m",
            "Half the edge length of the cube around the point that the cameras look at");
  table.add("min_share", options.min_share, 0, 1, "",
            "Minimum fraction of the views that must see a point, at least two");
  table.add("tolerated", options.tolerated, 0, 1000, "",
            "Number of views whose masks may be wrong at a point");
  return table;
}

VisualHull visual_hull(const std::vector<Camera>& cameras, const std::vector<ByteImage>& masks,
                       const VisualHullOptions& options) {
  ATELIER_CHECK(cameras.size() == masks.size(), "a mask for each camera");
  ATELIER_CHECK(options.voxel_size > 0 && options.half_extent > options.voxel_size,
                "0 < cell < reach");
  Carver carver{cameras, {}, options};
  for (std::size_t i = 0; i < masks.size(); ++i) {
    ATELIER_CHECK(masks[i].data.empty() ||
                      (masks[i].width == cameras[i].width && masks[i].height == cameras[i].height),
                  "a mask of another size than its camera's");
    carver.masks.emplace_back(masks[i]);
  }
  // Coarsely first: most of the cube is empty.
  const Eigen::Vector3d centre = looked_at(cameras);
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(options.half_extent);
  const double coarse_cell = std::max(options.voxel_size, options.half_extent / 32);
  VisualHull coarse = carved(carver, centre - reach, centre + reach, coarse_cell);
  Eigen::Vector3d low = centre + reach;
  Eigen::Vector3d high = centre - reach;
  for (int z = 0; z < coarse.nz; ++z) {
    for (int y = 0; y < coarse.ny; ++y) {
      for (int x = 0; x < coarse.nx; ++x) {
        if (coarse.at(x, y, z)) {
          const Eigen::Vector3d corner =
              coarse.origin + coarse.voxel_size * Eigen::Vector3d(x, y, z);
          low = low.cwiseMin(corner);
          high = high.cwiseMax(corner + Eigen::Vector3d::Constant(coarse.voxel_size));
        }
      }
    }
  }
  if ((high.array() <= low.array()).any()) {
    return coarse;  // nothing is left
  }
  return carved(carver, low, high, options.voxel_size);
}

DepthBounds depth_bounds(const VisualHull& hull, const Camera& camera, const ByteImage& mask) {
  ATELIER_CHECK(mask.data.empty() || (mask.width == camera.width && mask.height == camera.height),
                "a mask of another size than its camera's");
  DepthBounds bounds{Image(camera.width, camera.height, 1), Image(camera.width, camera.height, 1)};
  const Eigen::Vector3d centre = camera_center(camera);
  const Eigen::Vector3d axis = camera.camera_from_world_rotation.row(2).transpose();
  const Eigen::Vector3d start = (centre - hull.origin) / hull.voxel_size;
  const Eigen::Vector3d sides(hull.nx, hull.ny, hull.nz);
  parallel_for(camera.height, 8, [&](Index begin, Index end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < camera.width; ++x) {
        if (!mask.data.empty() && mask.at(x, y) == 0) {
          continue;
        }
        const auto direction = ray_direction(camera, {x + 0.5, y + 0.5});
        if (!direction) {
          continue;
        }
        // The box first, then half a cell a step.
        double from = 0;
        double to = 1e9;
        for (int k = 0; k < 3; ++k) {
          const double slope = (*direction)(k);
          if (std::abs(slope) < 1e-12) {
            if (start(k) < 0 || start(k) > sides(k)) {
              to = -1;
            }
            continue;
          }
          const double one = -start(k) / slope;
          const double other = (sides(k) - start(k)) / slope;
          from = std::max(from, std::min(one, other));
          to = std::min(to, std::max(one, other));
        }
        double first = -1;
        double last = -1;
        for (double t = from + 0.25; t < to; t += 0.5) {
          // Between two planes of the grid's box: no check of the cast is needed.
          const Eigen::Vector3i at = (start + t * *direction).array().floor().cast<int>();
          if ((at.array() < 0).any() || at.x() >= hull.nx || at.y() >= hull.ny ||
              at.z() >= hull.nz || !hull.at(at.x(), at.y(), at.z())) {
            continue;
          }
          first = first < 0 ? t : first;
          last = t;
        }
        if (first >= 0) {
          const double scale = hull.voxel_size * axis.dot(*direction);
          bounds.near_depth.at(x, y) = static_cast<float>(std::max(first - 1, 0.25) * scale);
          bounds.far_depth.at(x, y) = static_cast<float>((last + 1) * scale);
        }
      }
    }
  });
  return bounds;
}

}  // namespace atelier
