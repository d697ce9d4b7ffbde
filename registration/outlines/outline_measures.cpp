#include "registration/outlines/outline_measures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "core/cross.h"
#include "core/error.h"
#include "core/saturating_cast.h"
#include "registration/outlines/alike_outlines.h"
#include "registration/outlines/fit_runs.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;

constexpr double kSpacing = 0.005;  // m between points that are measured

/// Points of an outline or of an edge, at most: of a panel 10 m around, or an edge of 8 m. One that
/// is larger, of a mesh whose unit was mistaken, is measured more coarsely, not for minutes.
constexpr int kMostPoints = 2000;

/// A closed outline in evenly spaced points.
Points2 evenly(const Points2& outline, double spacing = kSpacing) {
  const Index count = outline.rows();
  std::vector<double> at{0};
  for (Index i = 0; i < count; ++i) {
    at.push_back(at.back() + (outline.row((i + 1) % count) - outline.row(i)).norm());
  }
  const auto points =
      std::clamp<Index>(saturating_cast<Index>(at.back() / spacing), 8, kMostPoints);
  Points2 even(points, 2);
  Index segment = 0;
  for (Index i = 0; i < points; ++i) {
    const double target = at.back() * static_cast<double>(i) / static_cast<double>(points);
    while (segment + 1 < count && at[static_cast<std::size_t>(segment) + 1] <= target) {
      ++segment;
    }
    const double from = at[static_cast<std::size_t>(segment)];
    const double span = at[static_cast<std::size_t>(segment) + 1] - from;
    const double t = span > 0 ? (target - from) / span : 0;
    even.row(i) = (1 - t) * outline.row(segment) + t * outline.row((segment + 1) % count);
  }
  return even;
}

/// How an even outline turns at each point, from `steps` points before to as many after, rad.
std::vector<double> turning_over(const Points2& even, Index steps) {
  const Index count = even.rows();
  steps = std::min(steps, (count - 1) / 3);
  std::vector<double> turning;
  for (Index i = 0; i < count; ++i) {
    const Vector2 in = even.row(i) - even.row((i + count - steps) % count);
    const Vector2 out = even.row((i + steps) % count) - even.row(i);
    turning.push_back(std::atan2(cross(in, out), in.dot(out)));
  }
  return turning;
}

std::vector<Index> outline_corners(const Points2& even) {
  constexpr double kCorner = 35 * std::numbers::pi / 180;
  constexpr double kReach = 0.03;  // m
  const auto steps = saturating_cast<Index>(kReach / kSpacing);
  const std::vector<double> turning = turning_over(even, steps);
  const Index count = even.rows();
  const auto sharpness = [&](Index i) {
    return std::abs(turning[static_cast<std::size_t>((i + count) % count)]);
  };
  std::vector<Index> corners;
  for (Index i = 0; i < count; ++i) {
    bool sharpest = sharpness(i) > kCorner;
    for (Index k = 1; k <= steps && sharpest; ++k) {
      sharpest = sharpness(i) > sharpness(i - k) && sharpness(i) >= sharpness(i + k);
    }
    if (sharpest) {
      corners.push_back(i);
    }
  }
  return corners;
}

int turns_of(const Points2& even) {
  constexpr double kTurn = 0.15;   // rad
  constexpr double kReach = 0.01;  // m
  int turns = 0;
  int state = 0;
  for (const double turn : turning_over(even, saturating_cast<Index>(kReach / kSpacing))) {
    const int now = turn > kTurn ? 1 : turn < -kTurn ? -1 : 0;
    turns += now != 0 && state != 0 && now != state ? 1 : 0;
    state = now != 0 ? now : state;
  }
  return turns;
}

