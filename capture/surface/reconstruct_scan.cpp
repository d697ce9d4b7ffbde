#include "capture/surface/reconstruct_scan.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "capture/label_taxonomy.h"
#include "capture/surface/color_samples.h"
#include "capture/surface/hull_support.h"
#include "capture/surface/refine_cameras.h"
#include "capture/surface/stereo_image.h"
#include "capture/surface/trim_to_views.h"
#include "core/error.h"

namespace atelier {
namespace {

/// Gives the cameras the gains that their images show, as bright together as before. Throws
/// DataError if the images share too little to tell.
void take_gains(std::vector<InstantView>& views, const CoarseReconstruction& scan) {
  const ColorGains measured = color_gains(static_cast<int>(views.size()), color_samples(scan));
  Eigen::Vector3d brightness = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (measured.measured[i]) {
      brightness += views[i].camera.gain.array().log().matrix();
      count += 1;
    }
  }
  brightness = (brightness / count).array().exp().matrix();
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (measured.measured[i]) {
      views[i].camera.gain = measured.gain[i].cwiseProduct(brightness);
    }
  }
}

/// Gives the cameras the poses that their images show.
void take_poses(std::vector<InstantView>& views, const CoarseReconstruction& scan,
                const RefineCameraOptions& options) {
  std::vector<Camera> cameras;
  std::vector<Image> images;
  for (const InstantView& view : views) {
    cameras.push_back(view.camera);
    images.push_back(stereo_image(view.image));
  }
  const RefinedCameras refined = refine_cameras(cameras, images, scan.places, options);
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].camera = refined.cameras[i];
  }
}

Mesh joined_points(const Mesh& a, const Mesh& b) {
  if (b.vertices.rows() == 0) {
    return a;
  }
  Mesh both;
  const auto stack = [](auto& out, const auto& top, const auto& bottom) {
    out.resize(top.rows() + bottom.rows(), top.cols());
    out << top, bottom;
  };
  stack(both.vertices, a.vertices, b.vertices);
  stack(both.normals, a.normals, b.normals);
  stack(both.colors, a.colors, b.colors);
  stack(both.confidence, a.confidence, b.confidence);
  return both;
}

}  // namespace

OptionTable describe(ReconstructOptions& options) {
  OptionTable table;
  table.add("hull", describe(options.hull));
  table.add("stereo", describe(options.stereo));
  table.add("fuse", describe(options.fuse));
  table.add("surface", describe(options.surface));
  table.add("labels", describe(options.labels));
  table.add("exposure_compensation", options.exposure_compensation,
            "Estimation of the views' exposures and colours beforehand, on downscaled images. Off: "
            "the capture's gains are correct");
  table.add("align", options.align,
            "Refinement of the camera poses by the surface itself. Off: the calibration is exact");
  table.add("refine", describe(options.refine));
  table.add("contours", describe(options.contours));
  table.add("hull_support", options.hull_support,
            "Filling of what stereo does not see by the visual hull, with confidence 0, which is "
            "closer to a body than a hole but up to centimetres outside it");
  return table;
}

void settle_cameras(std::vector<InstantView>& views, ReconstructOptions& options, Device device) {
  if (!options.exposure_compensation && !options.align) {
    return;
  }
  // Faults of views are found and reported again at full size.
  std::optional<CoarseReconstruction> scan;
  try {
    scan = coarse_reconstruction(views, options, {}, device);
  } catch (const DataError&) {
  }
  if (options.exposure_compensation) {
    try {
      if (scan) {
        take_gains(views, *scan);
      }
    } catch (const DataError&) {
      scan.reset();
    }
    options.stereo.level_weight = scan ? options.stereo.level_weight : 0;
  }
  if (options.align && scan) {
    take_poses(views, *scan, options.refine);
  }
}

ReconstructedScan surface_of(const StraightInstant& instant, std::vector<DepthMap> maps,
                             const ReconstructOptions& options) {
  ConsistentPoints agreed = consistent_points(instant, std::move(maps), options);
  ReconstructedScan result;
  const Mesh support = options.hull_support
                           ? hull_support(instant.hull, agreed.maps, agreed.points,
                                          std::max(options.surface.trim, options.hull.voxel_size),
                                          options.fuse.min_confidence)
                           : Mesh{};
  result.scan =
      trimmed_to_views(surface_from_points(joined_points(agreed.points, support), options.surface),
                       instant.cameras, instant.masks, agreed.maps, options.fuse.min_confidence);
  std::vector<LabelView> labels;
  for (std::size_t i = 0; i < instant.labels.size(); ++i) {
    if (!instant.labels[i].data.empty()) {
      labels.push_back({instant.cameras[i], instant.labels[i], &agreed.maps[i]});
    }
  }
  result.scan.labels =
      smooth_labels(result.scan, label_votes(result.scan, labels, options.labels), options.labels);
  // Cloth is matt: stereo has no bias there, and prints have edges of their own.
  std::vector<std::uint8_t> skin;
  for (const std::uint8_t label : result.scan.labels) {
    skin.push_back(label == static_cast<std::uint8_t>(Label::Skin) ? 1 : 0);
  }
  skin.resize(static_cast<std::size_t>(result.scan.vertices.rows()), 0);
  std::vector<ByteImage> trusted = instant.masks;  // of views that the others do not contradict
  for (std::size_t i = 0; i < trusted.size(); ++i) {
    const auto& depth = agreed.maps[i].depth.data;
    if (std::none_of(depth.begin(), depth.end(), [](float z) { return z > 0; })) {
      trusted[i] = {};
    }
  }
  result.scan = moved_to_contours(result.scan, instant.cameras, instant.images, trusted, skin,
                                  options.contours);
  result.points = std::move(agreed.points);
  result.maps = std::move(agreed.maps);
  result.findings = instant.findings;
  result.findings.insert(result.findings.end(), agreed.findings.begin(), agreed.findings.end());
  return result;
}

ReconstructedScan reconstruct_scan(std::vector<InstantView> views,
                                   const ReconstructOptions& options, Device device) {
  ReconstructOptions used = options;
  settle_cameras(views, used, device);
  const StraightInstant instant = straight_instant(std::move(views), used);
  return surface_of(instant, instant_depths(instant, used, device), used);
}

}  // namespace atelier
