#include "registration/outlines/fit_runs.h"

#include <Eigen/QR>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/cross.h"
#include "core/error.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;

constexpr double kWorst = std::numeric_limits<double>::infinity();
constexpr double kKink = 0.03;  // rad that an edge may turn away from the one before it

double angle_between(const Vector2& a, const Vector2& b) {
  return std::abs(std::atan2(cross(a, b), a.dot(b)));
}

std::vector<double> lengths_along(const Points2& run) {
  std::vector<double> at(static_cast<std::size_t>(run.rows()), 0);
  for (std::size_t i = 1; i < at.size(); ++i) {
    const auto row = static_cast<Index>(i);
    at[i] = at[i - 1] + (run.row(row) - run.row(row - 1)).norm();
  }
  return at;
}

Points2 smoothed_run(const Points2& run, const std::vector<std::size_t>& corners, double reach) {
  Points2 smooth = run;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const auto from = static_cast<Index>(corners[i]);
    const Index count = static_cast<Index>(corners[i + 1]) - from + 1;
    smooth.middleRows(from, count) = smoothed_points(run.middleRows(from, count), reach);
  }
  return smooth;
}

/// Directions in which an edge begins and ends, where it goes on from another.
struct EndDirections {
  std::optional<Vector2> first, last;
};

/// An edge and how far it is off its points at most.
struct EdgeFit {
  PanelEdge edge;
  double off = kWorst;
  Index farthest = 0;  ///< point
};

bool keeps_directions(const EndDirections& wanted, const Vector2& first, const Vector2& last) {
  return (!wanted.first || angle_between(*wanted.first, first) < kKink) &&
         (!wanted.last || angle_between(*wanted.last, last) < kKink);
}

template <typename Distance>
EdgeFit judged(PanelEdge edge, const Points2& part, const Distance& distance) {
  EdgeFit fit{std::move(edge), 0, part.rows() / 2};
  for (Index i = 1; i + 1 < part.rows(); ++i) {
    const double off = distance(Vector2(part.row(i)));
    if (off > fit.off) {
      fit.off = off;
      fit.farthest = i;
    }
  }
  return fit;
}

EdgeFit fit_line(const Points2& part, const EndDirections& directions) {
  const Vector2 start = part.row(0);
  const Vector2 chord = Vector2(part.row(part.rows() - 1)) - start;
  if (!(chord.norm() > 0) || !keeps_directions(directions, chord, chord)) {
    return {};
  }
  return judged({}, part, [&](const Vector2& point) {
    const double t = std::clamp((point - start).dot(chord) / chord.squaredNorm(), 0.0, 1.0);
    return (point - start - t * chord).norm();
  });
}

EdgeFit fit_arc(const Points2& part, const EndDirections& directions) {
  const Vector2 start = part.row(0);
  const Vector2 chord = Vector2(part.row(part.rows() - 1)) - start;
  const double length = chord.norm();
  if (!(length > 0) || part.rows() < 4) {
    return {};
  }
  double sagitta = 0;  // to the right of the chord
  for (Index i = 1; i + 1 < part.rows(); ++i) {
    const double off = -cross(chord, Vector2(part.row(i)) - start) / length;
    sagitta = std::abs(off) > std::abs(sagitta) ? off : sagitta;
  }
  const double about = 2 * sagitta / length;
  if (!(std::abs(about) > 1e-6) || std::abs(about) > 1) {  // more than a semicircle is two edges
    return {};
  }
  const Vector2 left(-chord.y(), chord.x());
  const auto center_of = [&](double bulge) -> Vector2 {
    return start + chord / 2 + (1 - bulge * bulge) / (4 * bulge) * left;
  };
  const auto squares = [&](double bulge) {
    const Vector2 center = center_of(bulge);
    const double radius = (start - center).norm();
    double sum = 0;
    for (Index i = 1; i + 1 < part.rows(); ++i) {
      sum += std::pow((Vector2(part.row(i)) - center).norm() - radius, 2);
    }
    return sum;
  };
  double low = 0.5 * about;
  double high = 1.5 * about;
  for (int i = 0; i < 40; ++i) {
    const double third = (high - low) / 3;
    (squares(low + third) < squares(high - third) ? high : low) =
        squares(low + third) < squares(high - third) ? high - third : low + third;
  }
  PanelEdge edge;
  edge.bulge = (low + high) / 2;
  const double half = 2 * std::atan(edge.bulge);  // between chord and tangents
  const auto turned = [&](double angle) -> Vector2 {
    return std::cos(angle) * chord + std::sin(angle) * left;
  };
  if (!keeps_directions(directions, turned(-half), turned(half))) {
    return {};
  }
  const Vector2 center = center_of(edge.bulge);
  const double radius = (start - center).norm();
  return judged(edge, part,
                [&](const Vector2& point) { return std::abs((point - center).norm() - radius); });
}

