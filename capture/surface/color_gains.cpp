#include "capture/surface/color_gains.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "capture/surface/gloss_free_gains.h"
#include "core/error.h"
#include "core/median.h"

namespace atelier {
namespace {

/// One usable sample.
struct LogSample {
  int camera = 0;
  Eigen::Vector3d value;
  double weight = 1;
};

/// The samples of one place by several cameras.
using Place = std::vector<LogSample>;

/// Cameras that hang together through places that both see, numbered by group; -1: none.
std::vector<int> groups_of(int cameras, const std::vector<Place>& places) {
  std::vector<int> group(static_cast<std::size_t>(cameras));
  for (int c = 0; c < cameras; ++c) {
    group[static_cast<std::size_t>(c)] = c;
  }
  const auto root = [&](int c) {
    while (group[static_cast<std::size_t>(c)] != c) {
      c = group[static_cast<std::size_t>(c)];
    }
    return c;
  };
  for (const auto& place : places) {
    for (const LogSample& sample : place) {
      const int a = root(place.front().camera);
      const int b = root(sample.camera);
      group[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  for (int c = 0; c < cameras; ++c) {
    group[static_cast<std::size_t>(c)] = root(c);
  }
  return group;
}

/// Samples between darkest and brightest, by place.
std::map<int, std::vector<LogSample>> usable_samples(int cameras,
                                                     const std::vector<ColorSample>& samples,
                                                     const ColorGainOptions& options) {
  std::map<int, std::vector<LogSample>> by_point;
  for (const ColorSample& sample : samples) {
    ATELIER_CHECK(sample.camera >= 0 && sample.camera < cameras && sample.weight > 0,
                  "a sample of a camera that is not there, or without weight");
    if (sample.color.allFinite() && sample.color.minCoeff() > std::max(options.darkest, 1e-6) &&
        sample.color.maxCoeff() < options.brightest) {
      by_point[sample.point].push_back(
          {sample.camera, sample.color.array().log().matrix(), sample.weight});
    }
  }
  return by_point;
}

/// Places that several of the cameras see which are not left out.
std::vector<Place> shared_places(const std::map<int, std::vector<LogSample>>& by_point,
                                 const std::set<int>& left_out) {
  std::vector<Place> places;
  for (const auto& [point, all] : by_point) {
    Place place;
    std::set<int> seen;
    for (const LogSample& sample : all) {
      if (!left_out.contains(sample.camera)) {
        place.push_back(sample);
        seen.insert(sample.camera);
      }
    }
    if (seen.size() > 1) {
      places.push_back(std::move(place));
    }
  }
  return places;
}

/// Places shared by cameras with enough of them, and the cameras without.
struct SharedPlaces {
  std::vector<Place> places;
  std::set<int> left_out;
};

/// Leaves out cameras that share too few places, until no other is among the rest. Counts places in
/// `result` and says there what was left out. Throws DataError if no camera remains.
SharedPlaces leave_out_lonely_cameras(int cameras,
                                      const std::map<int, std::vector<LogSample>>& by_point,
                                      int min_points, ColorGains& result) {
  SharedPlaces shared;
  for (;;) {
    shared.places = shared_places(by_point, shared.left_out);
    std::fill(result.points.begin(), result.points.end(), 0);
    for (const Place& place : shared.places) {
      for (const LogSample& sample : place) {
        result.points[static_cast<std::size_t>(sample.camera)] += 1;
      }
    }
    const std::size_t before = shared.left_out.size();
    for (int c = 0; c < cameras; ++c) {
      if (!shared.left_out.contains(c) && result.points[static_cast<std::size_t>(c)] < min_points) {
        shared.left_out.insert(c);
        result.findings.push_back({Severity::Warning, "color-few-points", std::to_string(c),
                                   std::to_string(result.points[static_cast<std::size_t>(c)]) +
                                       " places that other cameras see too, " +
                                       std::to_string(min_points) + " are needed",
                                   "its gain stays 1; more frames give more places, and its "
                                   "images must overlap with others'"});
      }
    }
    if (shared.left_out.size() == before) {
      break;
    }
  }
  if (shared.left_out.size() == static_cast<std::size_t>(cameras)) {
    throw DataError("", "samples",
                    "no two cameras that share " + std::to_string(min_points) + " places",
                    "more frames, or cameras whose views overlap");
  }
  return shared;
}

/// The unknown of each camera of the largest connected group, counted from 0; -1 for the others,
/// which `result` then names.
std::vector<int> columns_of(int cameras, const SharedPlaces& shared, ColorGains& result) {
  const std::vector<int> groups = groups_of(cameras, shared.places);
  std::map<int, int> sizes;
  for (int c = 0; c < cameras; ++c) {
    sizes[groups[static_cast<std::size_t>(c)]] += shared.left_out.contains(c) ? 0 : 1;
  }
  const int main_group =
      std::max_element(sizes.begin(), sizes.end(), [](const auto& a, const auto& b) {
        return a.second < b.second;
      })->first;
  std::vector<int> column(static_cast<std::size_t>(cameras), -1);
  int columns = 0;
  for (int c = 0; c < cameras; ++c) {
    const auto i = static_cast<std::size_t>(c);
    if (shared.left_out.contains(c)) {
      continue;
    }
    if (groups[i] != main_group) {
      result.findings.push_back({Severity::Warning, "color-unconnected", std::to_string(c),
                                 "it shares no places with the largest group of cameras",
                                 "its gain stays 1"});
      continue;
    }
    column[i] = columns++;
    result.measured[i] = true;
  }
  return column;
}

/// The samples of one place by the cameras of the group, with its unknowns.
std::vector<std::vector<ColorSample>> connected_places(const std::vector<Place>& places,
                                                       const std::vector<int>& column) {
  std::vector<std::vector<ColorSample>> connected;
  for (const Place& place : places) {
    if (column[static_cast<std::size_t>(place.front().camera)] < 0) {
      continue;
    }
    std::vector<ColorSample>& samples_of_place = connected.emplace_back();
    for (const LogSample& sample : place) {
      samples_of_place.push_back({column[static_cast<std::size_t>(sample.camera)], 0,
                                  sample.value.array().exp(), sample.weight});
    }
  }
  return connected;
}

/// Normal equations of the log gains of one channel, reweighted about the last solution.
struct GainEquations {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
  std::vector<double> residuals;  ///< of each sample from the middle of its place
};

/// @param scale  deviation of a sample from its place, by which Cauchy's weights fall
GainEquations gain_equations(const std::vector<Place>& places, const std::vector<int>& column,
                             int channel, const Eigen::VectorXd& solution, double scale) {
  const Eigen::Index columns = solution.size();
  // Schur complement over the places: each contributes w_i w_j / sum w.
  GainEquations equations{
      Eigen::MatrixXd::Zero(columns, columns), Eigen::VectorXd::Zero(columns), {}};
  std::vector<double> values;
  std::vector<double> weights;
  for (const Place& place : places) {
    if (column[static_cast<std::size_t>(place.front().camera)] < 0) {
      continue;
    }
    values.clear();
    for (const LogSample& sample : place) {
      values.push_back(sample.value[channel] -
                       solution[column[static_cast<std::size_t>(sample.camera)]]);
    }
    // Of two samples the mean is all there is; of more the median is not pulled by one.
    const double middle =
        place.size() > 2 ? median(values) : 0.5 * (values.front() + values.back());
    weights.clear();
    double sum = 0;
    double mean = 0;
    for (std::size_t i = 0; i < place.size(); ++i) {
      const double off = (values[i] - middle) / (2.4 * scale);
      equations.residuals.push_back(std::abs(values[i] - middle));
      weights.push_back(place[i].weight / (1 + off * off));
      sum += weights[i];
      mean += weights[i] * place[i].value[channel];
    }
    mean /= sum;
    for (std::size_t i = 0; i < place.size(); ++i) {
      const int a = column[static_cast<std::size_t>(place[i].camera)];
      equations.normal(a, a) += weights[i];
      equations.right[a] += weights[i] * (place[i].value[channel] - mean);
      for (std::size_t j = 0; j < place.size(); ++j) {
        equations.normal(a, column[static_cast<std::size_t>(place[j].camera)]) -=
            weights[i] * weights[j] / sum;
      }
    }
  }
  return equations;
}

/// Log gains of one channel.
struct ChannelGains {
  Eigen::VectorXd log_gain;   ///< of each unknown; mean 0
  Eigen::VectorXd deviation;  ///< of each unknown
  double spread = 0;          ///< deviation of one sample from its place
};

/// Iterated reweighted least squares.
ChannelGains solve_channel(const std::vector<Place>& places, const std::vector<int>& column,
                           int columns, int channel) {
  ChannelGains gains{Eigen::VectorXd::Zero(columns), Eigen::VectorXd::Zero(columns)};
  double scale = 0.1;
  constexpr int kRounds = 30;
  for (int round = 0; round < kRounds; ++round) {
    GainEquations equations = gain_equations(places, column, channel, gains.log_gain, scale);
    // The gauge: a weak pull of the mean to 0 makes it exactly 0, since nothing opposes it.
    equations.normal.array() += equations.normal.trace() / columns;
    const Eigen::LDLT<Eigen::MatrixXd> factor(equations.normal);
    const Eigen::VectorXd next = factor.solve(equations.right);
    const double moved = (next - gains.log_gain).cwiseAbs().maxCoeff();
    gains.log_gain = next;
    scale = std::max(1.4826 * median(equations.residuals), 1e-4);
    if (moved < 1e-9 || round + 1 == kRounds) {
      // Without the gauge's own part.
      const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd::Identity(columns, columns));
      gains.deviation = scale * inverse.diagonal().cwiseMax(0).cwiseSqrt();
      gains.spread = scale;
      break;
    }
  }
  gains.log_gain.array() -= gains.log_gain.mean();
  return gains;
}

}  // namespace

OptionTable describe(ColorGainOptions& options) {
  OptionTable table;
  table.add("darkest", options.darkest, 0, 1, "",
            "Minimum linear value of a sample; below it noise dominates");
  table.add("brightest", options.brightest, 0, 1, "",
            "Maximum linear value of a sample; above it samples may be clipped");
  table.add(
      "min_points", options.min_points, 1, 1e6, "",
      "Minimum number of points that a camera shares with others; with fewer its gain stays 1");
  return table;
}

ColorGains color_gains(int cameras, const std::vector<ColorSample>& samples,
                       const ColorGainOptions& options) {
  ColorGains result;
  const auto count = static_cast<std::size_t>(cameras);
  result.gain.assign(count, Eigen::Vector3d::Ones());
  result.deviation.assign(count, Eigen::Vector3d::Zero());
  result.points.assign(count, 0);
  result.measured.assign(count, false);
  const SharedPlaces shared = leave_out_lonely_cameras(
      cameras, usable_samples(cameras, samples, options), options.min_points, result);
  const std::vector<int> column = columns_of(cameras, shared, result);
  const auto columns =
      static_cast<int>(std::count(result.measured.begin(), result.measured.end(), true));

  Eigen::MatrixXd log_gain = Eigen::MatrixXd::Zero(columns, 3);
  Eigen::MatrixXd deviation = Eigen::MatrixXd::Zero(columns, 3);
  std::vector<double> spreads;
  for (int channel = 0; channel < 3; ++channel) {
    const ChannelGains gains = solve_channel(shared.places, column, columns, channel);
    log_gain.col(channel) = gains.log_gain;
    deviation.col(channel) = gains.deviation;
    spreads.push_back(gains.spread);
  }
  const MeasuredGains found = gloss_free_gains(connected_places(shared.places, column),
                                               {log_gain.array().exp().matrix(), deviation});
  for (std::size_t c = 0; c < count; ++c) {
    if (column[c] >= 0) {
      result.gain[c] = found.gain.row(column[c]).transpose();
      result.deviation[c] = found.deviation.row(column[c]).transpose();
    }
  }
  result.spread = median(spreads);
  return result;
}

GainError gain_error(const std::vector<Camera>& cameras, const std::vector<Camera>& truth) {
  std::vector<Eigen::Array3d> logs;
  Eigen::Array3d middle = Eigen::Array3d::Zero();
  for (const Camera& camera : cameras) {
    const auto same = std::find_if(truth.begin(), truth.end(),
                                   [&](const Camera& other) { return other.id == camera.id; });
    if (same == truth.end()) {
      throw DataError("the cameras", "camera '" + camera.id + "'", "not in the ground truth",
                      "the cameras of the capture");
    }
    if (!(camera.gain.minCoeff() > 0 && same->gain.minCoeff() > 0)) {
      throw DataError("the cameras", "camera '" + camera.id + "'", "a gain that is none",
                      "gains above 0");
    }
    logs.emplace_back((camera.gain.array() / same->gain.array()).log());
    middle += logs.back();
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, logs.size()));
  middle /= count;
  GainError error;
  for (const Eigen::Array3d& log : logs) {
    error.mean += (log - middle).abs().mean() / count;
    error.largest = std::max(error.largest, (log - middle).abs().maxCoeff());
  }
  return error;
}

}  // namespace atelier
