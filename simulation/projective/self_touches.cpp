#include "simulation/projective/self_touches.h"

#include <algorithm>
#include <array>

#include "core/parallel.h"

namespace atelier {
namespace {

constexpr Index kTouchGrain = 512;

/// Pairs and the touch of each; only where `valid`.
struct PairTouch {
  TouchedCloth touch;
  bool valid = false;
};

}  // namespace

std::vector<TouchedCloth> touching_pairs(SelfContactCpu<double>& self,
                                         const SelfMotion<double>& motion, double h) {
  const std::vector<SelfPair<double>>& pairs = self.near_faces(motion);
  const auto end = [&](int i) { return motion.x[i]; };
  const auto begin = [&](int i) { return motion.origin[i]; };
  std::vector<PairTouch> touches(pairs.size());
  parallel_for(static_cast<Index>(pairs.size()), kTouchGrain, [&](Index first, Index last) {
    for (Index k = first; k < last; ++k) {
      touches[k].valid =
          touch_of_pair(self.view(), pairs[k], motion_of(end, begin), h, touches[k].touch);
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
