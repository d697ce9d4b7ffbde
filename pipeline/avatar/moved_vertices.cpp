#include "pipeline/avatar/moved_vertices.h"

#include <set>

namespace atelier {

std::vector<Index> vertices_moved_below(const BodyModel& model, int joint) {
  std::set<int> joints = {joint};
  const std::vector<int>& parents = model.skeleton.parents;
  for (std::size_t j = 0; j < parents.size(); ++j) {
    if (joints.contains(parents[j])) {
      joints.insert(static_cast<int>(j));
    }
  }
  std::vector<Index> vertices;
  for (Index v = 0; v < model.skin.weights.rows(); ++v) {
    Index most = 0;
    model.skin.weights.row(v).maxCoeff(&most);
    if (joints.contains(model.skin.joints(v, most))) {
      vertices.push_back(v);
    }
  }
  return vertices;
}

}  // namespace atelier
