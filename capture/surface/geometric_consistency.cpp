#include "capture/surface/geometric_consistency.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "capture/stereo/choose_sources.h"
#include "capture/stereo/share_views.h"
#include "capture/stereo/undistort.h"
#include "capture/surface/check_masks.h"
#include "capture/surface/stereo_image.h"
#include "core/error.h"
#include "core/median.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

/// A view without distortion and gain.
struct StraightView {
  Camera camera;
  Image image;
  ByteImage mask;
  ByteImage labels;
};

StraightView straightened(const InstantView& view) {
  StraightView straight;
  straight.camera = without_distortion(view.camera);
  straight.image = undistorted(view.camera, view.image);
  for (std::size_t i = 0; i < straight.image.data.size(); ++i) {
    straight.image.data[i] /= static_cast<float>(view.camera.gain(static_cast<Index>(i % 3)));
  }
  if (!view.mask.data.empty()) {
    straight.mask = undistorted(view.camera, view.mask);
  }
  if (!view.labels.data.empty()) {
    straight.labels = undistorted(view.camera, view.labels);
  }
  return straight;
}

bool is_black(const Image& image) {
  constexpr float kBlack = 0.002f;
  return std::none_of(image.data.begin(), image.data.end(),
                      [](float value) { return value > kBlack; });
}

/// The views that have an image and a mask with somebody in it.
std::vector<InstantView> seeing_views(std::vector<InstantView> views,
                                      std::vector<Finding>& findings) {
  std::vector<InstantView> seeing;
  for (InstantView& view : views) {
    ATELIER_CHECK(view.image.width == view.camera.width &&
                      view.image.height == view.camera.height && view.image.channels == 3,
                  "an image of another size than its camera's");
    if (is_black(view.image)) {
      findings.push_back({Severity::Warning, "view-black", view.camera.id, "the image is black",
                          "it is left out"});
    } else if (std::none_of(view.mask.data.begin(), view.mask.data.end(),
                            [](std::uint8_t pixel) { return pixel != 0; })) {
      findings.push_back({Severity::Warning, "view-mask-empty", view.camera.id,
                          "the mask shows no subject", "it is left out"});
    } else {
      seeing.push_back(std::move(view));
    }
  }
  return seeing;
}

/// Turns masks round that are inverted, and takes away those that contradict the others: such a
/// view then looks at all that the other masks leave.
void mend_masks(std::vector<InstantView>& views, double reach, std::vector<Finding>& findings) {
  std::vector<Camera> cameras;
  std::vector<ByteImage> masks;
  for (const InstantView& view : views) {
    cameras.push_back(view.camera);
    masks.push_back(view.mask);
  }
  const std::vector<MaskFit> fits = check_masks(cameras, masks, reach);
  for (std::size_t i = 0; i < views.size(); ++i) {
    ByteImage& mask = views[i].mask;
    if (fits[i] == MaskFit::Inverted) {
      findings.push_back({Severity::Warning, "view-mask-inverted", views[i].camera.id,
                          "the mask shows background where the subject must be",
                          "it is read the other way round"});
      for (std::uint8_t& pixel : mask.data) {
        pixel = pixel != 0 ? 0 : 255;
      }
    } else if (fits[i] == MaskFit::Off) {
      findings.push_back({Severity::Warning, "view-mask-off", views[i].camera.id,
                          "the mask shows little of what the others show as the subject",
                          "it is not used; check its frame and its calibration"});
      mask = {};
    }
  }
}

/// Of a map's sure pixels that another view has in its image, the share on which one agrees; 1
/// where too few are to tell. Every fourth pixel is asked.
double agreement(const std::vector<DepthMap>& maps, std::size_t view, const FuseOptions& options) {
  constexpr int kStep = 4;
  const DepthMap& map = maps[view];
  int asked = 0;
  int agreed = 0;
  for (int y = kStep / 2; y < map.depth.height; y += kStep) {
    for (int x = kStep / 2; x < map.depth.width; x += kStep) {
      const double depth = map.depth.at(x, y);
      const auto ray = ray_direction(map.camera, {x + 0.5, y + 0.5});
      if (!(depth > 0) || map.confidence.at(x, y) < options.min_confidence || !ray) {
        continue;
      }
      const Eigen::Vector3d axis = map.camera.camera_from_world_rotation.row(2).transpose();
      const Eigen::Vector3d point = camera_center(map.camera) + depth / axis.dot(*ray) * *ray;
      bool seen = false;
      bool agrees = false;
      for (std::size_t other = 0; other < maps.size() && !agrees; ++other) {
        const Camera& camera = maps[other].camera;
        const auto pixel = other == view ? std::nullopt : project(camera, point);
        if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= camera.width ||
            pixel->y() >= camera.height) {
          continue;
        }
        const double there =
            maps[other].depth.at(static_cast<int>(pixel->x()), static_cast<int>(pixel->y()));
        const double expected = camera_from_world(camera, point).z();
        seen = seen || there > 0;
        agrees = there > 0 && std::abs(there - expected) <= options.depth_error * expected;
      }
      asked += seen ? 1 : 0;
      agreed += agrees ? 1 : 0;
    }
  }
  constexpr int kEnough = 25;
  return asked < kEnough ? 1 : static_cast<double>(agreed) / asked;
}

