#pragma once

#include <functional>
#include <string>

#include "core/finding.h"

namespace atelier {

/// Callbacks of the flattening of one garment.
struct FlattenWatcher {
  std::function<void(const std::string&)> say;
  std::function<void(const Finding&)> warn;
  /// After a round of relaxing: of how many, and how far off the garment hangs [m].
  std::function<void(int round, int rounds, double error)> relaxed;
  std::function<bool()> stopped;  ///< the work is of no use any more
};

}  // namespace atelier