/// Sum of squared distances from the outline smoothed between its corners.
double squares_off_smooth(const Points2& even, const std::vector<Index>& corners) {
  constexpr double kReach = 0.02;  // m
  const Index count = even.rows();
  const Index first = corners.empty() ? 0 : corners.front();
  double squares = 0;
  for (std::size_t k = 0; k < std::max<std::size_t>(1, corners.size()); ++k) {
    const Index from = corners.empty() ? first : corners[k];
    const Index to = (k + 1 < corners.size() ? corners[k + 1] : first + count);
    Points2 run(to - from + 1, 2);
    for (Index i = from; i <= to; ++i) {
      run.row(i - from) = even.row(i % count);
    }
    squares += (smoothed_points(run, kReach) - run).squaredNorm();
  }
  return squares;
}

/// A motion of the plane.
struct PlaneMotion {
  Eigen::Matrix2d turn = Eigen::Matrix2d::Identity();
  Vector2 shift = Vector2::Zero();
};

/// The nearest point of a closed line.
Vector2 nearest_on(const Points2& line, const Vector2& point) {
  Vector2 best = line.row(0);
  double least = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < line.rows(); ++i) {
    const Vector2 a = line.row(i);
    const Vector2 ab = Vector2(line.row((i + 1) % line.rows())) - a;
    const double t = std::clamp((point - a).dot(ab) / std::max(ab.squaredNorm(), 1e-18), 0.0, 1.0);
    const Vector2 on = a + t * ab;
    if ((on - point).squaredNorm() < least) {
      least = (on - point).squaredNorm();
      best = on;
    }
  }
  return best;
}

/// The rotation and translation that bring points nearest to others in the least squares.
PlaneMotion plane_motion(const Points2& from, const Points2& to) {
  const Vector2 from_middle = from.colwise().mean().transpose();
  const Vector2 to_middle = to.colwise().mean().transpose();
  double along = 0;
  double across = 0;
  for (Index i = 0; i < from.rows(); ++i) {
    const Vector2 a = from.row(i).transpose() - from_middle;
    const Vector2 b = to.row(i).transpose() - to_middle;
    along += a.dot(b);
    across += a.x() * b.y() - a.y() * b.x();
  }
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(std::atan2(across, along)).toRotationMatrix();
  return {turn, to_middle - turn * from_middle};
}

/// Moves an outline onto another (iterated closest points, Besl and McKay 1992); returns the rms
/// distance that remains.
double matched(const Points2& moving, const Points2& fixed, PlaneMotion& motion) {
  constexpr int kRounds = 5;
  const Vector2 middle = (moving.colwise().minCoeff() + moving.colwise().maxCoeff()) / 2;
  const Vector2 there = (fixed.colwise().minCoeff() + fixed.colwise().maxCoeff()) / 2;
  motion = {Eigen::Matrix2d::Identity(), there - middle};
  double off = 0;
  for (int round = 0; round <= kRounds; ++round) {
    Points2 places(moving.rows(), 2);
    double squares = 0;
    for (Index i = 0; i < moving.rows(); ++i) {
      const Vector2 here = motion.turn * moving.row(i).transpose() + motion.shift;
      const Vector2 on = nearest_on(fixed, here);
      squares += (on - here).squaredNorm();
      places.row(i) = on.transpose();
    }
    off = std::sqrt(squares / static_cast<double>(moving.rows()));
    if (round == kRounds) {
      break;
    }
    motion = plane_motion(moving, places);
  }
  return off;
}

Points2 mirrored_outline(const Points2& outline) {
  Points2 mirrored = outline.colwise().reverse();  // counter-clockwise again
  mirrored.col(0) *= -1;
  return mirrored;
}

bool cuts_across(const Points2& even, Index from, Index to) {
  const Vector2 a = even.row(from);
  const Vector2 b = even.row(to);
  const Index count = even.rows();
  bool inside = false;
  const Vector2 middle = (a + b) / 2;
  for (Index i = 0; i < count; ++i) {
    const Index next = (i + 1) % count;
    const Vector2 c = even.row(i);
    const Vector2 d = even.row(next);
    if ((c.y() > middle.y()) != (d.y() > middle.y()) &&
        middle.x() < c.x() + (middle.y() - c.y()) / (d.y() - c.y()) * (d.x() - c.x())) {
      inside = !inside;
    }
    if (i == from || i == to || next == from || next == to) {
      continue;
    }
    if (cross(b - a, c - a) * cross(b - a, d - a) < 0 &&
        cross(d - c, a - c) * cross(d - c, b - c) < 0) {
      return false;
    }
  }
  return inside;
}