struct Cubic {
  std::array<Vector2, 4> points;
  Vector2 at(double t) const {
    const double s = 1 - t;
    return s * s * s * points[0] + 3 * s * s * t * points[1] + 3 * s * t * t * points[2] +
           t * t * t * points[3];
  }
  Vector2 slope(double t) const {
    const double s = 1 - t;
    return 3 * (s * s * (points[1] - points[0]) + 2 * s * t * (points[2] - points[1]) +
                t * t * (points[3] - points[2]));
  }
  Vector2 bend(double t) const {
    return 6 * ((1 - t) * (points[2] - 2 * points[1] + points[0]) +
                t * (points[3] - 2 * points[2] + points[1]));
  }
};

/// Inner control points by least squares for given parameters; with a direction, a length along it.
std::optional<Cubic> solved_cubic(const Points2& part, const std::vector<double>& at,
                                  const EndDirections& directions) {
  const Index rows = 2 * part.rows();
  const Index first = directions.first ? 1 : 2;
  const Index unknowns = first + (directions.last ? 1 : 2);
  Cubic cubic;
  cubic.points[0] = part.row(0);
  cubic.points[3] = part.row(part.rows() - 1);
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(rows, unknowns);
  Eigen::VectorXd right(rows);
  for (Index i = 0; i < part.rows(); ++i) {
    const double t = at[static_cast<std::size_t>(i)];
    const double s = 1 - t;
    const double near_first = 3 * s * s * t;
    const double near_last = 3 * s * t * t;
    // Unknowns are offsets from the ends.
    right.segment<2>(2 * i) = Vector2(part.row(i)) - (s * s * s + near_first) * cubic.points[0] -
                              (t * t * t + near_last) * cubic.points[3];
    if (directions.first) {
      system.block<2, 1>(2 * i, 0) = near_first * *directions.first;
    } else {
      system.block<2, 2>(2 * i, 0) = near_first * Eigen::Matrix2d::Identity();
    }
    if (directions.last) {
      system.block<2, 1>(2 * i, first) = -near_last * *directions.last;
    } else {
      system.block<2, 2>(2 * i, first) = near_last * Eigen::Matrix2d::Identity();
    }
  }
  const Eigen::VectorXd found = system.colPivHouseholderQr().solve(right);
  if (!found.allFinite() || (directions.first && !(found[0] > 0)) ||
      (directions.last && !(found[first] > 0))) {
    return std::nullopt;
  }
  cubic.points[1] = cubic.points[0] + (directions.first ? Vector2(found[0] * *directions.first)
                                                        : Vector2(found.head<2>()));
  cubic.points[2] = cubic.points[3] + (directions.last ? Vector2(-found[first] * *directions.last)
                                                       : Vector2(found.tail<2>()));
  return cubic;
}

