#include "registration/flattening/offset_outline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "core/cross.h"
#include "core/error.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;

/// Every edge moved outwards and joined to the next; it may cross itself.
std::vector<Vector2> raw_offset(const std::vector<Vector2>& loop,
                                const std::vector<double>& distances) {
  constexpr double kMitre = 2;  // of the larger distance
  std::vector<Vector2> moved;
  const std::size_t count = loop.size();
  for (std::size_t i = 0; i < count; ++i) {
    const double before = distances[(i + count - 1) % count];
    const double after = distances[i];
    const Vector2 in = (loop[i] - loop[(i + count - 1) % count]).normalized();
    const Vector2 out = (loop[(i + 1) % count] - loop[i]).normalized();
    const Vector2 in_normal(in.y(), -in.x());  // outwards of a counter-clockwise loop
    const Vector2 out_normal(out.y(), -out.x());
    const double cosine = in_normal.dot(out_normal);
    const double sine = cross(in, out);
    const double larger = std::max(before, after);
    // Where both moved lines meet.
    Vector2 meet = before * in_normal;
    if (before == after) {
      meet = before * std::sqrt(2 / std::max(1 + cosine, 1e-12)) *
             (in_normal + out_normal).normalized();
    } else if (std::abs(sine) > 1e-3) {
      meet += (after - before * cosine) / sine * in;
    } else {
      moved.push_back(loop[i] + before * in_normal);  // a step, where the allowance changes
      moved.push_back(loop[i] + after * out_normal);
      continue;
    }
    if (meet.norm() <= kMitre * larger && (sine > 0 || cosine > 0.5)) {
      moved.push_back(loop[i] + meet);
    } else if (sine > 0) {
      // As far along both edges as the mitre may reach.
      const double along = std::sqrt(kMitre * kMitre - 1) * larger;
      moved.push_back(loop[i] + before * in_normal + along * in);
      moved.push_back(loop[i] + after * out_normal - along * out);
    } else {
      moved.push_back(loop[i] + before * in_normal);
      moved.push_back(loop[i] + after * out_normal);
    }
  }
  return moved;
}

/// The outermost line of a closed polyline that crosses itself.
std::vector<Vector2> outermost(const std::vector<Vector2>& loop) {
  const std::size_t count = loop.size();
  // Crossings along each segment: where, and on which segment it goes on.
  struct Crossing {
    double at;
    std::size_t other;
    double at_other;
    Vector2 point;
  };
  std::vector<std::vector<Crossing>> crossings(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vector2& a = loop[i];
    const Vector2 ab = loop[(i + 1) % count] - a;
    for (std::size_t j = i + 2; j < count; ++j) {
      if ((j + 1) % count == i) {
        continue;
      }
      const Vector2& c = loop[j];
      const Vector2 cd = loop[(j + 1) % count] - c;
      const double between = cross(ab, cd);
      if (between == 0) {
        continue;
      }
      const double s = cross(c - a, cd) / between;
      const double t = cross(c - a, ab) / between;
      if (s >= 0 && s < 1 && t >= 0 && t < 1) {
        crossings[i].push_back({s, j, t, a + s * ab});
        crossings[j].push_back({t, i, s, a + s * ab});
      }
    }
  }
  for (auto& on_segment : crossings) {
    std::sort(on_segment.begin(), on_segment.end(),
              [](const Crossing& a, const Crossing& b) { return a.at < b.at; });
  }
  // From the lowest point, which is on the outer line, always to the outer side.
  const auto lowest =
      std::min_element(loop.begin(), loop.end(), [](const Vector2& a, const Vector2& b) {
        return a.y() < b.y() || (a.y() == b.y() && a.x() < b.x());
      });
  const auto start = static_cast<std::size_t>(lowest - loop.begin());
  std::vector<Vector2> line{*lowest};
  std::size_t segment = start;
  double at = -1;  // crossings after this place of the segment
  for (std::size_t steps = 0; steps < 4 * count + 16; ++steps) {
    const auto next = std::find_if(crossings[segment].begin(), crossings[segment].end(),
                                   [&](const Crossing& c) { return c.at > at; });
    if (next == crossings[segment].end()) {
      segment = (segment + 1) % count;
      at = -1;
      if (segment == start) {
        return line;
      }
      line.push_back(loop[segment]);
      continue;
    }
    line.push_back(next->point);
    const Vector2 here = loop[(segment + 1) % count] - loop[segment];
    const Vector2 there = loop[(next->other + 1) % count] - loop[next->other];
    at = next->at;
    if (cross(here, there) < 0) {  // the other one leads outwards, to the right
      at = next->at_other;
      segment = next->other;
    }
  }
  return loop;  // degenerate: as it is
}

}  // namespace

Points2 offset_outline(const Points2& outline, double distance) {
  return offset_outline(outline,
                        std::vector<double>(static_cast<std::size_t>(outline.rows()), distance));
}

Points2 offset_outline(const Points2& outline, const std::vector<double>& distances) {
  ATELIER_CHECK(outline.rows() >= 3, "an outline of three points or more");
  ATELIER_CHECK(static_cast<Index>(distances.size()) == outline.rows(),
                "a distance for each segment");
  for (const double distance : distances) {
    ATELIER_CHECK(distance >= 0 && std::isfinite(distance), "a distance of zero or more");
  }
  if (std::all_of(distances.begin(), distances.end(), [](double d) { return d == 0; })) {
    return outline;
  }
  std::vector<Vector2> loop;
  std::vector<double> own;
  for (Index i = 0; i < outline.rows(); ++i) {
    const Vector2 point = outline.row(i);
    if (loop.empty() || (point - loop.back()).norm() > 1e-9) {
      loop.push_back(point);
      own.push_back(distances[static_cast<std::size_t>(i)]);
    } else {
      own.back() = distances[static_cast<std::size_t>(i)];
    }
  }
  while (loop.size() > 3 && (loop.front() - loop.back()).norm() <= 1e-9) {
    loop.pop_back();
    own.pop_back();
  }
  const std::vector<Vector2> line = outermost(raw_offset(loop, own));
  Points2 result(static_cast<Index>(line.size()), 2);
  for (std::size_t i = 0; i < line.size(); ++i) {
    result.row(static_cast<Index>(i)) = line[i].transpose();
  }
  return result;
}

}  // namespace atelier
