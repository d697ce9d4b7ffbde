#include "capture/detection/person_landmarks.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kRows = 39;  ///< landmarks and what steers the crop
constexpr int kValues = 5;
constexpr int kHips = 33;
constexpr int kAbove = 34;
constexpr int kHeatmap = 64;
constexpr int kReach = 3;  ///< cells beside the one of the point
constexpr double kSharp = 0.5;

double probability(double logit) {
  return 1 / (1 + std::exp(-logit));
}

const NetworkOutput& output_of_shape(const std::vector<NetworkOutput>& outputs,
                                     const std::vector<int>& shape, const std::string& file) {
  for (const NetworkOutput& output : outputs) {
    if (output.shape == shape) {
      return output;
    }
  }
  std::string text = "[1";
  for (const int side : shape) {
    text.append(",").append(std::to_string(side));
  }
  throw DataError(file, "", "no output " + text + "]",
                  "a landmark network that scripts/detector-networks writes");
}

/// A point of the crop, [0, 1], moved by its heatmap.
Eigen::Vector2d refined(const Eigen::Vector2d& point, const float* heatmap) {
  const int column = saturating_cast<int>(std::floor(point.x() * kHeatmap));
  const int row = saturating_cast<int>(std::floor(point.y() * kHeatmap));
  if (column < 0 || column >= kHeatmap || row < 0 || row >= kHeatmap) {
    return point;
  }
  double sum = 0;
  double best = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (int y = std::max(0, row - kReach); y <= std::min(kHeatmap - 1, row + kReach); ++y) {
    for (int x = std::max(0, column - kReach); x <= std::min(kHeatmap - 1, column + kReach); ++x) {
      const double weight = probability(heatmap[y * kHeatmap + x]);
      sum += weight;
      best = std::max(best, weight);
      mean += weight * Eigen::Vector2d(x, y);
    }
  }
  return best >= kSharp ? Eigen::Vector2d(mean / sum / kHeatmap) : point;
}

}  // namespace

PersonLandmarks decode_landmarks(const std::vector<NetworkOutput>& outputs, const PersonCrop& crop,
                                 const std::string& file) {
  const NetworkOutput& rows = output_of_shape(outputs, {kRows * kValues}, file);
  const NetworkOutput& presence = output_of_shape(outputs, {1}, file);
  const NetworkOutput& heatmaps = output_of_shape(outputs, {kRows, kHeatmap, kHeatmap}, file);
  const NetworkOutput& mask = output_of_shape(outputs, {1, kLandmarkInput, kLandmarkInput}, file);
  PersonLandmarks result;
  result.presence = std::clamp(static_cast<double>(presence.values[0]), 0.0, 1.0);
  result.points = DetectedPoints::Zero(kLandmarks, 3);
  Eigen::Vector2d hips, above;
  for (int k = 0; k < kRows; ++k) {
    const float* row = rows.values.data() + static_cast<std::ptrdiff_t>(k) * kValues;
    Eigen::Vector2d point(row[0] / double{kLandmarkInput}, row[1] / double{kLandmarkInput});
    point = refined(point,
                    heatmaps.values.data() + static_cast<std::ptrdiff_t>(k) * kHeatmap * kHeatmap);
    const Eigen::Vector2d pixel = from_crop(crop, point);
    if (k < kLandmarks) {
      result.points.row(k) << pixel.x(), pixel.y(), probability(row[3]);
    } else if (k == kHips) {
      hips = pixel;
    } else if (k == kAbove) {
      above = pixel;
    }
  }
  result.next = person_crop(hips, above);
  result.crop = crop;
  result.mask = ByteImage(kLandmarkInput, kLandmarkInput, 1);
  std::transform(mask.values.begin(), mask.values.end(), result.mask.data.begin(), [](float logit) {
    return saturating_cast<std::uint8_t>(255 * probability(logit) + 0.5);
  });
  return result;
}

}  // namespace atelier
