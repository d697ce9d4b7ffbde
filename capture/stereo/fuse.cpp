#include "capture/stereo/fuse.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace atelier {
namespace {

/// A pixel that agrees.
struct Agreement {
  std::size_t view;
  int x, y;
};

struct Fuser {
  const std::vector<DepthMap>& maps;
  const std::vector<Image>& images;
  const FuseOptions& options;
  std::vector<ByteImage> used;
  double min_cosine = std::cos(options.normal_error);
  std::vector<Agreement> agreed{};  // of the pixel in work

  Eigen::Vector3d place(std::size_t view, int x, int y) const {
    const Camera& camera = maps[view].camera;
    const double depth = maps[view].depth.at(x, y);
    const Eigen::Vector3d in_camera((x + 0.5 - camera.cx) / camera.fx * depth,
                                    (y + 0.5 - camera.cy) / camera.fy * depth, depth);
    return camera.camera_from_world_rotation.transpose() *
           (in_camera - camera.camera_from_world_translation);
  }
  Eigen::Vector3d normal(std::size_t view, int x, int y) const {
    const Image& image = maps[view].normal;
    return {image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)};
  }
  bool takes_part(std::size_t view, int x, int y) const {
    return maps[view].depth.at(x, y) > 0 &&
           maps[view].confidence.at(x, y) >= options.min_confidence && used[view].at(x, y) == 0;
  }

  /// The views that agree with a pixel, itself first.
  void find_agreement(std::size_t view, int x, int y) {
    agreed.assign(1, {view, x, y});
    const Eigen::Vector3d point = place(view, x, y);
    const Eigen::Vector3d direction = normal(view, x, y);
    for (std::size_t other = 0; other < maps.size(); ++other) {
      if (other == view) {
        continue;
      }
      const Camera& camera = maps[other].camera;
      const auto pixel = project(camera, point);
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= camera.width ||
          pixel->y() >= camera.height) {
        continue;
      }
      const int qx = static_cast<int>(pixel->x());
      const int qy = static_cast<int>(pixel->y());
      if (!takes_part(other, qx, qy)) {
        continue;
      }
      const double depth = camera_from_world(camera, point).z();
      if (std::abs(depth - maps[other].depth.at(qx, qy)) > options.depth_error * depth ||
          direction.dot(normal(other, qx, qy)) < min_cosine) {
        continue;
      }
      const auto back = project(maps[view].camera, place(other, qx, qy));
      // The other pixel's centre is up to 0.7 pixels off where the point landed.
      if (back && (*back - Eigen::Vector2d(x + 0.5, y + 0.5)).norm() <= options.pixel_error) {
        agreed.push_back({other, qx, qy});
      }
    }
  }
};

}  // namespace

OptionTable describe(FuseOptions& options) {
  OptionTable table;
  table.add("min_views", options.min_views, 1, 1000, "",
            "Minimum number of views that agree on a point, its own included");
  table.add("pixel_error", options.pixel_error, 0.1, 100, "px",
            "Maximum forward-backward reprojection error of a consistent pixel");
  table.add("depth_error", options.depth_error, 1e-5, 1, "",
            "Maximum relative difference of the depths of a consistent pixel");
  table.add("normal_error", options.normal_error, 0.01, 3.2, "rad",
            "Maximum angle between the normals of a consistent pixel");
  table.add("min_confidence", options.min_confidence, 0, 1, "",
            "Minimum confidence of a pixel that is fused");
  return table;
}

Mesh fuse(const std::vector<DepthMap>& maps, const std::vector<Image>& images,
          const FuseOptions& options) {
  ATELIER_CHECK(images.empty() || images.size() == maps.size(), "an image for each map");
  Fuser fuser{maps, images, options, {}};
  for (std::size_t i = 0; i < maps.size(); ++i) {
    ATELIER_CHECK(
        images.empty() || (images[i].width == maps[i].depth.width &&
                           images[i].height == maps[i].depth.height && images[i].channels == 3),
        "an image of another size than its map");
    fuser.used.emplace_back(maps[i].depth.width, maps[i].depth.height, 1);
  }
  std::vector<Eigen::Vector3d> places;
  std::vector<Eigen::Vector3d> normals;
  std::vector<Eigen::Vector3d> colours;
  std::vector<float> confidences;
  for (std::size_t view = 0; view < maps.size(); ++view) {
    for (int y = 0; y < maps[view].depth.height; ++y) {
      for (int x = 0; x < maps[view].depth.width; ++x) {
        if (!fuser.takes_part(view, x, y)) {
          continue;
        }
        fuser.find_agreement(view, x, y);
        const auto count = static_cast<int>(fuser.agreed.size());
        if (count < options.min_views) {
          continue;
        }
        Eigen::Vector3d place = Eigen::Vector3d::Zero();
        Eigen::Vector3d normal = Eigen::Vector3d::Zero();
        Eigen::Vector3d colour = Eigen::Vector3d::Zero();
        double total = 0;
        double confidence = 0;
        for (const Agreement& one : fuser.agreed) {
          const double weight = maps[one.view].confidence.at(one.x, one.y) + 1e-3;
          place += weight * fuser.place(one.view, one.x, one.y);
          normal += weight * fuser.normal(one.view, one.x, one.y);
          for (int c = 0; c < 3 && !images.empty(); ++c) {
            colour(c) += weight * images[one.view].at(one.x, one.y, c);
          }
          total += weight;
          confidence += maps[one.view].confidence.at(one.x, one.y);
          fuser.used[one.view].at(one.x, one.y) = 1;
        }
        places.push_back(place / total);
        normals.push_back(normal.normalized());
        colours.push_back(colour / total);
        confidences.push_back(static_cast<float>(confidence / (count + 1)));
      }
    }
  }
  Mesh points;
  const auto n = static_cast<Index>(places.size());
  points.vertices.resize(n, 3);
  points.normals.resize(n, 3);
  points.colors.resize(images.empty() ? 0 : n, 3);
  points.confidence.resize(n);
  for (Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    points.vertices.row(i) = places[k].transpose();
    points.normals.row(i) = normals[k].transpose();
    if (!images.empty()) {
      points.colors.row(i) = colours[k]
                                 .cwiseMax(0)
                                 .cwiseMin(1)
                                 .transpose()
                                 .cast<typename decltype(points.colors)::Scalar>();
    }
    points.confidence(i) = confidences[k];
  }
  return points;
}

}  // namespace atelier
