#pragma once

#include <array>
#include <vector>

#include "simulation/cloth/vec4.h"

namespace atelier {

/// Anderson's acceleration (1965; for projective dynamics Peng et al. 2018) of an iteration
/// v <- v + change(v): of the last iterations the combination whose changes add up to the least
/// takes the place of the last one alone.
///
/// From the start where the changes have grown, and none where they are rounding. Differences of
/// iterations are kept in single precision. The same bits on any number of threads.
class AndersonAcceleration {
 public:
  static constexpr int kMostWindow = 20;

  /// Forgets the iterations before. `window`: how many are combined, 0 to kMostWindow; 0: none, the
  /// plain iteration.
  void begin(std::size_t size, int window);

  /// Takes the iteration `v` and its `change`, and moves `v` to the next one.
  void advance(std::vector<Vec4<double>>& v, const std::vector<Vec4<double>>& change);

 private:
  struct Difference {
    std::vector<Vec4<float>> of_change, of_next;
  };
  /// Of the newest difference and the change with all differences, and of the change with itself.
  struct Products {
    std::array<double, kMostWindow> of_newest{}, of_change{};
    double size = 0;
    Products operator+(const Products& other) const;
  };

  /// Writes the difference to the iteration before into `slot` and multiplies it by `count` others.
  Products note_difference(int slot, int count, const std::vector<Vec4<double>>& v,
                           const std::vector<Vec4<double>>& change);

  std::vector<Difference> differences_;
  double products_[kMostWindow][kMostWindow] = {};  ///< of the differences of changes
  int window_ = 0;
  int count_ = 0;  ///< differences known
  int newest_ = 0;
  bool first_ = true;
  double least_ = 0;  ///< squared norm of the smallest change since the start
  std::vector<Vec4<double>> last_change_, last_next_;
};

}  // namespace atelier
