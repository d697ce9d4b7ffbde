#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

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

/// The boxes of one group, coordinate by coordinate, as many are compared at once.
struct GroupBounds {
  alignas(32) float low[3][kGroup];
  alignas(32) float high[3][kGroup];

  void set(int lane, const Box<float>& box) {
    const float lows[3] = {box.low.x, box.low.y, box.low.z};
    const float highs[3] = {box.high.x, box.high.y, box.high.z};
    for (int c = 0; c < 3; ++c) {
      low[c][lane] = lows[c];
      high[c][lane] = highs[c];
    }
  }
  Box<float> at(int lane) const {
    return {{low[0][lane], low[1][lane], low[2][lane]},
            {high[0][lane], high[1][lane], high[2][lane]}};
  }
};

/// Which boxes of `group` meet `box`, a bit each; with AVX2 where the processor has it.
unsigned meeting(const GroupBounds& group, const Box<float>& box);
/// The same for each box of `own` that `lanes` names, in `out`.
void meeting(const GroupBounds& own, unsigned lanes, const GroupBounds& group,
             unsigned (&out)[kGroup]);

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
        for (int lane = 0; lane < kGroup; ++lane) {
          const std::size_t slot = static_cast<std::size_t>(k) * kGroup + lane;
          const Box<float> own =
              slot < item_.size() ? rounded_outwards(box(item_[slot])) : empty_box<float>();
          bound_[k].set(lane, own);
          all = united(all, own);
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
          for (unsigned meets = meeting(bound_[g], query); meets != 0; meets &= meets - 1) {
            found(item_[g * kGroup + std::countr_zero(meets)]);
          }
        }
      }
    }
  }

  /// The primitive at a place of the order of the groups, and how many places there are.
  int item(int slot) const { return item_[slot]; }
  int count() const { return static_cast<int>(item_.size()); }

  /// Calls `found(own, other)` for each primitive of group `k` and each of `others` whose boxes
  /// meet. `kSame`: `others` is this, and each pair comes once.
  template <bool kSame, class Found>
  void visit_near(int k, const GroupedBoxes& others, const Found& found) const {
    visit_near_places<kSame>(k, others,
                             [&](int own, int other) { found(item_[own], others.item_[other]); });
  }
  /// The same with their places in the order of the groups.
  template <bool kSame, class Found>
  void visit_near_places(int k, const GroupedBoxes& others, const Found& found) const {
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
  static std::size_t parts(std::size_t n) { return (n + kGroup - 1) / kGroup; }

  template <bool kSame, class Found>
  void visit_group(int k, const GroupedBoxes& others, int g, const Found& found) const {
    unsigned meets[kGroup];
    const unsigned own = meeting(bound_[k], others.group_[g]);
    meeting(bound_[k], own, others.bound_[g], meets);
    for (unsigned lanes = own; lanes != 0; lanes &= lanes - 1) {
      const int lane = std::countr_zero(lanes);
      const unsigned later = kSame && g == k ? ~((2u << lane) - 1u) : ~0u;
      for (unsigned of = meets[lane] & later; of != 0; of &= of - 1) {
        found(k * kGroup + lane, g * kGroup + std::countr_zero(of));
      }
    }
  }

  std::vector<int> item_;  ///< primitives in the order of the groups
  std::vector<GroupBounds> bound_;
  std::vector<Box<float>> group_, whole_;
};

}  // namespace atelier
