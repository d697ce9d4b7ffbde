#include "capture/detection/decode.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

std::string shape_of(const NetworkOutput& output) {
  std::string text = "[1";
  for (const int side : output.shape) {
    text += "," + std::to_string(side);
  }
  return text + "]";
}

[[noreturn]] void refuse(const NetworkOutput& output, const std::string& expected,
                         const std::string& file) {
  throw DataError(file, "output '" + output.name + "'", "shape " + shape_of(output), expected);
}

void check_values(const NetworkOutput& output) {
  std::size_t total = 1;
  for (const int side : output.shape) {
    total *= static_cast<std::size_t>(std::max(side, 0));
  }
  ATELIER_CHECK(total == output.values.size(), "as many values as the shape says");
}

struct Map {
  const float* values;
  int width;
  int height;

  float at(int x, int y) const {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

Map map_of(const NetworkOutput& output, int number) {
  const int height = output.shape[1];
  const int width = output.shape[2];
  return {output.values.data() + static_cast<std::size_t>(number) *
                                     static_cast<std::size_t>(width) *
                                     static_cast<std::size_t>(height),
          width, height};
}

/// Where between three equally spaced values the parabola through them has its top, in [-0.5, 0.5].
double top_of(double before, double middle, double after) {
  const double bend = before - 2 * middle + after;
  return bend < -1e-12 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

Eigen::RowVector3d peak(const Map& map, int x, int y, int input_width, int input_height) {
  double px = x;
  double py = y;
  if (x > 0 && x + 1 < map.width) {
    px += top_of(map.at(x - 1, y), map.at(x, y), map.at(x + 1, y));
  }
  if (y > 0 && y + 1 < map.height) {
    py += top_of(map.at(x, y - 1), map.at(x, y), map.at(x, y + 1));
  }
  return {(px + 0.5) * input_width / map.width, (py + 0.5) * input_height / map.height,
          std::clamp(static_cast<double>(map.at(x, y)), 0.0, 1.0)};
}

/// COCO limbs of OpenPose and where their fields begin (doc/02_output.md and its sample programs).
struct Limb {
  int from;
  int to;
  int field;  ///< of x; y follows
};
constexpr std::array<Limb, 17> kLimbs = {{{1, 2, 31},
                                          {1, 5, 39},
                                          {2, 3, 33},
                                          {3, 4, 35},
                                          {5, 6, 41},
                                          {6, 7, 43},
                                          {1, 8, 19},
                                          {8, 9, 21},
                                          {9, 10, 23},
                                          {1, 11, 25},
                                          {11, 12, 27},
                                          {12, 13, 29},
                                          {1, 0, 47},
                                          {0, 14, 49},
                                          {14, 16, 53},
                                          {0, 15, 51},
                                          {15, 17, 55}}};

struct Candidate {
  int x;
  int y;
  float value;
};

std::vector<Candidate> maxima(const Map& map, double threshold) {
  constexpr std::size_t kMost = 40;  // people; a map of noise has thousands
  std::vector<Candidate> all;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const float value = map.at(x, y);
      bool largest = value > static_cast<float>(threshold);
      for (int dy = -1; dy <= 1 && largest; ++dy) {
        for (int dx = -1; dx <= 1 && largest; ++dx) {
          const int nx = x + dx;
          const int ny = y + dy;
          if ((dx == 0 && dy == 0) || nx < 0 || ny < 0 || nx >= map.width || ny >= map.height) {
            continue;
          }
          const bool before = dy < 0 || (dy == 0 && dx < 0);
          largest = before ? value > map.at(nx, ny) : value >= map.at(nx, ny);
        }
      }
      if (largest) {
        all.push_back({x, y, value});
      }
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Candidate& a, const Candidate& b) { return a.value > b.value; });
  all.resize(std::min(all.size(), kMost), Candidate{0, 0, 0});
  return all;
}

/// Mean of the field along the line between two points; negative where it points elsewhere.
double affinity(const Map& fx, const Map& fy, const Candidate& a, const Candidate& b) {
  const double dx = b.x - a.x;
  const double dy = b.y - a.y;
  const double length = std::hypot(dx, dy);
  if (length < 1e-9) {
    return -1;
  }
  constexpr int kSteps = 10;
  double sum = 0;
  int agreeing = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double t = i / (kSteps - 1.0);
    const int x = saturating_cast<int>(std::round(a.x + t * dx));
    const int y = saturating_cast<int>(std::round(a.y + t * dy));
    const double along = (fx.at(x, y) * dx + fy.at(x, y) * dy) / length;
    sum += along;
    agreeing += along > 0.05 ? 1 : 0;
  }
  return agreeing >= 0.8 * kSteps ? sum / kSteps : -1;
}

}  // namespace

