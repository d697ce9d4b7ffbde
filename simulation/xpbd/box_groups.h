#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#ifdef __SSE2__
#include <xmmintrin.h>
#endif

#include "core/parallel.h"
#include "simulation/contact/tree_math.h"
#include "simulation/xpbd/near_groups.h"

namespace atelier {

/// The box in single precision, which is at most that much larger, as four are compared at once.
inline Box<float> rounded_outwards(const Box<float>& box) {
  return box;
}
inline Box<float> rounded_outwards(const Box<double>& box) {
  constexpr double kRounding = 1.2e-7;  // more than float's, as a share
  const auto below = [&](double x) { return static_cast<float>(x - kRounding * std::abs(x)); };
  const auto above = [&](double x) { return static_cast<float>(x + kRounding * std::abs(x)); };
  return {{below(box.low.x), below(box.low.y), below(box.low.z)},
          {above(box.high.x), above(box.high.y), above(box.high.z)}};
}

/// Four boxes, which are compared at once.
struct FourBoxes {
  alignas(16) float low[3][4];
  alignas(16) float high[3][4];

  void set(int k, const Box<float>& box) {
    const float lows[3] = {box.low.x, box.low.y, box.low.z};
    const float highs[3] = {box.high.x, box.high.y, box.high.z};
    for (int c = 0; c < 3; ++c) {
      low[c][k] = lows[c];
      high[c][k] = highs[c];
    }
  }
  Box<float> at(int k) const {
    return {{low[0][k], low[1][k], low[2][k]}, {high[0][k], high[1][k], high[2][k]}};
  }
  /// Which of them meet `box`, a bit each.
  unsigned meeting(const Box<float>& box) const {
    const float lows[3] = {box.low.x, box.low.y, box.low.z};
    const float highs[3] = {box.high.x, box.high.y, box.high.z};
#ifdef __SSE2__
    __m128 meets = _mm_cmpeq_ps(_mm_setzero_ps(), _mm_setzero_ps());
    for (int c = 0; c < 3; ++c) {
      meets = _mm_and_ps(meets, _mm_cmple_ps(_mm_load_ps(low[c]), _mm_set1_ps(highs[c])));
      meets = _mm_and_ps(meets, _mm_cmpge_ps(_mm_load_ps(high[c]), _mm_set1_ps(lows[c])));
    }
    return static_cast<unsigned>(_mm_movemask_ps(meets));
#else
    unsigned meets = 0xF;
    for (int c = 0; c < 3; ++c) {
      for (unsigned k = 0; k < 4; ++k) {
        meets &= ~(static_cast<unsigned>(low[c][k] > highs[c] || high[c][k] < lows[c]) << k);
      }
    }
    return meets;
#endif
  }
};

/// Boxes over primitives that lie together, in groups of kGroup and groups of kGroup groups,
/// through which the CPU looks for what may meet: no tree, and many boxes are compared at once, in
/// single precision rounded outwards. CUDA does the same by warps (cuda_self_search.cuh).
class GroupedBoxes {
 public:
  GroupedBoxes() = default;
  /// `centres`: of the primitives where they lie together.
  explicit GroupedBoxes(const std::vector<std::array<double, 3>>& centres)
      : item_(near_group_order(centres)),
        bound_(parts(item_.size())),
        group_(bound_.size()),
        whole_(parts(group_.size())) {}

  int groups() const { return static_cast<int>(group_.size()); }

