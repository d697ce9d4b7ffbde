#pragma once

#include <map>
#include <string>
#include <vector>

#include <torch/torch.h>

#include "appearance/appearance_model.h"

namespace atelier {

/// Parameters by their names.
using Parts = std::map<std::string, torch::Tensor>;

/// What the branches and the shadow take of a surface seen from a point: [1,3+K,r,r] normal and
/// light transfer, of K terms, of the side that is seen, [1,3,r,r] direction to the point in that
/// side's tangent frame, at the branches' resolution, and [1,K,l,l] the transfer minus its mean at
/// the shadow's.
struct ViewInputs {
  torch::Tensor geometry, direction, openness;
};

/// The network without what it has learnt. Private to appearance/network.
struct Layers {
  NetworkOptions options;
  bool half = false;           ///< convolutions in bfloat16
  torch::Tensor texel_source;  ///< [R*R] what each texel of the finished texture shows
};

/// Parameters of a flat list [N], with directions and lengths brought together as weights, ".w"
/// (weight normalisation), and what differentiates through them.
Parts parts_of(const torch::Tensor& values, const std::vector<ParameterShape>& shapes);

/// [B,3,R,R] textures of a batch of views in linear light, without gain.
torch::Tensor textures_of(const Layers& layers, const Parts& parts,
                          const std::vector<ViewInputs>& batch);

}  // namespace atelier