DetectedPoints decode_heatmaps(const NetworkOutput& heatmaps, int points, int input_width,
                               int input_height, const std::string& file) {
  check_values(heatmaps);
  if (heatmaps.shape.size() != 3 || heatmaps.shape[0] < points || heatmaps.shape[1] < 2 ||
      heatmaps.shape[2] < 2) {
    refuse(heatmaps, "heatmaps [1," + std::to_string(points) + " or more,h,w]", file);
  }
  DetectedPoints result(points, 3);
  for (int k = 0; k < points; ++k) {
    const Map map = map_of(heatmaps, k);
    const auto size = static_cast<std::ptrdiff_t>(map.width) * map.height;
    const int at = static_cast<int>(std::max_element(map.values, map.values + size) - map.values);
    result.row(k) = peak(map, at % map.width, at / map.width, input_width, input_height);
  }
  return result;
}

DetectedPoints decode_simcc(const NetworkOutput& x, const NetworkOutput& y, int input_width,
                            int input_height, const std::string& file) {
  check_values(x);
  check_values(y);
  if (x.shape.size() != 2 || x.shape[0] < 1 || x.shape[1] < input_width ||
      x.shape[1] % input_width != 0) {
    refuse(x, "SimCC rows [1,K,n x " + std::to_string(input_width) + "]", file);
  }
  if (y.shape.size() != 2 || y.shape[0] != x.shape[0] || y.shape[1] < input_height ||
      y.shape[1] % input_height != 0) {
    refuse(y,
           "SimCC rows [1," + std::to_string(x.shape[0]) + ",n x " + std::to_string(input_height) +
               "]",
           file);
  }
  DetectedPoints result(x.shape[0], 3);
  const auto best = [](const NetworkOutput& rows, int k, int input) {
    const int count = rows.shape[1];
    const float* row =
        rows.values.data() + static_cast<std::size_t>(k) * static_cast<std::size_t>(count);
    const float* top = std::max_element(row, row + count);
    return std::pair<double, double>((static_cast<double>(top - row) + 0.5) * input / count, *top);
  };
  for (int k = 0; k < x.shape[0]; ++k) {
    const auto [px, cx] = best(x, k, input_width);
    const auto [py, cy] = best(y, k, input_height);
    result.row(k) << px, py, std::clamp(std::min(cx, cy), 0.0, 1.0);
  }
  return result;
}