EdgeFit fit_cubic(const Points2& part, const EndDirections& directions) {
  constexpr int kRounds = 6;
  std::vector<double> at = lengths_along(part);
  const double length = at.back();
  for (double& t : at) {
    t /= length;
  }
  std::optional<Cubic> cubic;
  for (int round = 0; round < kRounds; ++round) {
    cubic = solved_cubic(part, at, directions);
    if (!cubic) {
      return {};
    }
    for (std::size_t i = 1; i + 1 < at.size(); ++i) {
      const Vector2 off = cubic->at(at[i]) - Vector2(part.row(static_cast<Index>(i)));
      const Vector2 slope = cubic->slope(at[i]);
      const double curvature = slope.squaredNorm() + off.dot(cubic->bend(at[i]));
      if (curvature > 0) {
        at[i] = std::clamp(at[i] - off.dot(slope) / curvature, 0.0, 1.0);
      }
    }
  }
  // Handles as long as the curve make loops and spikes between the points.
  const Vector2 first = cubic->points[1] - cubic->points[0];
  const Vector2 last = cubic->points[2] - cubic->points[3];
  if (std::max(first.norm(), last.norm()) > 0.9 * length) {
    return {};
  }
  PanelEdge edge;
  edge.controls = {cubic->points[1], cubic->points[2]};
  EdgeFit fit{edge, 0, part.rows() / 2};
  for (Index i = 1; i + 1 < part.rows(); ++i) {
    const double off = (cubic->at(at[static_cast<std::size_t>(i)]) - Vector2(part.row(i))).norm();
    if (off > fit.off) {
      fit.off = off;
      fit.farthest = i;
    }
  }
  return fit;
}

EdgeFit fit_simplest(const Points2& part, const EndDirections& directions, double tolerance) {
  EdgeFit best = fit_line(part, directions);
  if (best.off <= tolerance) {
    return best;
  }
  for (const auto& fitted : {fit_arc, fit_cubic}) {
    EdgeFit fit = fitted(part, directions);
    if (fit.off <= tolerance) {
      return fit;
    }
    if (fit.off < best.off) {
      best = std::move(fit);
    }
  }
  return best;
}

/// Where a run heads at a point, as the points up to `reach` before and after it lie.
Vector2 heading(const Points2& run, Index point, Index from, Index to, double reach) {
  Index before = point - 1;
  Index after = point + 1;
  const Vector2 here = run.row(point);
  while (before > from && (Vector2(run.row(before)) - here).norm() < reach) {
    --before;
  }
  while (after < to && (Vector2(run.row(after)) - here).norm() < reach) {
    ++after;
  }
  return Vector2(run.row(after) - run.row(before)).normalized();
}

struct RunFitter {
  const std::vector<Points2>& smooth;
  FitRunsOptions options;
  FittedRuns fitted;

  void fit(Index from, Index to, const std::vector<EndDirections>& directions) {
    std::vector<EdgeFit> fits;
    double worst = -1;
    Index farthest = from + (to - from) / 2;
    for (std::size_t r = 0; r < smooth.size(); ++r) {
      const Points2 part = smooth[r].middleRows(from, to - from + 1);
      const double length = lengths_along(part).back();
      const double chord = (part.row(part.rows() - 1) - part.row(0)).norm();
      constexpr double kClosed = 0.2;  // a loop, or nearly
      fits.push_back(to - from > 1 && chord < kClosed * length
                         ? EdgeFit{{}, kWorst, part.rows() / 2}
                         : fit_simplest(part, directions[r], options.tolerance));
      if (fits.back().off > worst) {
        worst = fits.back().off;
        farthest = from + fits.back().farthest;
      }
    }
    if (to - from == 1 || worst <= options.tolerance) {
      for (std::size_t r = 0; r < smooth.size(); ++r) {
        fitted.edges[r].push_back(to - from == 1 ? PanelEdge{} : fits[r].edge);
      }
      fitted.joints.push_back(static_cast<std::size_t>(to));
      return;
    }
    // Not so near to an end that a stub remains.
    const Index margin = (to - from) / 6;
    farthest =
        std::clamp(farthest, from + std::max<Index>(1, margin), to - std::max<Index>(1, margin));
    std::vector<EndDirections> first = directions;
    std::vector<EndDirections> last = directions;
    for (std::size_t r = 0; r < smooth.size(); ++r) {
      const Vector2 along = heading(smooth[r], farthest, from, to, options.reach);
      first[r].last = along;
      last[r].first = along;
    }
    fit(from, farthest, first);
    fit(farthest, to, last);
  }
};

}  // namespace

