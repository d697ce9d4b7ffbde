#include "simulation/projective/self_touches.h"

#include <algorithm>
#include <array>

#include "core/parallel.h"

namespace atelier {
namespace {

constexpr Index kTouchGrain = 512;
/// Tension presses cloth together that would fly past by itself.
constexpr double kTouchMargin = 5e-4;  // m

/// Pairs and the touch of each; only where `valid`.
struct PairTouch {
  TouchedCloth touch;
  bool valid = false;
};

PairTouch touch_of(const SelfView<double>& view, const SelfPair<double>& candidate,
                   const SelfMotion<double>& motion, double h) {
  PairTouch out;
  // Beside crossings the layers' order pulls, and the guard after the iterations pushes.
  if (order_decides(view, candidate, false)) {
    return out;
  }
  const auto end = [&](int i) { return motion.x[i]; };
  const auto begin = [&](int i) { return motion.origin[i]; };
  const double gap = candidate.gap;
  const double near = gap + std::max(kTouchMargin, gap);
  const auto apart = [](const PairPoints<double>& pair, const Vec4<double>* at) {
    Vec3d sum{};
    for (int k = 0; k < 4; ++k) {
      sum += pair.weight[k] * xyz(at[k]);
    }
    return sum;
  };
  // Where they end, as what slides along comes nearest to other pieces than it began at. Where they
  // would have passed by then, as they began.
  PairPoints<double> pair;
  PairDirection<double> direction;
  Vec3d away{};
  bool touches = vertex_face_points(view, candidate, near, motion_of(end, end), pair, direction);
  if (touches) {
    for (int k = 0; k < 4; ++k) {
      pair.start[k] = begin(pair.particle[k]);
    }
    away = apart(pair, pair.x);
    touches = dot(away, apart(pair, pair.start)) > 0;
  }
  if (!touches) {
    if (!vertex_face_points(view, candidate, near, motion_of(end, begin), pair, direction)) {
      return out;
    }
    away = apart(pair, pair.start);
    if (dot(away, apart(pair, pair.x)) > 0) {
      return out;
    }
  }
  const double distance = norm(away);
  const Vec3d n = distance > 1e-7 ? (1 / distance) * away : direction.normal;
  if (!(squared_norm(n) > 0)) {
    return out;
  }
  // What was too near before is moved out by the guard, which makes no velocity of it.
  const double at_start = std::max(0.0, dot(n, apart(pair, pair.start)));
  const double wanted = std::min(gap, at_start);
  out.valid = true;
  std::copy_n(pair.particle, 4, out.touch.particle);
  std::copy_n(pair.weight, 4, out.touch.weight);
  out.touch.normal = n;
  out.touch.least = (wanted - at_start) / h;
  return out;
}

}  // namespace

std::vector<TouchedCloth> touching_pairs(SelfContactCpu<double>& self,
                                         const SelfMotion<double>& motion, double h) {
  const std::vector<SelfPair<double>>& pairs = self.near_faces(motion);
  std::vector<PairTouch> touches(pairs.size());
  parallel_for(static_cast<Index>(pairs.size()), kTouchGrain, [&](Index begin, Index end) {
    for (Index k = begin; k < end; ++k) {
      touches[k] = touch_of(self.view(), pairs[k], motion, h);
    }
  });
  std::vector<TouchedCloth> out;
  for (const PairTouch& one : touches) {
    if (one.valid) {
      out.push_back(one.touch);
    }
  }
  const auto key = [](const TouchedCloth& t) {
    return std::array{t.particle[0], t.particle[1], t.particle[2], t.particle[3]};
  };
  std::sort(out.begin(), out.end(),
            [&](const TouchedCloth& a, const TouchedCloth& b) { return key(a) < key(b); });
  return out;
}

}  // namespace atelier