std::vector<DetectedPoints> decode_openpose_people(const NetworkOutput& output, int input_width,
                                                   int input_height, double threshold,
                                                   const std::string& file) {
  check_values(output);
  constexpr int kPoints = 18;
  constexpr int kMaps = 57;
  if (output.shape.size() != 3 || output.shape[0] != kMaps || output.shape[1] < 2 ||
      output.shape[2] < 2) {
    refuse(output, "OpenPose's COCO maps [1,57,h,w]", file);
  }
  std::array<std::vector<Candidate>, kPoints> found;
  for (int k = 0; k < kPoints; ++k) {
    found[static_cast<std::size_t>(k)] = maxima(map_of(output, k), threshold);
  }
  // People as candidates' numbers, -1: none.
  std::vector<std::array<int, kPoints>> people;
  for (const Limb& limb : kLimbs) {
    const auto from = static_cast<std::size_t>(limb.from);
    const auto to = static_cast<std::size_t>(limb.to);
    struct Link {
      double score;
      int a;
      int b;
    };
    std::vector<Link> links;
    for (std::size_t a = 0; a < found[from].size(); ++a) {
      for (std::size_t b = 0; b < found[to].size(); ++b) {
        const double score = affinity(map_of(output, limb.field), map_of(output, limb.field + 1),
                                      found[from][a], found[to][b]);
        if (score > 0) {
          links.push_back({score, static_cast<int>(a), static_cast<int>(b)});
        }
      }
    }
    std::stable_sort(links.begin(), links.end(),
                     [](const Link& a, const Link& b) { return a.score > b.score; });
    std::vector<bool> used_a(found[from].size(), false);
    std::vector<bool> used_b(found[to].size(), false);
    for (const Link& link : links) {
      if (used_a[static_cast<std::size_t>(link.a)] || used_b[static_cast<std::size_t>(link.b)]) {
        continue;
      }
      used_a[static_cast<std::size_t>(link.a)] = true;
      used_b[static_cast<std::size_t>(link.b)] = true;
      const auto owner = [&](std::size_t point, int number) {
        const auto at = std::find_if(people.begin(), people.end(),
                                     [&](const auto& p) { return p[point] == number; });
        return at - people.begin();
      };
      const auto nobody = static_cast<std::ptrdiff_t>(people.size());
      std::ptrdiff_t person = owner(from, link.a);
      const std::ptrdiff_t other = owner(to, link.b);
      if (person != nobody && other != nobody && person != other) {
        continue;  // the limb joins two people: one of them is wrong, and neither is changed
      }
      if (person == nobody) {
        person = other;
      }
      if (person == nobody) {
        people.emplace_back();
        people.back().fill(-1);
      }
      auto& joints = people[static_cast<std::size_t>(person)];
      joints[from] = joints[from] < 0 ? link.a : joints[from];
      joints[to] = joints[to] < 0 ? link.b : joints[to];
    }
  }
  std::vector<DetectedPoints> result;
  constexpr int kMinPoints = 4;  // fewer are a pattern on a wall
  for (const auto& person : people) {
    if (std::count_if(person.begin(), person.end(), [](int n) { return n >= 0; }) < kMinPoints) {
      continue;
    }
    DetectedPoints points = DetectedPoints::Zero(kPoints, 3);
    for (int k = 0; k < kPoints; ++k) {
      const int number = person[static_cast<std::size_t>(k)];
      if (number >= 0) {
        const Candidate& one = found[static_cast<std::size_t>(k)][static_cast<std::size_t>(number)];
        points.row(k) = peak(map_of(output, k), one.x, one.y, input_width, input_height);
      }
    }
    result.push_back(points);
  }
  return result;
}

ByteImage decode_parsing(const NetworkOutput& logits, int width, int height,
                         const std::string& file) {
  check_values(logits);
  if (logits.shape.size() != 3 || logits.shape[0] < 2 || logits.shape[0] > 250 ||
      logits.shape[1] < 1 || logits.shape[2] < 1) {
    refuse(logits, "logits [1,2 to 250 classes,h,w]", file);
  }
  ByteImage labels(width, height, 1);
  const int classes = logits.shape[0];
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Map first = map_of(logits, 0);
      const double fx = std::clamp((x + 0.5) * first.width / width - 0.5, 0.0, first.width - 1.0);
      const double fy =
          std::clamp((y + 0.5) * first.height / height - 0.5, 0.0, first.height - 1.0);
      const int x0 = saturating_cast<int>(fx);
      const int y0 = saturating_cast<int>(fy);
      const int x1 = std::min(x0 + 1, first.width - 1);
      const int y1 = std::min(y0 + 1, first.height - 1);
      int best = 0;
      double most = 0;
      for (int c = 0; c < classes; ++c) {
        const Map map = map_of(logits, c);
        const double value =
            (1 - (fy - y0)) * ((1 - (fx - x0)) * map.at(x0, y0) + (fx - x0) * map.at(x1, y0)) +
            (fy - y0) * ((1 - (fx - x0)) * map.at(x0, y1) + (fx - x0) * map.at(x1, y1));
        if (c == 0 || value > most) {
          most = value;
          best = c;
        }
      }
      labels.at(x, y) = static_cast<std::uint8_t>(best);
    }
  }
  return labels;
}

}  // namespace atelier
