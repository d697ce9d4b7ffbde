#include "capture/detection/person_detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/error.h"

namespace atelier {
namespace {

constexpr int kAnchors = 2254;
constexpr int kBoxValues = 12;
constexpr double kSamePerson = 0.3;
constexpr double kLargestLogit = 100;

struct AnchorGrid {
  int stride;
  int anchors_per_cell;
};
constexpr std::array<AnchorGrid, 3> kGrids = {{{8, 2}, {16, 2}, {32, 6}}};

/// One box in the input's coordinates, [0, 1].
struct RawPerson {
  double score = 0;
  Eigen::Vector2d center, size, hips, above;
};

double logistic(double value) {
  return 1 / (1 + std::exp(-std::clamp(value, -kLargestLogit, kLargestLogit)));
}

double shared_area(const RawPerson& a, const RawPerson& b) {
  const Eigen::Array2d low = (a.center - a.size / 2).cwiseMax(b.center - b.size / 2).array();
  const Eigen::Array2d high = (a.center + a.size / 2).cwiseMin(b.center + b.size / 2).array();
  const double both = (high - low).max(0.0).prod();
  const double either = a.size.prod() + b.size.prod() - both;
  return either > 0 ? both / either : 0;
}

/// The mean of those that overlap with the best, by score; its score is the best's.
RawPerson merged(const std::vector<RawPerson>& same) {
  RawPerson mean;
  mean.center = mean.size = mean.hips = mean.above = Eigen::Vector2d::Zero();
  double total = 0;
  for (const RawPerson& one : same) {
    mean.center += one.score * one.center;
    mean.size += one.score * one.size;
    mean.hips += one.score * one.hips;
    mean.above += one.score * one.above;
    total += one.score;
  }
  mean.center /= total;
  mean.size /= total;
  mean.hips /= total;
  mean.above /= total;
  mean.score = same.front().score;
  return mean;
}

const NetworkOutput& output_of_size(const std::vector<NetworkOutput>& outputs, int last,
                                    const std::string& file) {
  for (const NetworkOutput& output : outputs) {
    if (output.shape == std::vector<int>{kAnchors, last}) {
      return output;
    }
  }
  throw DataError(file, "",
                  "no output [1," + std::to_string(kAnchors) + "," + std::to_string(last) + "]",
                  "the person detector that scripts/detector-networks writes");
}

}  // namespace

const Eigen::Matrix<double, Eigen::Dynamic, 2>& person_anchors() {
  static const Eigen::Matrix<double, Eigen::Dynamic, 2> anchors = [] {
    Eigen::Matrix<double, Eigen::Dynamic, 2> all(kAnchors, 2);
    Eigen::Index row = 0;
    for (const AnchorGrid& grid : kGrids) {
      const int cells = kPersonInput / grid.stride;
      for (int y = 0; y < cells; ++y) {
        for (int x = 0; x < cells; ++x) {
          for (int k = 0; k < grid.anchors_per_cell; ++k) {
            all.row(row++) << (x + 0.5) / cells, (y + 0.5) / cells;
          }
        }
      }
    }
    return all;
  }();
  return anchors;
}

std::vector<DetectedPerson> decode_people(const std::vector<NetworkOutput>& outputs,
                                          int image_width, int image_height, double threshold,
                                          const std::string& file) {
  const NetworkOutput& boxes = output_of_size(outputs, kBoxValues, file);
  const NetworkOutput& scores = output_of_size(outputs, 1, file);
  const auto& anchors = person_anchors();
  std::vector<RawPerson> found;
  for (Eigen::Index a = 0; a < kAnchors; ++a) {
    const double score = logistic(scores.values[static_cast<std::size_t>(a)]);
    if (!(score >= threshold)) {
      continue;
    }
    const float* raw = boxes.values.data() + a * kBoxValues;
    const auto pair = [&](int at) {
      return Eigen::Vector2d(raw[at] / double{kPersonInput}, raw[at + 1] / double{kPersonInput});
    };
    const Eigen::Vector2d anchor = anchors.row(a).transpose();
    found.push_back({score, anchor + pair(0), pair(2), anchor + pair(4), anchor + pair(6)});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const RawPerson& a, const RawPerson& b) { return a.score > b.score; });
  const PersonCrop whole = image_crop(image_width, image_height);
  std::vector<DetectedPerson> people;
  while (!found.empty()) {
    const RawPerson best = found.front();
    const auto others = std::stable_partition(
        found.begin(), found.end(),
        [&](const RawPerson& one) { return shared_area(best, one) > kSamePerson; });
    // A box without area overlaps with nothing, itself included.
    const auto rest = others == found.begin() ? found.begin() + 1 : others;
    const RawPerson one = merged({found.begin(), rest});
    found.erase(found.begin(), rest);
    const PersonCrop crop = person_crop(from_crop(whole, one.hips), from_crop(whole, one.above));
    if (crop.side > 0) {
      people.push_back({one.score, crop});
    }
  }
  return people;
}

}  // namespace atelier
