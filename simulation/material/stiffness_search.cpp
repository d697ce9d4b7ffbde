#include "simulation/material/stiffness_search.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.h"

namespace atelier {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Evenly spaced logarithms.
std::vector<double> grid_values(double low, double high, int count) {
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    values.push_back(low * std::pow(high / low, static_cast<double>(i) / (count - 1)));
  }
  return values;
}

/// `count` values between the neighbours of one of a grid: with 3, half a step to both sides and
/// itself.
std::vector<double> around(double middle, double ratio, int count, double low, double high) {
  std::vector<double> values;
  for (int i = 1; i <= count; ++i) {
    const double value = middle * std::pow(ratio, 2.0 * i / (count + 1) - 1);
    if (value > low * (1 - 1e-9) && value < high * (1 + 1e-9)) {
      values.push_back(value);
    }
  }
  return values;
}

/// One garment's trials, on a grid of its own.
struct Level {
  std::vector<double> stretch;
  std::vector<double> bending;
  std::vector<double> distances;  // bending by bending

  std::size_t count() const { return stretch.size() * bending.size(); }
  Stiffness at(std::size_t i) const {
    return {stretch[i % stretch.size()], bending[i / stretch.size()]};
  }
  std::size_t best() const {
    return static_cast<std::size_t>(std::min_element(distances.begin(), distances.end()) -
                                    distances.begin());
  }
};

/// Runs the levels of all garments side by side; shorter ones repeat their last trial.
void run_level(std::vector<Level>& levels, const StiffnessObjective& objective) {
  std::size_t count = 0;
  for (const Level& level : levels) {
    count = std::max(count, level.count());
  }
  std::vector<std::vector<Stiffness>> scenes(count);
  for (std::size_t n = 0; n < count; ++n) {
    for (const Level& level : levels) {
      scenes[n].push_back(level.at(std::min(n, level.count() - 1)));
    }
  }
  const std::vector<std::vector<double>> distances = objective(scenes);
  ATELIER_CHECK(distances.size() == count, "an objective gives distances of every scene");
  for (std::size_t g = 0; g < levels.size(); ++g) {
    for (std::size_t n = 0; n < levels[g].count(); ++n) {
      ATELIER_CHECK(distances[n].size() == levels.size(), "one distance for each garment");
      const double distance = distances[n][g];
      levels[g].distances.push_back(std::isfinite(distance) ? distance : kInfinity);
    }
  }
}

/// The lowest point of the paraboloid through the squared distances of trials round the best, in
/// steps of the fine grid (logarithms); those next to it count most. It stays within a step, and
/// where the best trial lies at an end of what was tried, there.
Stiffness refined_best(const std::vector<StiffnessTrial>& trials, const StiffnessTrial& best,
                       const Stiffness& step, const StiffnessSearchOptions& options) {
  constexpr double kMinCurve = 1e-3;  // of the largest: in such a direction nothing is known
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (const StiffnessTrial& trial : trials) {
    const double x = std::log(trial.stiffness.stretch / best.stiffness.stretch) / step.stretch;
    const double y = std::log(trial.stiffness.bending / best.stiffness.bending) / step.bending;
    if (!std::isfinite(trial.distance) || std::abs(x) > 2.1 || std::abs(y) > 2.1) {
      continue;
    }
    Eigen::Matrix<double, 6, 1> row;
    row << 1, x, y, x * x / 2, x * y, y * y / 2;
    const double weight = std::exp(-(x * x + y * y));
    normal += weight * row * row.transpose();
    const double more = trial.distance * trial.distance - best.distance * best.distance;
    right += weight * more * row;
  }
  const Eigen::Matrix<double, 6, 1> fit = normal.completeOrthogonalDecomposition().solve(right);
  Eigen::Matrix2d curve;
  curve << fit[3], fit[4], fit[4], fit[5];
  const auto axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>().computeDirect(curve);
  Eigen::Vector2d way = Eigen::Vector2d::Zero();
  for (int k = 0; k < 2; ++k) {
    const double value = axes.eigenvalues()[k];
    if (value > kMinCurve * axes.eigenvalues().cwiseAbs().maxCoeff() && value > 0) {
      const Eigen::Vector2d axis = axes.eigenvectors().col(k);
      way -= axis.dot(fit.segment<2>(1)) / value * axis;
    }
  }
  const auto moved = [](double value, double by, double log_step, double low, double high) {
    const bool at_end = value <= low * (1 + 1e-9) || value >= high * (1 - 1e-9);
    return at_end ? value
                  : std::clamp(value * std::exp(std::clamp(by, -1.0, 1.0) * log_step), low, high);
  };
  return {moved(best.stiffness.stretch, way.x(), step.stretch, options.stretch_low,
                options.stretch_high),
          moved(best.stiffness.bending, way.y(), step.bending, options.bending_low,
                options.bending_high)};
}

