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
  const auto now = [&](int i) { return motion.x[i]; };
  const auto before = [&](int i) { return motion.origin[i]; };
  const double gap = candidate.gap;
  PairPoints<double> pair;
  PairDirection<double> direction;
  if (!vertex_face_points(view, candidate, gap + std::max(kTouchMargin, gap), motion_of(now, before),
                          pair, direction)) {
    return out;
  }
  Vec3d apart{};
  for (int k = 0; k < 4; ++k) {
    apart += pair.weight[k] * xyz(pair.start[k]);
  }
  const double distance = norm(apart);
  const Vec3d n = distance > 1e-7 ? (1 / distance) * apart : direction.normal;
  if (!(squared_norm(n) > 0)) {
    return out;
  }
  // What was too near before is moved out by the guard, which makes no velocity of it.
  const double at_start = std::max(0.0, dot(n, apart));
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
