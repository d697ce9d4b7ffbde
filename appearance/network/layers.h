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
  torch::Tensor pose_masks;    ///< [1,3J,s,s] where each number of a pose's code is felt
  torch::Tensor uv_grid;       ///< [1,1,T,2] texture coordinates, as grid_sample wants them
  torch::Tensor uv_vertices;   ///< [T] the vertex of each, V: of none
  torch::Tensor uv_counts;     ///< [V+1,1] how many a vertex has, at least 1
};

/// Splits a flat vector [N] into parameters, and combines the directions and lengths of weight
/// normalisation into weights, ".w", differentiably.
Parts parts_of(const torch::Tensor& values, const std::vector<ParameterShape>& shapes);

/// A convolution or, transposed, its adjoint; without a margin of 1 where the kernel is one texel.
torch::Tensor convolved(const Layers& layers, const Parts& parts, const std::string& name,
                        const torch::Tensor& x, int stride, bool transposed);
/// LeakyReLU.
torch::Tensor activated(const torch::Tensor& x);
/// Interpolated to so many texels a side.
torch::Tensor enlarged(const torch::Tensor& x, std::int64_t side);

/// [B,3,R,R] textures of a batch of views in linear light, without gain.
/// @param code  code_features (body_code.h) of each, or undefined
torch::Tensor textures_of(const Layers& layers, const Parts& parts,
                          const std::vector<ViewInputs>& batch, const torch::Tensor& code = {});

}  // namespace atelier