double narrowest_neck_of(const Points2& even) {
  constexpr double kLeast = 0.002;  // m2
  constexpr double kSquares = 2;    // of the cut's length
  const Index count = even.rows();
  std::vector<double> twice{0};  // area up to each point, seen from the origin
  for (Index i = 0; i < count; ++i) {
    twice.push_back(twice.back() + cross(Vector2(even.row(i)), Vector2(even.row((i + 1) % count))));
  }
  const double whole = twice.back() / 2;
  double best = (even.colwise().maxCoeff() - even.colwise().minCoeff()).minCoeff();
  for (Index i = 0; i < count; ++i) {
    for (Index j = i + 2; j < count; ++j) {
      const Vector2 a = even.row(i);
      const Vector2 b = even.row(j);
      const double length = (b - a).norm();
      if (length >= best) {
        continue;
      }
      const double part =
          (twice[static_cast<std::size_t>(j)] - twice[static_cast<std::size_t>(i)] + cross(b, a)) /
          2;
      if (std::min(part, whole - part) >= std::max(kLeast, kSquares * length * length) &&
          cuts_across(even, i, j)) {
        best = length;
      }
    }
  }
  return best;
}

}  // namespace

int corner_count(const Points2& outline) {
  return static_cast<int>(outline_corners(evenly(outline)).size());
}

double area_of_outline(const Points2& outline) {
  double twice = 0;
  for (Index i = 0; i < outline.rows(); ++i) {
    twice += cross(Vector2(outline.row(i)), Vector2(outline.row((i + 1) % outline.rows())));
  }
  return twice / 2;
}

std::vector<double> corner_shares(const Points2& outline) {
  const Points2 even = evenly(outline);
  std::vector<double> shares;
  for (const Index corner : outline_corners(even)) {
    shares.push_back(static_cast<double>(corner) / static_cast<double>(even.rows()));
  }
  return shares;
}

MirrorMatch mirror_match(const Points2& moving, const Points2& fixed) {
  constexpr double kCoarse = 0.01;  // m
  const Points2 mirrored = mirrored_outline(moving);
  PlaneMotion motion;
  PlaneMotion back;
  MirrorMatch match;
  const Points2 from = evenly(mirrored, kCoarse);
  const Points2 to = evenly(fixed, kCoarse);
  match.off = std::max(matched(from, to, motion), matched(to, from, back));
  match.image = mirrored * motion.turn.transpose();
  match.image.rowwise() += motion.shift.transpose();
  return match;
}