  /// Takes new boxes over: `box(primitive)`.
  template <class BoxOf>
  void fill(const BoxOf& box) {
    fill_where([](int) { return true; }, box);
  }
  /// The same for those that `changed(primitive)`, at least.
  template <class Changed, class BoxOf>
  void fill_where(const Changed& changed, const BoxOf& box) {
    parallel_for(groups(), 16, [&](Index begin, Index end) {
      for (Index k = begin; k < end; ++k) {
        const auto first = item_.begin() + k * kGroup;
        const auto last = item_.begin() + std::min<Index>((k + 1) * kGroup, std::ssize(item_));
        if (std::none_of(first, last, changed)) {
          continue;
        }
        Box<float> all = empty_box<float>();
        Box<float> eight = empty_box<float>();
        for (int lane = 0; lane < kGroup; ++lane) {
          const std::size_t slot = static_cast<std::size_t>(k) * kGroup + lane;
          const Box<float> own =
              slot < item_.size() ? rounded_outwards(box(item_[slot])) : empty_box<float>();
          bound_[k].set(lane, own);
          eight = united(eight, own);
          if (lane % kEight == kEight - 1) {
            bound_[k].eights.set(lane / kEight, eight);
            all = united(all, eight);
            eight = empty_box<float>();
          }
        }
        group_[k] = all;
      }
    });
    std::fill(whole_.begin(), whole_.end(), empty_box<float>());
    for (std::size_t k = 0; k < group_.size(); ++k) {
      Box<float>& whole = whole_[k / kGroup];
      whole = united(whole, group_[k]);
    }
  }

  /// Calls `found(primitive)` for each whose box meets `query`.
  template <class T, class Found>
  void visit_near(const Box<T>& of, const Found& found) const {
    const Box<float> query = rounded_outwards(of);
    for (std::size_t w = 0; w < whole_.size(); ++w) {
      if (!overlap(query, whole_[w])) {
        continue;
      }
      const std::size_t end = std::min((w + 1) * kGroup, group_.size());
      for (std::size_t g = w * kGroup; g < end; ++g) {
        if (overlap(query, group_[g])) {
          bound_[g].visit_meeting(query, [&](int lane) { found(item_[g * kGroup + lane]); });
        }
      }
    }
  }

  /// Calls `found(own, other)` for each primitive of group `k` and each of `others` whose boxes
  /// meet. `kSame`: `others` is this, and each pair comes once.
  template <bool kSame, class Found>
  void visit_near(int k, const GroupedBoxes& others, const Found& found) const {
    const Box<float>& around = group_[k];
    const int first = kSame ? k : 0;
    for (int w = first / kGroup; w < static_cast<int>(others.whole_.size()); ++w) {
      if (!overlap(around, others.whole_[w])) {
        continue;
      }
      const int end = std::min((w + 1) * kGroup, others.groups());
      for (int g = std::max(first, w * kGroup); g < end; ++g) {
        if (overlap(around, others.group_[g])) {
          visit_group<kSame>(k, others, g, found);
        }
      }
    }
  }

 private:
  /// The boxes of one group, and boxes over each eight of them.
  struct Bounds {
    FourBoxes four[kGroup / 4];
    FourBoxes eights;

    void set(int lane, const Box<float>& box) { four[lane / 4].set(lane % 4, box); }
    Box<float> at(int lane) const { return four[lane / 4].at(lane % 4); }
    /// Calls `found(lane)` for each box that meets `box`.
    template <class Found>
    void visit_meeting(const Box<float>& box, const Found& found) const {
      for (unsigned near = eights.meeting(box); near != 0; near &= near - 1) {
        const int eight = std::countr_zero(near);
        unsigned meets = four[2 * eight].meeting(box) | four[2 * eight + 1].meeting(box) << 4;
        for (; meets != 0; meets &= meets - 1) {
          found(eight * kEight + std::countr_zero(meets));
        }
      }
    }
  };

  static std::size_t parts(std::size_t n) { return (n + kGroup - 1) / kGroup; }

  template <bool kSame, class Found>
  void visit_group(int k, const GroupedBoxes& others, int g, const Found& found) const {
    const Bounds& bounds = others.bound_[g];
    const Box<float>& box_of_group = others.group_[g];
    const auto visit = [&](int lane) {
      bounds.visit_meeting(bound_[k].at(lane), [&](int other) {
        if (!(kSame && g == k && other <= lane)) {
          found(item_[static_cast<std::size_t>(k) * kGroup + lane],
                others.item_[static_cast<std::size_t>(g) * kGroup + other]);
        }
      });
    };
    bound_[k].visit_meeting(box_of_group, visit);
  }

  std::vector<int> item_;  ///< primitives in the order of the groups
  std::vector<Bounds> bound_;
  std::vector<Box<float>> group_, whole_;
};

}  // namespace atelier