void append(std::vector<StiffnessTrial>& trials, const Level& level) {
  for (std::size_t i = 0; i < level.count(); ++i) {
    trials.push_back({level.at(i), level.distances[i]});
  }
}

/// Place of a value among increasing ones: the one before, and the share of the way to the next in
/// logarithms. False outside.
bool place_among(const std::vector<double>& values, double value, std::size_t& before,
                 double& share) {
  constexpr double kRounding = 1e-9;
  if (values.size() < 2 || value < values.front() * (1 - kRounding) ||
      value > values.back() * (1 + kRounding)) {
    return false;
  }
  before = 0;
  while (before + 2 < values.size() && values[before + 1] < value) {
    ++before;
  }
  share = std::clamp(
      std::log(value / values[before]) / std::log(values[before + 1] / values[before]), 0.0, 1.0);
  return true;
}

/// A level's distance between its trials; infinite where one of them broke, below 0 outside.
double distance_at(const Level& level, const Stiffness& at) {
  std::size_t i = 0;
  std::size_t j = 0;
  double u = 0;
  double v = 0;
  if (!place_among(level.stretch, at.stretch, i, u) ||
      !place_among(level.bending, at.bending, j, v)) {
    return -1;
  }
  const std::size_t row = level.stretch.size();
  const double* low = &level.distances[j * row + i];
  const double* high = low + row;
  for (const double corner : {low[0], low[1], high[0], high[1]}) {
    if (!std::isfinite(corner)) {
      return kInfinity;
    }
  }
  return (1 - v) * ((1 - u) * low[0] + u * low[1]) + v * ((1 - u) * high[0] + u * high[1]);
}

/// How much less usual a value is than the median: minus its squared deviation over two.
double prior_logarithm(double value, double median, double spread) {
  return spread > 0 ? -std::pow(std::log(value / median) / spread, 2) / 2 : 0;
}

/// Mean of the logarithms, and what nine in ten lie between.
void summarize(const std::vector<double>& values, const std::vector<double>& weights,
               double Stiffness::*axis, StiffnessFit& fit) {
  constexpr double kTail = 0.05;
  double total = 0;
  double mean = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    total += weights[i];
    mean += weights[i] * std::log(values[i]);
  }
  fit.expected.*axis = std::exp(mean / total);
  double below = 0;
  fit.credible_low.*axis = values.front();
  fit.credible_high.*axis = values.back();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double before = below;
    below += weights[i] / total;
    if (before < kTail && below >= kTail) {
      fit.credible_low.*axis = values[i];
    }
    if (before < 1 - kTail && below >= 1 - kTail) {
      fit.credible_high.*axis = values[i];
    }
  }
}

/// Weighs every stiffness of a fine raster over the range.
void weigh(const Level& coarse, const Level& fine, const StiffnessSearchOptions& options,
           StiffnessFit& fit) {
  constexpr int kRaster = 97;
  const std::vector<double> stretch =
      grid_values(options.stretch_low, options.stretch_high, kRaster);
  const std::vector<double> bending =
      grid_values(options.bending_low, options.bending_high, kRaster);
  const double likelihood_width = std::max(options.likelihood_width, 1e-3) * fit.distance;
  std::vector<double> of_stretch(kRaster, 0);
  std::vector<double> of_bending(kRaster, 0);
  for (std::size_t j = 0; j < kRaster; ++j) {
    for (std::size_t i = 0; i < kRaster; ++i) {
      const Stiffness at{stretch[i], bending[j]};
      double distance = distance_at(fine, at);
      distance = distance < 0 ? distance_at(coarse, at) : distance;
      if (!std::isfinite(distance)) {
        continue;
      }
      const double off = likelihood_width > 0 ? (distance - fit.distance) / likelihood_width
                         : distance > 0       ? kInfinity
                                              : 0;
      const StiffnessPrior& usual = options.prior;
      const double weight = std::exp(
          -off * off / 2 + prior_logarithm(at.stretch, usual.stretch, usual.stretch_spread) +
          prior_logarithm(at.bending, usual.bending, usual.bending_spread));
      of_stretch[i] += weight;
      of_bending[j] += weight;
    }
  }
  double total = 0;
  for (const double weight : of_stretch) {
    total += weight;
  }
  fit.expected = fit.credible_low = fit.credible_high = fit.best;
  if (total > 0) {  // else the nearest trial is a peak between broken ones
    summarize(stretch, of_stretch, &Stiffness::stretch, fit);
    summarize(bending, of_bending, &Stiffness::bending, fit);
  }
}

}  // namespace

