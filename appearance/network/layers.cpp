#include "appearance/network/layers.h"

#include <numbers>

namespace atelier {
namespace {

namespace nf = torch::nn::functional;

/// A branch's output, and the features before its last convolution.
struct Branch {
  torch::Tensor output, features;
};

}  // namespace

torch::Tensor convolved(const Layers& layers, const Parts& p, const std::string& name,
                        const torch::Tensor& x, int stride, bool transposed) {
  torch::Tensor weight = p.at(name + ".w");
  torch::Tensor bias = p.at(name + ".b");
  torch::Tensor input = x;
  if (layers.half) {
    weight = weight.to(torch::kBFloat16);
    bias = bias.to(torch::kBFloat16);
    input = input.to(torch::kBFloat16);
  }
  const bool each_texel = bias.dim() == 3;
  const torch::Tensor channel_bias = each_texel ? torch::Tensor() : bias;
  const std::int64_t margin = weight.size(2) > 1 ? 1 : 0;
  const torch::Tensor y = transposed
                              ? torch::conv_transpose2d(input, weight, channel_bias, stride, margin)
                              : torch::conv2d(input, weight, channel_bias, stride, margin);
  return each_texel ? y + bias : y;
}

torch::Tensor activated(const torch::Tensor& x) {
  constexpr double kSlope = 0.2;
  return torch::leaky_relu(x, kSlope);
}

torch::Tensor enlarged(const torch::Tensor& x, std::int64_t side) {
  return nf::interpolate(x, nf::InterpolateFuncOptions()
                                .size(std::vector<std::int64_t>{side, side})
                                .mode(torch::kBilinear)
                                .align_corners(false));
}

namespace {

Branch unet(const Layers& layers, const Parts& p, const std::string& name,
            const torch::Tensor& inputs) {
  const auto layer = [&](const std::string& which, const torch::Tensor& x, int stride,
                         bool transposed) {
    return activated(convolved(layers, p, name + which, x, stride, transposed));
  };
  const int levels = branch_levels_of(layers.options);
  std::vector<torch::Tensor> down = {layer(".first", inputs, 1, false)};
  for (int level = 0; level < levels; ++level) {
    down.push_back(layer(".down" + std::to_string(level), down.back(), 2, false));
  }
  torch::Tensor x = down.back();
  for (int level = levels - 1; level >= 0; --level) {
    // Over the root of 2: the sum of two has the variance of one.
    x = (layer(".up" + std::to_string(level), x, 2, true) + down[static_cast<std::size_t>(level)]) *
        (std::numbers::sqrt2 / 2);
  }
  const torch::Tensor all = torch::cat({x, inputs.to(x.scalar_type())}, 1);
  return {convolved(layers, p, name + ".last", all, 1, false).to(torch::kFloat32), x};
}

}  // namespace

Parts parts_of(const torch::Tensor& values, const std::vector<ParameterShape>& shapes) {
  std::vector<std::int64_t> counts;
  for (const ParameterShape& shape : shapes) {
    counts.push_back(c10::multiply_integers(shape.shape));
  }
  const std::vector<torch::Tensor> split = values.split_with_sizes(counts);
  Parts all;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    all[shapes[i].name] = split[i].reshape(shapes[i].shape);
  }
  for (const ParameterShape& shape : shapes) {
    if (!shape.name.ends_with(".v")) {
      continue;
    }
    const std::string name = shape.name.substr(0, shape.name.size() - 2);
    const bool transposed = name.find(".up") != std::string::npos;
    const std::vector<std::int64_t> others =
        transposed ? std::vector<std::int64_t>{0, 2, 3} : std::vector<std::int64_t>{1, 2, 3};
    const torch::Tensor& v = all.at(shape.name);
    all[name + ".w"] = v * (all.at(name + ".g") / v.pow(2).sum(others, true).sqrt());
  }
  return all;
}

torch::Tensor textures_of(const Layers& layers, const Parts& p,
                          const std::vector<ViewInputs>& batch, const torch::Tensor& code) {
  const NetworkOptions& options = layers.options;
  const std::int64_t side = options.resolution;
  const auto count = static_cast<std::int64_t>(batch.size());
  std::vector<torch::Tensor> geometry;
  std::vector<torch::Tensor> directions;
  std::vector<torch::Tensor> openness;
  for (const ViewInputs& one : batch) {
    geometry.push_back(one.geometry);
    directions.push_back(one.direction);
    openness.push_back(one.openness);
  }
  const std::int64_t branch_side = branch_resolution_of(options);
  torch::Tensor features = torch::cat(geometry, 0);
  if (code.defined()) {
    features = torch::cat({features, enlarged(code, branch_side).to(features.scalar_type())}, 1);
  }
  torch::Tensor share =
      torch::ones({count, 3, branch_side, branch_side}, torch::device(features.device()));
  if (code.defined()) {
    share = share + enlarged(convolved(layers, p, "code.last", code, 1, false).to(torch::kFloat32),
                             branch_side);
  }
  if (options.view_independent) {
    const Branch branch = unet(layers, p, "independent", features);
    share = share + branch.output;
    features = branch.features;
  }
  if (options.view_dependent) {
    const torch::Tensor direction = torch::cat(directions, 0).to(features.scalar_type());
    share = share + unet(layers, p, "dependent", torch::cat({direction, features}, 1)).output;
  }
  share = branch_side < side ? enlarged(share, side) : share;
  if (options.shadow) {
    torch::Tensor x = torch::cat(openness, 0);
    x = activated(convolved(layers, p, "shadow.first", x, 1, false));
    x = activated(convolved(layers, p, "shadow.middle", x, 1, false));
    x = torch::sigmoid(convolved(layers, p, "shadow.last", x, 1, false).to(torch::kFloat32));
    share = share * enlarged(x, side);
  }
  return (share * p.at("texture.mean"))
      .reshape({count, 3, side * side})
      .index_select(2, layers.texel_source)
      .reshape({count, 3, side, side});
}

}  // namespace atelier