OutlineMeasures measure_outlines(const std::vector<Points2>& outlines) {
  OutlineMeasures measures;
  measures.panels = static_cast<int>(outlines.size());
  if (outlines.empty()) {
    return measures;
  }
  std::vector<Points2> even;
  std::vector<double> areas;
  for (const Points2& outline : outlines) {
    ATELIER_CHECK(outline.rows() >= 3, "an outline of three points or more");
    even.push_back(evenly(outline));
    areas.push_back(area_of_outline(outline));
  }
  double squares = 0;
  double points = 0;
  double turns = 0;
  double length = 0;
  measures.narrowest_neck = std::numeric_limits<double>::infinity();
  for (const Points2& outline : even) {
    const std::vector<Index> corners = outline_corners(outline);
    measures.corners_max = std::max(measures.corners_max, static_cast<int>(corners.size()));
    measures.corners_mean += static_cast<double>(corners.size()) / static_cast<double>(even.size());
    squares += squares_off_smooth(outline, corners);
    points += static_cast<double>(outline.rows());
    turns += turns_of(outline);
    for (Index i = 0; i < outline.rows(); ++i) {
      length += (outline.row((i + 1) % outline.rows()) - outline.row(i)).norm();
    }
    measures.narrowest_neck = std::min(measures.narrowest_neck, narrowest_neck_of(outline));
  }
  measures.jaggedness = std::sqrt(squares / points);
  measures.turns_per_metre = turns / length;
  constexpr double kCoarse =
      0.015;  // m: enough for a distance that is measured to the line between
  std::vector<Points2> coarse;
  for (const Points2& outline : outlines) {
    coarse.push_back(evenly(outline, kCoarse));
  }
  const std::vector<std::vector<std::size_t>> alike = alike_outlines(outlines);
  double whole = 0;
  for (std::size_t p = 0; p < even.size(); ++p) {
    const Points2 mirrored = mirrored_outline(coarse[p]);
    double least = std::numeric_limits<double>::infinity();
    const auto compare = [&](std::size_t q) {
      PlaneMotion motion;
      least = std::min(least, std::max(matched(mirrored, coarse[q], motion),
                                       matched(coarse[q], mirrored, motion)));
    };
    compare(p);
    for (const std::size_t q : alike[p]) {
      compare(q);
    }
    measures.asymmetry += areas[p] * least;
    whole += areas[p];
  }
  measures.asymmetry /= whole;
  return measures;
}

double seam_mismatch(const SewingPattern& pattern) {
  std::map<std::string, std::pair<double, double>> sides;
  for (const SewnEdges& seam : pattern.seams) {
    sides[seam.name].first +=
        edge_length(pattern.panels[static_cast<std::size_t>(seam.panel_a)], seam.edge_a);
    sides[seam.name].second +=
        edge_length(pattern.panels[static_cast<std::size_t>(seam.panel_b)], seam.edge_b);
  }
  double worst = 0;
  for (const auto& [name, lengths] : sides) {
    worst = std::max(
        worst, 2 * std::abs(lengths.first - lengths.second) / (lengths.first + lengths.second));
  }
  return worst;
}

Points2 panel_outline(const Panel& panel, double spacing) {
  ATELIER_CHECK(spacing > 0, "a spacing");
  std::vector<Vector2> points;
  for (std::size_t e = 0; e < panel.edges.size(); ++e) {
    const int edge = static_cast<int>(e);
    constexpr int kLeast = 4;
    const int steps =
        is_straight(panel.edges[e])
            ? 1
            : std::clamp(saturating_cast<int>(std::ceil(edge_length(panel, edge) / spacing)),
                         kLeast, kMostPoints);
    const Points2 samples = sample_edge(panel, edge, steps);
    for (Index i = 0; i + 1 < samples.rows(); ++i) {
      points.emplace_back(samples.row(i).transpose());
    }
  }
  Points2 outline(static_cast<Index>(points.size()), 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    outline.row(static_cast<Index>(i)) = points[i].transpose();
  }
  return outline;
}

MirrorLine mirror_line(const Points2& outline) {
  constexpr double kCoarse = 0.01;  // m
  const Points2 even = evenly(outline, kCoarse);
  PlaneMotion motion;
  MirrorLine line;
  line.off = matched(mirrored_outline(even), even, motion);
  // The motion after x -> -x is the reflection about a line at half its angle from the grain.
  const double angle = std::atan2(motion.turn(1, 0), motion.turn(0, 0)) / 2;
  line.along = {-std::sin(angle), std::cos(angle)};
  const Vector2 middle = even.colwise().mean();
  const Vector2 image = motion.turn * Vector2(-middle.x(), middle.y()) + motion.shift;
  line.point = (middle + image) / 2;
  constexpr double kLean = 20 * std::numbers::pi / 180;
  if (std::abs(angle) > kLean) {
    line.off = std::numeric_limits<double>::infinity();
  }
  return line;
}

}  // namespace atelier
