#include "core/welded_faces.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

namespace atelier {

Triangles welded_faces(const Points& vertices, const Triangles& faces) {
  const auto place = [&](int v) {
    return std::array{vertices(v, 0), vertices(v, 1), vertices(v, 2)};
  };
  std::vector<int> order(static_cast<std::size_t>(vertices.rows()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const auto pa = place(a);
    const auto pb = place(b);
    return pa < pb || (pa == pb && a < b);
  });
  std::vector<int> first(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && place(order[i]) == place(order[i - 1]);
    first[static_cast<std::size_t>(order[i])] =
        same ? first[static_cast<std::size_t>(order[i - 1])] : order[i];
  }
  return faces.unaryExpr([&](int v) { return first[static_cast<std::size_t>(v)]; });
}

}  // namespace atelier
