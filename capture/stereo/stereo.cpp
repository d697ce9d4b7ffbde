#include "capture/stereo/stereo.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "capture/stereo/halved.h"
#include "capture/stereo/stereo_levels.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

bool is_like(const Image& image, const Camera& camera) {
  return image.width == camera.width && image.height == camera.height && image.channels == 1;
}

void check_view(const std::vector<StereoView>& views, const StereoView& view) {
  check_camera(view.camera);
  ATELIER_CHECK(view.camera.distortion_model == Distortion::None, "a camera with distortion");
  ATELIER_CHECK(is_like(view.image, view.camera) && is_like(view.near_depth, view.camera) &&
                    is_like(view.far_depth, view.camera),
                "images of another size than the camera's");
  for (const int source : view.sources) {
    ATELIER_CHECK(source >= 0 && source < static_cast<int>(views.size()) &&
                      &views[static_cast<std::size_t>(source)] != &view,
                  "a source out of range");
  }
  for (std::size_t i = 0; i < view.near_depth.data.size(); ++i) {
    const float near_depth = view.near_depth.data[i];
    const float far_depth = view.far_depth.data[i];
    if (near_depth == 0) {
      continue;
    }
    if (!(near_depth > 0 && far_depth >= near_depth && std::isfinite(far_depth))) {
      throw DataError("", view.camera.id + " pixel " + std::to_string(i),
                      "depth bounds " + short_number(near_depth) + " to " + short_number(far_depth),
                      "0 < near <= far");
    }
  }
}

void check_views(const std::vector<StereoView>& views, const StereoOptions& options) {
  ATELIER_CHECK(options.sources >= 1 && options.sources <= kLargestSources, "1 to 8 sources");
  ATELIER_CHECK(options.levels >= 1 && options.levels <= 8, "1 to 8 levels");
  ATELIER_CHECK(options.iterations >= 1 && options.refinements >= 1, "at least one sweep");
  parallel_for(static_cast<Index>(views.size()), 1, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      check_view(views, views[static_cast<std::size_t>(i)]);
    }
  });
}
/// Bounds that hold for each of the four pixels; looked at if one of them is.
void halve_bounds(const Image& fine_near, const Image& fine_far, StereoLevel& coarse) {
  coarse.near_depth = Image(coarse.image.width, coarse.image.height, 1);
  coarse.far_depth = coarse.near_depth;
  for (int y = 0; y < fine_near.height; ++y) {
    for (int x = 0; x < fine_near.width; ++x) {
      const float near_depth = fine_near.at(x, y);
      if (near_depth > 0) {
        float& low = coarse.near_depth.at(x / 2, y / 2);
        float& high = coarse.far_depth.at(x / 2, y / 2);
        low = low > 0 ? std::min(low, near_depth) : near_depth;
        high = std::max(high, fine_far.at(x, y));
      }
    }
  }
}

Eigen::Matrix3d intrinsics(const Camera& camera) {
  Eigen::Matrix3d k;
  k << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  return k;
}

}  // namespace

OptionTable describe(StereoOptions& options) {
  OptionTable table;
  table.add("sources", options.sources, 1, kLargestSources, "",
            "Number of source views that each view is compared with");
  table.add("levels", options.levels, 1, 8, "", "Number of resolutions, each half of the next");
  table.add("iterations", options.iterations, 1, 16, "",
            "Number of PatchMatch sweeps on the coarsest level");
  table.add("refinements", options.refinements, 1, 16, "",
            "Number of sweeps on every level that use the other views' depths");
  table.add("colour_sigma", options.colour_sigma, 0.01, 10, "",
            "Difference of values at which a pixel of the window is down-weighted");
  table.add("level_weight", options.level_weight, 0, 2, "",
            "Weight of brightness differences between views relative to the window's contrast; 0 "
            "where exposures differ");
  table.add("geometric_weight", options.geometric_weight, 0, 1, "1/px",
            "Cost of a pixel of disagreement with another view's depth");
  table.add("prior_weight", options.prior_weight, 0, 2, "",
            "Cost of a plane far from the one predicted by confident pixels nearby");
  table.add("vectors", options.vectors, {"auto", "scalar", "avx2"}, "CPU vector instructions");
  table.add("seed", options.seed, 0, 1e15, "", "Seed of the random planes");
  return table;
}