OptionTable describe(StiffnessSearchOptions& options) {
  OptionTable table;
  table.add("stretch_low", options.stretch_low, 1, 1e6, "N/m",
            "Lower bound of the stretching stiffness");
  table.add("stretch_high", options.stretch_high, 1, 1e6, "N/m",
            "Upper bound of the stretching stiffness");
  table.add("bending_low", options.bending_low, 1e-9, 1, "N m",
            "Lower bound of the bending stiffness");
  table.add("bending_high", options.bending_high, 1e-9, 1, "N m",
            "Upper bound of the bending stiffness");
  table.add("coarse", options.coarse, 2, 32, "",
            "Number of values of each stiffness over the whole range");
  table.add("fine", options.fine, 0, 31, "",
            "Number of values of each stiffness around the best ones");
  table.add("likelihood_width", options.likelihood_width, 0, 10, "",
            "Likelihood width: relative excess over the smallest distance within which a trial is "
            "as good");
  return table;
}

std::vector<StiffnessFit> search_stiffness(int garments, const StiffnessObjective& objective,
                                           const StiffnessSearchOptions& options) {
  ATELIER_CHECK(garments > 0 && options.coarse >= 2 && options.fine >= 0 &&
                    options.likelihood_width >= 0 && options.stretch_low > 0 &&
                    options.stretch_low < options.stretch_high && options.bending_low > 0 &&
                    options.bending_low < options.bending_high &&
                    (options.prior.stretch_spread == 0 ||
                     (options.prior.stretch_spread > 0 && options.prior.stretch > 0)) &&
                    (options.prior.bending_spread == 0 ||
                     (options.prior.bending_spread > 0 && options.prior.bending > 0)),
                "stiffness search options out of range");
  Level all;
  all.stretch = grid_values(options.stretch_low, options.stretch_high, options.coarse);
  all.bending = grid_values(options.bending_low, options.bending_high, options.coarse);
  std::vector<Level> coarse(static_cast<std::size_t>(garments), all);
  run_level(coarse, objective);
  std::vector<Level> fine;
  for (std::size_t g = 0; g < coarse.size(); ++g) {
    const std::size_t best = coarse[g].best();
    if (!std::isfinite(coarse[g].distances[best])) {
      throw DataError("", "garment " + std::to_string(g), "no stiffness at which it holds together",
                      "a garment that can be simulated on this body; other ranges of stiffness, "
                      "or more substeps");
    }
    const Stiffness middle = coarse[g].at(best);
    Level level;
    level.stretch = around(middle.stretch, all.stretch[1] / all.stretch[0], options.fine,
                           options.stretch_low, options.stretch_high);
    level.bending = around(middle.bending, all.bending[1] / all.bending[0], options.fine,
                           options.bending_low, options.bending_high);
    fine.push_back(std::move(level));
  }
  if (options.fine > 0) {
    run_level(fine, objective);
  }
  std::vector<StiffnessFit> fits;
  for (std::size_t g = 0; g < coarse.size(); ++g) {
    StiffnessFit fit;
    append(fit.trials, coarse[g]);
    append(fit.trials, fine[g]);
    const StiffnessTrial& nearest = nearest_trial(fit.trials);
    const double steps = std::max(1.0, (options.fine + 1) / 2.0);  // of the fine grid in a coarse
    fit.best = refined_best(fit.trials, nearest,
                            {std::log(all.stretch[1] / all.stretch[0]) / steps,
                             std::log(all.bending[1] / all.bending[0]) / steps},
                            options);
    fit.distance = nearest.distance;
    fit.stretch = range_within(fit.trials, options.likelihood_width, &Stiffness::stretch);
    fit.bending = range_within(fit.trials, options.likelihood_width, &Stiffness::bending);
    weigh(coarse[g], fine[g], options, fit);
    fits.push_back(std::move(fit));
  }
  return fits;
}

}  // namespace atelier
