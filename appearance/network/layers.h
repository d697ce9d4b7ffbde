#pragma once

#include <map>
#include <string>
#include <vector>

#include <torch/torch.h>

#include "appearance/appearance_model.h"

namespace atelier {

/// Parameters by their names.
using Parts = std::map<std::string, torch::Tensor>;

/// Inputs of the branches and of the shadow network for a surface seen from a viewpoint.
struct ViewInputs {
  torch::Tensor geometry;   ///< [1,3+K,r,r] normal and K terms of light transfer, visible side
  torch::Tensor direction;  ///< [1,3,r,r] to the viewpoint, in that side's tangent frame
  torch::Tensor openness;   ///< [1,K,l,l] light transfer minus its mean, shadow's resolution
};

/// The architecture of a network, without its parameters. Private to appearance/network.
struct Layers {
  NetworkOptions options;
  bool half = false;           ///< convolutions in bfloat16
  torch::Tensor texel_source;  ///< [R*R] texel from which each texel of the result is copied
};

/// Splits a flat vector [N] into parameters, and combines the directions and lengths of weight
/// normalisation into weights, ".w", differentiably.
Parts parts_of(const torch::Tensor& values, const std::vector<ParameterShape>& shapes);

/// [B,3,R,R] textures of a batch of views in linear light, without gain.
torch::Tensor textures_of(const Layers& layers, const Parts& parts,
                          const std::vector<ViewInputs>& batch);

}  // namespace atelier