namespace {

std::vector<StereoLevel> halves_of(const StereoView& view, int levels) {
  std::vector<StereoLevel> halves;
  for (int level = 1; level < levels; ++level) {
    const Image& image = halves.empty() ? view.image : halves.back().image;
    if (std::min(image.width, image.height) < 64) {
      break;
    }
    StereoLevel next;
    next.camera = halved(halves.empty() ? view.camera : halves.back().camera);
    next.image = halved(image);
    halve_bounds(halves.empty() ? view.near_depth : halves.back().near_depth,
                 halves.empty() ? view.far_depth : halves.back().far_depth, next);
    halves.push_back(std::move(next));
  }
  return halves;
}

/// The level's half, or null where the level is the view itself; small views have fewer levels.
const StereoLevel* half_of(const StereoLevels& levels, std::size_t view, std::size_t level) {
  const std::vector<StereoLevel>& halves = levels.halves[view];
  const std::size_t own = std::min(level, halves.size());
  return own == 0 ? nullptr : &halves[own - 1];
}

}  // namespace

StereoLevels stereo_levels(const std::vector<StereoView>& views, int levels) {
  StereoLevels all{views, std::vector<std::vector<StereoLevel>>(views.size())};
  parallel_for(static_cast<Index>(views.size()), 1, [&](Index begin, Index end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      all.halves[i] = halves_of(views[i], levels);
    }
  });
  for (const std::vector<StereoLevel>& halves : all.halves) {
    all.deepest = std::max(all.deepest, halves.size());
  }
  return all;
}

const Camera& StereoLevels::camera(std::size_t view, std::size_t level) const {
  const StereoLevel* half = half_of(*this, view, level);
  return half == nullptr ? views[view].camera : half->camera;
}

const Image& StereoLevels::image(std::size_t view, std::size_t level) const {
  const StereoLevel* half = half_of(*this, view, level);
  return half == nullptr ? views[view].image : half->image;
}

const Image& StereoLevels::near_depth(std::size_t view, std::size_t level) const {
  const StereoLevel* half = half_of(*this, view, level);
  return half == nullptr ? views[view].near_depth : half->near_depth;
}

const Image& StereoLevels::far_depth(std::size_t view, std::size_t level) const {
  const StereoLevel* half = half_of(*this, view, level);
  return half == nullptr ? views[view].far_depth : half->far_depth;
}

StereoProblem stereo_problem(const Camera& camera, const StereoOptions& options,
                             std::uint64_t seed) {
  StereoProblem problem{};
  problem.fx = static_cast<float>(camera.fx);
  problem.fy = static_cast<float>(camera.fy);
  problem.cx = static_cast<float>(camera.cx);
  problem.cy = static_cast<float>(camera.cy);
  problem.width = camera.width;
  problem.height = camera.height;
  problem.colour_sigma = static_cast<float>(options.colour_sigma);
  problem.level_weight = static_cast<float>(options.level_weight);
  problem.geometric_weight = static_cast<float>(options.geometric_weight);
  problem.prior_weight = static_cast<float>(options.prior_weight);
  problem.seed = seed;
  return problem;
}

StereoSource stereo_source(const Camera& reference, const Camera& source) {
  const Eigen::Matrix3d rotation =
      source.camera_from_world_rotation * reference.camera_from_world_rotation.transpose();
  const Eigen::Vector3d translation =
      source.camera_from_world_translation - rotation * reference.camera_from_world_translation;
  const Eigen::Matrix3d forth = intrinsics(source) * rotation * intrinsics(reference).inverse();
  const Eigen::Vector3d forth_t = intrinsics(source) * translation;
  const Eigen::Matrix3d back =
      intrinsics(reference) * rotation.transpose() * intrinsics(source).inverse();
  const Eigen::Vector3d back_t = intrinsics(reference) * (-(rotation.transpose() * translation));
  StereoSource numbers{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      numbers.forth[3 * i + j] = static_cast<float>(forth(i, j));
      numbers.back[3 * i + j] = static_cast<float>(back(i, j));
    }
    numbers.forth_t[i] = static_cast<float>(forth_t(i));
    numbers.back_t[i] = static_cast<float>(back_t(i));
  }
  numbers.parallax = static_cast<float>(source.fx * translation.norm());
  numbers.width = source.width;
  numbers.height = source.height;
  return numbers;
}

WorldFromCamera world_from_camera(const Camera& camera) {
  WorldFromCamera axes{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      axes.row[3 * i + j] = camera.camera_from_world_rotation(j, i);
    }
  }
  return axes;
}

DepthMap empty_depth_map(const Camera& camera) {
  return {camera, Image(camera.width, camera.height, 1), Image(camera.width, camera.height, 3),
          Image(camera.width, camera.height, 1)};
}

std::vector<DepthMap> stereo(const std::vector<StereoView>& views, const StereoOptions& options,
                             Device device) {
  check_views(views, options);
  check_device(device);
#ifdef ATELIER_HAS_CUDA
  return device == Device::Cuda ? stereo_cuda(views, options) : stereo_cpu(views, options);
#else
  return stereo_cpu(views, options);
#endif
}

}  // namespace atelier