/// Empties the maps of views that agree far less with the others than is usual: their calibration
/// is wrong, and what they see is somewhere else. One after the other, the worst first, since its
/// neighbours agree less for its sake too.
void leave_out_strays(std::vector<DepthMap>& maps, const FuseOptions& options,
                      std::vector<Finding>& findings) {
  constexpr std::size_t kFew = 4;  // of three, none can be told from the others
  constexpr std::size_t kSure = 8;
  constexpr double kLeast = 0.6;  // of what is usual
  double usual = 0;
  std::vector<char> left_out(maps.size(), 0);
  for (std::size_t left = maps.size(); left >= kFew; --left) {
    std::vector<double> shares;
    std::size_t worst = maps.size();
    double least = 2;
    for (std::size_t i = 0; i < maps.size(); ++i) {
      if (left_out[i] == 0) {
        shares.push_back(agreement(maps, i, options));
        if (shares.back() < least) {
          least = shares.back();
          worst = i;
        }
      }
    }
    usual = std::max(usual, median(shares));
    if (!(least < kLeast * usual)) {
      return;
    }
    left_out[worst] = 1;
    findings.push_back({Severity::Warning, "view-disagrees", maps[worst].camera.id,
                        percent(least) + " of what it sees is confirmed by another view, " +
                            percent(usual) + " is usual",
                        maps.size() < kSure ? "its surface is left out; calibrate it again, or "
                                              "its neighbours: of so few views it is a guess"
                                            : "its surface is left out; calibrate it again"});
    std::fill(maps[worst].depth.data.begin(), maps[worst].depth.data.end(), 0.0f);
  }
}

}  // namespace

StraightInstant straight_instant(std::vector<InstantView> views,
                                 const ReconstructOptions& options) {
  StraightInstant instant;
  std::vector<InstantView> seeing = seeing_views(std::move(views), instant.findings);
  if (seeing.size() < 2) {
    throw DataError("", "views", std::to_string(seeing.size()) + " with a subject in them",
                    "at least two");
  }
  mend_masks(seeing, options.hull.half_extent, instant.findings);
  for (InstantView& view : seeing) {
    StraightView straight = straightened(view);
    view = {};
    instant.labels.push_back(std::move(straight.labels));
    instant.cameras.push_back(std::move(straight.camera));
    instant.masks.push_back(std::move(straight.mask));
    instant.images.push_back(std::move(straight.image));
  }
  instant.hull = visual_hull(instant.cameras, instant.masks, options.hull);
  return instant;
}

std::vector<std::size_t> computed_views(const StraightInstant& instant,
                                        const ReconstructOptions& options,
                                        const std::vector<std::size_t>& wanted) {
  return with_sources(
      wanted, choose_sources(instant.cameras, looked_at(instant.cameras), options.stereo.sources));
}

std::vector<DepthMap> instant_depths(const StraightInstant& instant,
                                     const ReconstructOptions& options, Device device,
                                     const std::vector<std::size_t>& wanted) {
  const auto& cameras = instant.cameras;
  const auto sources = choose_sources(cameras, looked_at(cameras), options.stereo.sources);
  if (std::all_of(sources.begin(), sources.end(), [](const auto& few) { return few.empty(); })) {
    throw DataError("", "views", "no two that look at the same side of the subject",
                    "cameras whose views overlap, less than 80 degrees apart");
  }
  // Those that are computed, and where each then is.
  std::vector<int> place(cameras.size(), -1);
  std::vector<std::size_t> computed(cameras.size());
  std::iota(computed.begin(), computed.end(), std::size_t{0});
  if (!wanted.empty()) {
    computed = with_sources(wanted, sources);
  }
  for (std::size_t k = 0; k < computed.size(); ++k) {
    place[computed[k]] = static_cast<int>(k);
  }
  std::vector<StereoView> views;
  for (const std::size_t i : computed) {
    DepthBounds bounds = depth_bounds(instant.hull, cameras[i], instant.masks[i]);
    StereoView& view = views.emplace_back();
    view.camera = cameras[i];
    view.image = stereo_image(instant.images[i]);
    view.near_depth = std::move(bounds.near_depth);
    view.far_depth = std::move(bounds.far_depth);
    for (const int source : sources[i]) {
      if (place[static_cast<std::size_t>(source)] >= 0) {
        view.sources.push_back(place[static_cast<std::size_t>(source)]);
      }
    }
  }
  std::vector<DepthMap> found = stereo(views, options.stereo, device);
  std::vector<DepthMap> maps(cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    maps[i].camera = cameras[i];
  }
  for (std::size_t k = 0; k < computed.size(); ++k) {
    maps[computed[k]] = std::move(found[k]);
  }
  return maps;
}

ConsistentPoints consistent_points(const StraightInstant& instant, std::vector<DepthMap> maps,
                                   const ReconstructOptions& options) {
  ConsistentPoints result;
  result.maps = std::move(maps);
  leave_out_strays(result.maps, options.fuse, result.findings);
  const Mesh fused = fuse(result.maps, instant.images, options.fuse);
  constexpr Index kLeast = 100;
  if (fused.vertices.rows() < kLeast) {
    throw DataError("", "views",
                    std::to_string(fused.vertices.rows()) + " places on which " +
                        std::to_string(options.fuse.min_views) + " views agree",
                    "at least " + std::to_string(kLeast) +
                        "; check calibration and masks, and that views overlap");
  }
  result.points = without_outliers(fused, options.surface);
  return result;
}

}  // namespace atelier
