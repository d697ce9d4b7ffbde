#include "capture/surface/split_by_color.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "capture/label_taxonomy.h"
#include "capture/surface/surface_labels.h"
#include "core/error.h"
#include "core/random.h"

namespace atelier {
namespace {

using Vector3 = Eigen::Vector3d;

/// CIE Lab of linear sRGB under D65.
Vector3 lab_of(const Vector3& rgb) {
  Eigen::Matrix3d xyz_from_rgb;
  xyz_from_rgb << 0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505;
  const Vector3 xyz = (xyz_from_rgb * rgb.cwiseMax(0)).cwiseQuotient(Vector3(0.9505, 1, 1.089));
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116; };
  return {116 * f(xyz.y()) - 16, 500 * (f(xyz.x()) - f(xyz.y())), 200 * (f(xyz.y()) - f(xyz.z()))};
}

/// Lightness says more about shading than about material.
Vector3 feature_of(const Vector3& rgb) {
  constexpr double kLightness = 0.4;
  Vector3 lab = lab_of(rgb);
  lab.x() *= kLightness;
  return lab;
}

/// r and g of the light.
Eigen::Vector2d chromaticity(const Vector3& rgb) {
  const double sum = std::max(rgb.sum(), 1e-6);
  return {rgb.x() / sum, rgb.y() / sum};
}

/// Skin of every shade reflects red more than green, and green more than blue.
bool like_skin(const Vector3& rgb) {
  const Eigen::Vector2d c = chromaticity(rgb);
  return c.x() > 0.36 && c.x() < 0.62 && c.y() > 0.24 && c.y() < 0.37 && rgb.y() > rgb.z();
}

struct Clusters {
  std::vector<int> of_vertex;
  std::vector<Vector3> color;  ///< mean linear RGB
  std::vector<double> area;
};

Clusters clusters_of(const std::vector<Vector3>& rgb, const std::vector<double>& area, int count) {
  std::vector<Vector3> features;
  features.reserve(rgb.size());
  for (const Vector3& color : rgb) {
    features.push_back(feature_of(color));
  }
  Random random{17, 1};
  std::vector<Vector3> centres = {features[uniform_index(random, features.size())]};
  std::vector<double> nearest(features.size(), std::numeric_limits<double>::infinity());
  while (static_cast<int>(centres.size()) < count) {
    double sum = 0;
    for (std::size_t v = 0; v < features.size(); ++v) {
      nearest[v] = std::min(nearest[v], (features[v] - centres.back()).squaredNorm());
      sum += area[v] * nearest[v];
    }
    double at = uniform(random) * sum;
    std::size_t chosen = features.size() - 1;
    for (std::size_t v = 0; v < features.size(); ++v) {
      at -= area[v] * nearest[v];
      if (at <= 0) {
        chosen = v;
        break;
      }
    }
    centres.push_back(features[chosen]);
  }
  Clusters result;
  result.of_vertex.assign(features.size(), 0);
  constexpr int kRounds = 25;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Vector3> sums(centres.size(), Vector3::Zero());
    std::vector<double> weights(centres.size(), 0);
    bool changed = false;
    for (std::size_t v = 0; v < features.size(); ++v) {
      int best = 0;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t k = 0; k < centres.size(); ++k) {
        const double distance = (features[v] - centres[k]).squaredNorm();
        if (distance < least) {
          least = distance;
          best = static_cast<int>(k);
        }
      }
      changed = changed || best != result.of_vertex[v];
      result.of_vertex[v] = best;
      sums[static_cast<std::size_t>(best)] += area[v] * features[v];
      weights[static_cast<std::size_t>(best)] += area[v];
    }
    for (std::size_t k = 0; k < centres.size(); ++k) {
      if (weights[k] > 0) {
        centres[k] = sums[k] / weights[k];
      }
    }
    if (!changed && round > 0) {
      break;
    }
  }
  result.color.assign(centres.size(), Vector3::Zero());
  result.area.assign(centres.size(), 0);
  for (std::size_t v = 0; v < rgb.size(); ++v) {
    const auto k = static_cast<std::size_t>(result.of_vertex[v]);
    result.color[k] += area[v] * rgb[v];
    result.area[k] += area[v];
  }
  for (std::size_t k = 0; k < centres.size(); ++k) {
    result.color[k] /= std::max(result.area[k], 1e-12);
  }
  return result;
}

}  // namespace

OptionTable describe(ColorSplitOptions& options) {
  OptionTable table;
  table.add("clusters", options.clusters, 2, 16, "",
            "Number of colours that the surface is clustered into");
  table.add("skin_distance", options.skin_distance, 0, 1, "",
            "Maximum distance of chromaticity from the face's that counts as skin");
  table.add("head", options.head, 0.02, 0.5, "", "Fraction of the stature that is the head");
  table.add("smoothness", options.smoothness, 0, 1000, "",
            "Cost of a label border between neighbours; 0: none");
  return table;
}

