#include "simulation/cloth/colouring.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>

namespace atelier {
namespace {

constexpr int kRounds = 12;

/// Which colours each particle already has, a bit a colour.
class UsedColours {
 public:
  UsedColours(const std::vector<std::array<int, 4>>& groups, int particles) {
    std::vector<int> degree(static_cast<std::size_t>(particles), 0);
    for (const std::array<int, 4>& group : groups) {
      for (int v : group) {
        if (v >= 0) {
          ++degree[v];
        }
      }
    }
    // A greedy colour never exceeds 4 (degree - 1) + 1.
    const int most = degree.empty() ? 0 : *std::max_element(degree.begin(), degree.end());
    words_ = (4 * most + 64) / 64;
    bits_.assign(static_cast<std::size_t>(particles) * words_, 0);
  }

  void clear() { std::fill(bits_.begin(), bits_.end(), 0); }

  int first_free(const std::array<int, 4>& group) const {
    for (int w = 0;; ++w) {
      const std::uint64_t taken = taken_word(group, w);
      if (~taken != 0) {
        return 64 * w + std::countr_one(taken);
      }
    }
  }

  bool is_free(const std::array<int, 4>& group, int colour) const {
    return ((taken_word(group, colour / 64) >> (colour % 64)) & 1) == 0;
  }

  void flip(const std::array<int, 4>& group, int colour) {
    for (int v : group) {
      if (v >= 0) {
        bits_[static_cast<std::size_t>(v) * words_ + colour / 64] ^= std::uint64_t(1)
                                                                     << (colour % 64);
      }
    }
  }

 private:
  std::uint64_t taken_word(const std::array<int, 4>& group, int w) const {
    std::uint64_t taken = 0;
    for (int v : group) {
      if (v >= 0) {
        taken |= bits_[static_cast<std::size_t>(v) * words_ + w];
      }
    }
    return taken;
  }

  int words_ = 1;
  std::vector<std::uint64_t> bits_;
};

}  // namespace

std::vector<int> colour_groups(const std::vector<std::array<int, 4>>& groups, int particles) {
  std::vector<int> colour(groups.size(), 0);
  if (groups.empty()) {
    return colour;
  }
  UsedColours used(groups, particles);
  std::vector<int> order(groups.size());
  std::iota(order.begin(), order.end(), 0);
  const auto size = [&](int g) {
    return std::count_if(groups[g].begin(), groups[g].end(), [](int v) { return v >= 0; });
  };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return size(a) > size(b); });
  std::vector<int> class_size;
  for (int round = 0; round < kRounds; ++round) {
    used.clear();
    class_size.clear();
    for (int g : order) {
      const int k = used.first_free(groups[g]);
      colour[g] = k;
      used.flip(groups[g], k);
      if (k >= static_cast<int>(class_size.size())) {
        class_size.resize(static_cast<std::size_t>(k) + 1, 0);
      }
      ++class_size[k];
    }
    // Classes kept together never need more colours; large ones first, or the last ones first,
    // empties the small ones.
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      const int ca = colour[a];
      const int cb = colour[b];
      if (round % 2 == 1 && class_size[ca] != class_size[cb]) {
        return class_size[ca] > class_size[cb];
      }
      return ca > cb;
    });
  }
  bool moved = true;
  for (int round = 0; moved && round < kRounds; ++round) {
    moved = false;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      int best = colour[g];
      for (int k = 0; k < static_cast<int>(class_size.size()); ++k) {
        const bool evens_out = class_size[k] + 1 < class_size[colour[g]];
        if (evens_out && class_size[k] < class_size[best] && used.is_free(groups[g], k)) {
          best = k;
        }
      }
      if (best != colour[g]) {
        used.flip(groups[g], colour[g]);
        used.flip(groups[g], best);
        --class_size[colour[g]];
        ++class_size[best];
        colour[g] = best;
        moved = true;
      }
    }
  }
  return colour;
}

}  // namespace atelier
