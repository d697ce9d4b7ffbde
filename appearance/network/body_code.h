#pragma once

#include "appearance/network/layers.h"

namespace atelier {

/// Latent codes of a batch, as normal distributions. Private to appearance/network.
struct LatentCode {
  torch::Tensor mean, log_deviation;  ///< [B,L]
};

LatentCode encoded_latent(const Layers& layers, const Parts& parts, const torch::Tensor& encoded);

/// Kullback and Leibler's divergence from the standard normal distribution, sum over the numbers of
/// the code, mean over the batch.
torch::Tensor divergence_of(const LatentCode& code);

/// [B,C,s,s] the features of pose and latent code.
/// @param latent  [B,L]; undefined: zeros, as drawing has it
torch::Tensor code_features(const Layers& layers, const Parts& parts, const torch::Tensor& pose,
                            const torch::Tensor& latent);

/// [B,V,3] metres in the axes of the surface, from these features.
torch::Tensor surface_offsets(const Layers& layers, const Parts& parts,
                              const torch::Tensor& features);

}  // namespace atelier