// (I + stiffness D'D) q = p with both ends known, D the second differences.
Points2 smoothed_points(const Points2& part, double reach) {
  const Index inner = part.rows() - 2;
  if (inner < 1 || !(reach > 0)) {
    return part;
  }
  const double spacing = lengths_along(part).back() / static_cast<double>(inner + 1);
  const double stiffness = std::pow(reach / std::max(spacing, 1e-9), 4);
  std::vector<Eigen::Triplet<double>> entries;
  Points2 right = part.middleRows(1, inner);
  const double weights[3] = {1, -2, 1};
  for (Index i = 0; i < inner; ++i) {
    entries.emplace_back(i, i, 1.0);
    for (int p = 0; p < 3; ++p) {
      const Index row = i + p - 1;
      if (row < 0 || row >= inner) {
        continue;
      }
      for (int q = 0; q < 3; ++q) {
        const Index column = i + q - 1;
        const double entry = stiffness * weights[p] * weights[q];
        if (column < 0 || column >= inner) {
          right.row(row) -= entry * part.row(column + 1);
        } else {
          entries.emplace_back(row, column, entry);
        }
      }
    }
  }
  Points2 smooth = part;
  Eigen::SparseMatrix<double> system(inner, inner);
  system.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(system);
  smooth.middleRows(1, inner) = factors.solve(right);
  return smooth;
}

std::vector<std::size_t> run_corners(const Points2& run, double reach) {
  ATELIER_CHECK(run.rows() >= 2, "a run of two points or more");
  constexpr double kCorner = 0.7;  // rad
  constexpr double kEdges = 3;     // a zigzag of single edges is no corner
  const std::vector<double> at = lengths_along(run);
  const std::size_t count = at.size();
  reach = std::max(reach, kEdges * at.back() / static_cast<double>(count - 1));
  std::vector<double> turning(count, 0);
  for (std::size_t i = 1; i + 1 < count; ++i) {
    std::size_t before = i - 1;
    std::size_t after = i + 1;
    while (before > 0 && at[i] - at[before] < reach) {
      --before;
    }
    while (after + 1 < count && at[after] - at[i] < reach) {
      ++after;
    }
    const auto row = [&](std::size_t point) { return Vector2(run.row(static_cast<Index>(point))); };
    turning[i] = angle_between(row(i) - row(before), row(after) - row(i));
  }
  std::vector<std::size_t> corners{0};
  for (std::size_t i = 1; i + 1 < count; ++i) {
    if (turning[i] > kCorner && turning[i] >= turning[i - 1] && turning[i] > turning[i + 1] &&
        at[i] - at[corners.back()] > reach / 2) {
      corners.push_back(i);
    }
  }
  corners.push_back(count - 1);
  return corners;
}

FittedRuns fit_runs(const std::vector<Points2>& runs, const FitRunsOptions& options) {
  ATELIER_CHECK(!runs.empty(), "a run");
  const Index count = runs.front().rows();
  std::vector<std::size_t> corners;
  for (const Points2& run : runs) {
    ATELIER_CHECK(run.rows() == count && count >= 2, "runs of as many points, two or more");
    const std::vector<std::size_t> own = run_corners(run, options.reach);
    corners.insert(corners.end(), own.begin(), own.end());
  }
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  std::vector<Points2> smooth;
  smooth.reserve(runs.size());
  for (const Points2& run : runs) {
    smooth.push_back(smoothed_run(run, corners, options.reach));
  }
  RunFitter fitter{smooth, options, {}};
  FittedRuns& fitted = fitter.fitted;
  fitted.joints.push_back(0);
  fitted.edges.resize(runs.size());
  if (options.tolerance > 0) {
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      fitter.fit(static_cast<Index>(corners[i]), static_cast<Index>(corners[i + 1]),
                 std::vector<EndDirections>(runs.size()));
    }
  } else {
    for (std::size_t i = 1; i < static_cast<std::size_t>(count); ++i) {
      fitted.joints.push_back(i);
    }
    for (std::vector<PanelEdge>& edges : fitted.edges) {
      edges.resize(static_cast<std::size_t>(count) - 1);
    }
  }
  for (const Points2& run : smooth) {
    fitted.corners.emplace_back(static_cast<Index>(fitted.joints.size()), 2);
    for (std::size_t i = 0; i < fitted.joints.size(); ++i) {
      fitted.corners.back().row(static_cast<Index>(i)) =
          run.row(static_cast<Index>(fitted.joints[i]));
    }
  }
  return std::move(fitted);
}

}  // namespace atelier
