#include "capture/detector.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

bool inside(const Camera& camera, const Eigen::Vector2d& pixel) {
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < camera.width && pixel.y() < camera.height;
}

bool is_arm(const std::string& name) {
  return name.find("shoulder") != std::string::npos || name.find("elbow") != std::string::npos ||
         name.find("wrist") != std::string::npos;
}

bool is_leg(const std::string& name) {
  return name.ends_with("hip") || name.ends_with("knee") || name.ends_with("ankle") ||
         name.ends_with("toe") || name.ends_with("heel");
}

void swap_sides(Keypoints2d& found, const KeypointSchema& schema,
                bool (*limb)(const std::string&)) {
  for (std::size_t i = 0; i < schema.points.size(); ++i) {
    const auto mirror = static_cast<std::size_t>(schema.mirror[i]);
    if (i < mirror && limb(schema.points[i])) {
      const Eigen::RowVector3d kept = found.row(static_cast<Index>(i));
      found.row(static_cast<Index>(i)) = found.row(static_cast<Index>(mirror));
      found.row(static_cast<Index>(mirror)) = kept;
    }
  }
}

}  // namespace

OptionTable describe(DetectorOptions& options) {
  OptionTable table;
  table.add("perfect", options.perfect, "Exact projections with confidence 1")
      .add("noise", options.noise, 0, 100, "px", "Standard deviation of a visible keypoint")
      .add("dropout", options.dropout, 0, 1, "", "Fraction of visible keypoints that are missed")
      .add("swaps", options.swaps, 0, 1, "", "Fraction of images with left and right swapped")
      .add("outliers", options.outliers, 0, 1, "",
           "Fraction of keypoints that are detected elsewhere")
      .add("occluded_factor", options.occluded_factor, 1, 10, "",
           "Factor on the noise of occluded keypoints")
      .add("cloth_factor", options.cloth_factor, 1, 10, "",
           "Factor on the noise of keypoints under cloth")
      .add("cloth_bias", options.cloth_bias, 0, 1, "",
           "Bias of keypoints under loose cloth, as a fraction of the way to the cloth's centre "
           "line");
  return table;
}

Keypoints2d detected_keypoints(const Camera& camera, const KeypointSchema& schema,
                               const Points& points, const std::vector<KeypointSight>& sights,
                               const DetectorOptions& options, Random random) {
  const auto count = static_cast<Index>(schema.points.size());
  ATELIER_CHECK(points.rows() == count && static_cast<Index>(sights.size()) == count,
                "one point and one sight per keypoint of the schema");
  const double scale = camera.height / 1000.0;
  Keypoints2d found = Keypoints2d::Zero(count, 3);
  std::vector<Eigen::Vector2d> pixels;  // of points in the image, for outliers
  Keypoints2d exact = Keypoints2d::Zero(count, 3);
  for (Index i = 0; i < count; ++i) {
    const auto pixel = project(camera, points.row(i).transpose());
    if (pixel && inside(camera, *pixel)) {
      exact.row(i) << pixel->x(), pixel->y(), 1;
      pixels.push_back(*pixel);
    }
  }
  if (options.perfect) {
    return exact;
  }
  for (Index i = 0; i < count; ++i) {
    const KeypointSight& sight = sights[static_cast<std::size_t>(i)];
    // Every point draws the same number of numbers, so that one does not shift the others'.
    const double blur = std::exp(0.5 * normal(random));
    const double dx = normal(random);
    const double dy = normal(random);
    const double is_missed = uniform(random);
    const double is_outlier = uniform(random);
    const double outlier_kind = uniform(random);
    const double outlier_place = uniform(random);
    const double outlier_angle = 2 * std::numbers::pi * uniform(random);
    const double wobble = normal(random);
    const double wrong_confidence = uniform(random);
    if (exact(i, 2) == 0) {
      continue;
    }
    const double miss = sight.seen ? options.dropout : 1 - (1 - options.dropout) * 0.75;
    if (is_missed < miss) {
      continue;
    }
    double factor = blur;
    factor *= sight.seen ? 1 : options.occluded_factor;
    factor *= sight.covered ? options.cloth_factor : 1;
    const double sigma = options.noise * scale * factor / std::exp(0.25);  // so that rms is `noise`
    Eigen::Vector2d pixel(exact(i, 0), exact(i, 1));
    if (sight.covered) {
      pixel.x() += options.cloth_bias * sight.under_cloth * (sight.centre_x - pixel.x());
    }
    pixel += sigma * Eigen::Vector2d(dx, dy);
    // Confidence as heat maps have it: high where sharp, and itself uncertain.
    double confidence = 0.97 / (1 + 0.09 * factor * factor) + 0.04 * wobble;
    if (is_outlier < options.outliers) {
      if (outlier_kind < 0.5) {
        const auto other =
            saturating_cast<std::size_t>(outlier_place * static_cast<double>(pixels.size()));
        pixel = pixels[std::min(other, pixels.size() - 1)] + sigma * Eigen::Vector2d(dx, dy);
      } else {
        const double distance = scale * (25 + 220 * outlier_place);
        pixel += distance * Eigen::Vector2d(std::cos(outlier_angle), std::sin(outlier_angle));
      }
      confidence = wrong_confidence < 0.8 ? 0.08 + 0.6 * wrong_confidence : confidence;
    }
    if (inside(camera, pixel)) {
      found.row(i) << pixel.x(), pixel.y(), std::clamp(confidence, 0.05, 1.0);
    }
  }
  const double legs = uniform(random);
  const double arms = uniform(random);
  if (legs < options.swaps) {
    swap_sides(found, schema, is_leg);
  }
  if (arms < options.swaps) {
    swap_sides(found, schema, is_arm);
  }
  return found;
}

std::string keypoints_json(const Keypoints2d& keypoints) {
  nlohmann::ordered_json person;
  person["person_id"] = {-1};
  nlohmann::ordered_json& values = person["pose_keypoints_2d"] = nlohmann::ordered_json::array();
  const auto rounded = [](double value) { return std::round(value * 1000) / 1000; };
  for (Index i = 0; i < keypoints.rows(); ++i) {
    for (Index c = 0; c < 3; ++c) {
      values.push_back(rounded(keypoints(i, c)));
    }
  }
  for (const char* key : {"face_keypoints_2d", "hand_left_keypoints_2d", "hand_right_keypoints_2d",
                          "pose_keypoints_3d"}) {
    person[key] = nlohmann::ordered_json::array();
  }
  nlohmann::ordered_json root;
  root["version"] = 1.3;
  root["people"] = {person};
  return root.dump() + "\n";
}

}  // namespace atelier
