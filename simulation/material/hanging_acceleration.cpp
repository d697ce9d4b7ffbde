#include "simulation/material/hanging_acceleration.h"

#include <algorithm>
#include <vector>

#include "core/median.h"
#include "core/tree.h"

namespace atelier {

std::optional<double> hanging_acceleration(const Sequence& registered, int frame_id,
                                           const Points& body, const Triangles& body_faces) {
  constexpr double kFree = 0.03;      // m
  constexpr double kMinShare = 0.05;  // of the vertices
  const std::vector<int>& ids = registered.frame_ids;
  const auto at = std::lower_bound(ids.begin(), ids.end(), frame_id);
  if (at == ids.begin() || at == ids.end() || at + 1 == ids.end() || *at != frame_id ||
      *(at - 1) != frame_id - 1 || *(at + 1) != frame_id + 1) {
    return std::nullopt;
  }
  const Index row = at - ids.begin();
  const Points here = frame(registered, row).vertices;
  const Points second =
      registered.fps * registered.fps *
      (frame(registered, row - 1).vertices + frame(registered, row + 1).vertices - 2 * here);
  const std::vector<ClosestPoint> nearest =
      closest_points(build_tree(body, body_faces), here, kFree);
  std::vector<double> lengths;
  for (Index v = 0; v < here.rows(); ++v) {
    if (nearest[static_cast<std::size_t>(v)].face < 0) {
      lengths.push_back(second.row(v).norm());
    }
  }
  if (static_cast<double>(lengths.size()) < kMinShare * static_cast<double>(here.rows()) ||
      lengths.empty()) {
    return std::nullopt;
  }
  return median(lengths);
}

}  // namespace atelier
