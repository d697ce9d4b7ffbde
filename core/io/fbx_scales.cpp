#include "core/io/fbx_scales.h"

#include <algorithm>
#include <cstddef>

namespace atelier {

std::vector<FbxScale> fbx_scales(const std::vector<GltfNode>& nodes,
                                 const std::vector<FbxInherit>& inherits) {
  std::vector<FbxScale> scales(nodes.size());
  for (std::size_t n = 1; n < nodes.size(); ++n) {
    FbxScale& scale = scales[n];
    scale.applied = nodes[n].scale;
    scale.parent = nodes[n].parent;
    if (inherits[n] == FbxInherit::Whole || scale.parent == 0) {
      continue;
    }
    scale.apart = true;
    const FbxScale& above = scales[static_cast<std::size_t>(scale.parent)];
    scale.undone = above.applied.cwiseInverse();
    scale.from = inherits[n] == FbxInherit::ByAxis ? scale.parent : above.from;
    if (scale.from >= 0) {
      scale.taken = scales[static_cast<std::size_t>(scale.from)].applied;
      scale.applied = scale.applied.cwiseProduct(scale.taken);
    }
  }
  return scales;
}

int unscalable_node(const std::vector<FbxScale>& scales, std::vector<FbxScaleChange> changes,
                    const std::vector<char>& moved) {
  for (std::size_t n = 1; n < scales.size(); ++n) {
    const FbxScale& scale = scales[n];
    if (!scale.apart) {
      continue;
    }
    if (scale.from >= 0) {  // it changes with what it takes over
      changes[n] = std::max(changes[n], changes[static_cast<std::size_t>(scale.from)]);
    }
    const FbxScaleChange above = changes[static_cast<std::size_t>(scale.parent)];
    const bool kept = above == FbxScaleChange::None ||
                      (above == FbxScaleChange::Even && scale.from == scale.parent);
    if (!kept || (moved[n] != 0 && !scale.even())) {
      return static_cast<int>(n);
    }
  }
  return -1;
}

}  // namespace atelier
