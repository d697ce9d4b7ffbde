#include "appearance/network/body_code.h"

namespace atelier {
namespace {

namespace nf = torch::nn::functional;

/// [B,C] through a convolution of one texel.
torch::Tensor linear(const Layers& layers, const Parts& p, const std::string& name,
                     const torch::Tensor& rows) {
  return convolved(layers, p, name, rows.reshape({rows.size(0), -1, 1, 1}), 1, false)
      .to(torch::kFloat32)
      .flatten(1);
}

}  // namespace

LatentCode encoded_latent(const Layers& layers, const Parts& p, const torch::Tensor& encoded) {
  // Codes begin narrow: behind noise as wide as the prior nothing of a frame is heard, and decoders
  // learn to do without it.
  constexpr double kNarrow = 2;
  torch::Tensor x = encoded;
  for (int level = 0; level < code_levels_of(layers.options); ++level) {
    x = activated(convolved(layers, p, "encoder.down" + std::to_string(level), x, 2, false));
  }
  return {linear(layers, p, "encoder.mean", x), linear(layers, p, "encoder.spread", x) - kNarrow};
}

torch::Tensor divergence_of(const LatentCode& code) {
  const torch::Tensor& log = code.log_deviation;
  return 0.5 * (code.mean.pow(2) + (2 * log).exp() - 1 - 2 * log).sum(1).mean();
}

torch::Tensor code_features(const Layers& layers, const Parts& p, const torch::Tensor& pose,
                            const torch::Tensor& latent) {
  const NetworkOptions& options = layers.options;
  std::vector<torch::Tensor> features;
  if (options.latent > 0) {
    const torch::Tensor rows =
        latent.defined() ? latent : torch::zeros({pose.size(0), options.latent}, pose.options());
    torch::Tensor x = activated(linear(layers, p, "latent.first", rows))
                          .reshape({rows.size(0), -1, kLatentSide, kLatentSide});
    for (int level = code_levels_of(options) - 1; level >= 0; --level) {
      x = activated(convolved(layers, p, "latent.up" + std::to_string(level), x, 2, true));
    }
    features.push_back(x.to(torch::kFloat32));
  }
  if (options.pose_parts > 0) {
    const torch::Tensor spread =
        pose.reshape({pose.size(0), pose.size(1), 1, 1}) * layers.pose_masks;
    features.push_back(
        activated(convolved(layers, p, "pose.first", spread, 1, false)).to(torch::kFloat32));
  }
  return activated(convolved(layers, p, "code.join", torch::cat(features, 1), 1, false))
      .to(torch::kFloat32);
}

torch::Tensor surface_offsets(const Layers& layers, const Parts& p, const torch::Tensor& features) {
  constexpr double kUnit = 0.01;  // m: weights of 1 move skin as far as it moves
  const torch::Tensor x = activated(convolved(layers, p, "offset.up0", features, 2, true));
  const torch::Tensor map =
      kUnit * convolved(layers, p, "offset.last", x, 1, false).to(torch::kFloat32);
  const std::int64_t count = features.size(0);
  const torch::Tensor at = nf::grid_sample(map, layers.uv_grid.expand({count, -1, -1, -1}),
                                           nf::GridSampleFuncOptions()
                                               .mode(torch::kBilinear)
                                               .padding_mode(torch::kBorder)
                                               .align_corners(false))
                               .reshape({count, 3, -1})
                               .permute({0, 2, 1});
  // Of a vertex on a seam the mean of its places, so that no seam opens.
  const torch::Tensor sum = torch::zeros({count, layers.uv_counts.size(0), 3}, features.options())
                                .index_add(1, layers.uv_vertices, at);
  return (sum / layers.uv_counts).narrow(1, 0, layers.uv_counts.size(0) - 1);
}

}  // namespace atelier