ColorSplit split_by_color(const Mesh& scan, const ColorSplitOptions& options) {
  const auto count = static_cast<std::size_t>(scan.vertices.rows());
  ATELIER_CHECK(scan.colors.rows() == scan.vertices.rows(), "a scan with a colour for each vertex");
  ATELIER_CHECK(scan.faces.rows() > 0, "a scan with faces");
  constexpr std::size_t kLeast = 100;
  if (count < kLeast) {
    throw DataError("", "scan", std::to_string(count) + " vertices", "100 at least");
  }
  std::vector<double> area(count, 1e-12);
  for (Index f = 0; f < scan.faces.rows(); ++f) {
    const Vector3 a = scan.vertices.row(scan.faces(f, 0)).transpose();
    const Vector3 b = scan.vertices.row(scan.faces(f, 1)).transpose();
    const Vector3 c = scan.vertices.row(scan.faces(f, 2)).transpose();
    const double third = (b - a).cross(c - a).norm() / 6;
    for (int i = 0; i < 3; ++i) {
      area[static_cast<std::size_t>(scan.faces(f, i))] += third;
    }
  }
  std::vector<Vector3> rgb;
  std::vector<double> height;
  const double low = scan.vertices.col(1).minCoeff();
  const double high = scan.vertices.col(1).maxCoeff();
  for (std::size_t v = 0; v < count; ++v) {
    rgb.push_back(scan.colors.row(static_cast<Index>(v)).cast<double>().transpose());
    height.push_back((scan.vertices(static_cast<Index>(v), 1) - low) / std::max(high - low, 1e-9));
  }
  const Clusters clusters = clusters_of(rgb, area, options.clusters);
  const std::size_t kinds = clusters.color.size();

  // Where each cluster is: on the head, on the feet, above and below the waist.
  constexpr double kShoes = 0.06;
  constexpr double kWaist = 0.55;
  std::vector<std::array<double, 4>> share(kinds, {0, 0, 0, 0});
  for (std::size_t v = 0; v < count; ++v) {
    const int place = height[v] > 1 - options.head ? 0
                      : height[v] < kShoes         ? 1
                      : height[v] > kWaist         ? 2
                                                   : 3;
    share[static_cast<std::size_t>(clusters.of_vertex[v])][static_cast<std::size_t>(place)] +=
        area[v];
  }
  ColorSplit split;
  split.findings.push_back({Severity::Warning, "labels-by-color", "",
                            "skin and clothing are told by colour alone",
                            "give label images: atelier detect runs a parsing network"});
  // Of what is like skin on the head, hair is darker.
  const auto faceness = [&](std::size_t k) { return share[k][0] * clusters.color[k].sum(); };
  std::size_t face = kinds;
  for (std::size_t k = 0; k < kinds; ++k) {
    if (like_skin(clusters.color[k]) && (face == kinds || faceness(k) > faceness(face))) {
      face = k;
    }
  }
  std::vector<bool> skin(kinds, false);
  if (face == kinds || share[face][0] <= 0) {
    split.findings.push_back({Severity::Warning, "skin-not-found", "",
                              "no colour of the head is a skin's",
                              "everything counts as clothing; give label images"});
    face = kinds;
  } else {
    constexpr double kHairShare = 0.35;  // of the face's light: hair, not a shaded limb
    for (std::size_t k = 0; k < kinds; ++k) {
      const double off =
          (chromaticity(clusters.color[k]) - chromaticity(clusters.color[face])).norm();
      const bool hair = clusters.color[k].sum() < kHairShare * clusters.color[face].sum();
      skin[k] = k == face || (like_skin(clusters.color[k]) && off < options.skin_distance && !hair);
    }
  }
  // Is what is worn above the waist the same as below?
  double above = 0;
  double below = 0;
  double shared = 0;
  for (std::size_t k = 0; k < kinds; ++k) {
    if (!skin[k]) {
      above += share[k][2];
      below += share[k][3];
    }
  }
  for (std::size_t k = 0; k < kinds; ++k) {
    if (!skin[k] && above > 0 && below > 0) {
      shared += std::min(share[k][2] / above, share[k][3] / below);
    }
  }
  constexpr double kOneGarment = 0.5;
  const bool dress = shared > kOneGarment;

  LabelVotes votes;
  votes.ids = {static_cast<std::uint8_t>(Label::Skin),  static_cast<std::uint8_t>(Label::Hair),
               static_cast<std::uint8_t>(Label::Upper), static_cast<std::uint8_t>(Label::Lower),
               static_cast<std::uint8_t>(Label::Dress), static_cast<std::uint8_t>(Label::Shoes)};
  constexpr double kSure = 0.9;
  const auto ids = static_cast<Index>(votes.ids.size());
  votes.probability = Eigen::MatrixXd::Constant(static_cast<Index>(count), ids,
                                                (1 - kSure) / static_cast<double>(ids - 1));
  for (std::size_t v = 0; v < count; ++v) {
    const auto k = static_cast<std::size_t>(clusters.of_vertex[v]);
    int label = 0;
    if (!skin[k]) {
      const bool upper =
          share[k][2] / std::max(above, 1e-12) > share[k][3] / std::max(below, 1e-12);
      label = height[v] > 1 - options.head ? 1 : height[v] < kShoes ? 5 : dress ? 4 : upper ? 2 : 3;
    }
    votes.probability(static_cast<Index>(v), label) = kSure;
  }
  SurfaceLabelOptions smoothing;
  smoothing.smoothness = options.smoothness;
  split.labels = smooth_labels(scan, votes, smoothing);
  return split;
}

}  // namespace atelier
