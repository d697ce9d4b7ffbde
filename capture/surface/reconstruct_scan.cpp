#include "capture/surface/reconstruct_scan.h"

#include <cmath>

#include "capture/surface/color_samples.h"
#include "capture/surface/hull_support.h"
#include "core/error.h"

namespace atelier {
namespace {

/// Gives the cameras the gains that their pictures show, as bright together as before. False if
/// the pictures share too little to tell.
bool take_gains(std::vector<InstantView>& views, const ReconstructOptions& options, Device device) {
  ColorGains measured;
  try {
    measured =
        color_gains(static_cast<int>(views.size()), color_samples(views, options, {}, device));
  } catch (const DataError&) {
    return false;  // what is wrong with the views is found and said again at full size
  }
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
  return true;
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
  table.add("equalize", options.equalize,
            "Measure the views' exposures and colours first, on small pictures. Off: the capture's "
            "gains are right.");
  table.add(
      "hull_support", options.hull_support,
      "Close what stereo sees nothing of by the hull, with confidence 0. Nearer to a body than "
      "a hole, but up to centimetres outside it.");
  return table;
}

void equalize(std::vector<InstantView>& views, ReconstructOptions& options, Device device) {
  if (options.equalize && !take_gains(views, options, device)) {
    options.stereo.level_weight = 0;
  }
}

ReconstructedScan surface_of(const StraightInstant& instant, std::vector<DepthMap> maps,
                             const ReconstructOptions& options) {
  AgreedPoints agreed = agreed_points(instant, std::move(maps), options);
  ReconstructedScan result;
  const Mesh support = options.hull_support
                           ? hull_support(instant.hull, agreed.maps, agreed.points,
                                          options.surface.trim, options.fuse.least_confidence)
                           : Mesh{};
  result.scan = surface_from_points(joined_points(agreed.points, support), options.surface);
  result.scan.labels = smooth_labels(
      result.scan, label_votes(result.scan, instant.labels, options.labels), options.labels);
  result.points = std::move(agreed.points);
  result.maps = std::move(agreed.maps);
  result.findings = instant.findings;
  result.findings.insert(result.findings.end(), agreed.findings.begin(), agreed.findings.end());
  return result;
}

ReconstructedScan reconstruct_scan(std::vector<InstantView> views,
                                   const ReconstructOptions& options, Device device) {
  ReconstructOptions used = options;
  equalize(views, used, device);
  const StraightInstant instant = straight_instant(std::move(views), used);
  return surface_of(instant, instant_depths(instant, used, device), used);
}

}  // namespace atelier
