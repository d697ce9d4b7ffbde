#include "appearance/network/network.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include <torch/torch.h>

#include "core/error.h"

namespace atelier {
namespace {

namespace nf = torch::nn::functional;
using Parameters = std::map<std::string, torch::Tensor>;

constexpr double kSlope = 0.2;
constexpr int kLeastSide = 8;

torch::Tensor on_device(const Tensor& tensor, torch::Device device) {
  const auto values = values_of<float>(tensor);
  return torch::from_blob(const_cast<float*>(values.data()), tensor.shape, torch::kFloat32)
      .clone()
      .to(device);
}

Tensor off_device(const torch::Tensor& tensor) {
  const torch::Tensor host = tensor.detach().to(torch::kCPU, torch::kFloat32).contiguous();
  return tensor_of(
      std::span<const float>(host.data_ptr<float>(), static_cast<std::size_t>(host.numel())),
      host.sizes().vec());
}

/// The rows of covered texels [T,C] and where in the texture they go: [R*R] row of each texel, T
/// for those that stay 0.
torch::Tensor rows_of_texels(const TexelMap& map) {
  const auto count = static_cast<std::int64_t>(map.covered.size());
  std::vector<std::int64_t> own(map.source.size(), count);
  for (std::size_t i = 0; i < map.covered.size(); ++i) {
    own[static_cast<std::size_t>(map.covered[i])] = static_cast<std::int64_t>(i);
  }
  std::vector<std::int64_t> rows(map.source.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i] = own[static_cast<std::size_t>(map.source[i])];
  }
  return torch::tensor(rows, torch::kInt64);
}

torch::Tensor matrix(const float* values, std::int64_t rows, std::int64_t columns,
                     torch::Device device) {
  return torch::from_blob(const_cast<float*>(values), {rows, columns}, torch::kFloat32)
      .clone()
      .to(device);
}

torch::Tensor srgb_of(const torch::Tensor& linear) {
  constexpr double kKnee = 0.0031308;
  const torch::Tensor curve = 1.055 * linear.clamp_min(kKnee).pow(1 / 2.4) - 0.055;
  return torch::where(linear <= kKnee, 12.92 * linear, curve);
}

}  // namespace

struct AppearanceNetwork::State {
  NetworkOptions options;
  torch::Device device = torch::kCPU;
  Parameters parameters;
  Parameters first, second;  // AdamW's moments
  std::int64_t steps = 0;
  torch::Tensor texel_rows;       // [R*R]
  torch::Tensor shadow_rows;      // [L*L]
  torch::Tensor texel_source;     // [R*R] what each texel of the finished texture shows
  torch::Tensor mean_visibility;  // [T_L,1]
  int shadow_side = 0;

  torch::Tensor convolved(const std::string& name, const torch::Tensor& x, int stride,
                          bool transposed) const {
    const torch::Tensor& v = parameters.at(name + ".v");
    const std::vector<std::int64_t> others =
        transposed ? std::vector<std::int64_t>{0, 2, 3} : std::vector<std::int64_t>{1, 2, 3};
    const torch::Tensor weight =
        v * (parameters.at(name + ".g") / v.pow(2).sum(others, true).sqrt());
    const torch::Tensor& bias = parameters.at(name + ".b");
    const bool each_texel = bias.dim() == 3;
    const torch::Tensor channel_bias = each_texel ? torch::Tensor() : bias;
    const torch::Tensor y = transposed ? torch::conv_transpose2d(x, weight, channel_bias, stride, 1)
                                       : torch::conv2d(x, weight, channel_bias, stride, 1);
    return each_texel ? y + bias : y;
  }
  torch::Tensor activated(const torch::Tensor& x) const { return torch::leaky_relu(x, kSlope); }

  /// What a branch gives, and the features before its last convolution.
  struct Branch {
    torch::Tensor output, features;
  };
  Branch unet(const std::string& name, const torch::Tensor& inputs) const {
    const int levels = std::bit_width(static_cast<unsigned>(options.resolution / kLeastSide)) - 1;
    std::vector<torch::Tensor> down = {activated(convolved(name + ".first", inputs, 1, false))};
    for (int level = 0; level < levels; ++level) {
      down.push_back(
          activated(convolved(name + ".down" + std::to_string(level), down.back(), 2, false)));
    }
    torch::Tensor x = down.back();
    for (int level = levels - 1; level >= 0; --level) {
      // Over the root of 2: the sum of two has the variance of one.
      x = (activated(convolved(name + ".up" + std::to_string(level), x, 2, true)) +
           down[static_cast<std::size_t>(level)]) *
          std::numbers::sqrt2 / 2;
    }
    return {convolved(name + ".last", torch::cat({x, inputs}, 1), 1, false), x};
  }

  /// [1,C,side,side] of rows [T,C].
  static torch::Tensor pictured(const torch::Tensor& rows, const torch::Tensor& rows_of,
                                std::int64_t side) {
    const torch::Tensor padded = nf::pad(rows, nf::PadFuncOptions({0, 0, 0, 1}));
    return padded.index_select(0, rows_of).t().reshape({1, rows.size(1), side, side});
  }

  /// [B,3,R,R] in linear light, without gain.
  torch::Tensor textures(const std::vector<NetworkView>& batch) const {
    const std::int64_t side = options.resolution;
    const auto count = static_cast<std::int64_t>(batch.size());
    std::vector<torch::Tensor> geometry;
    std::vector<torch::Tensor> directions;
    std::vector<torch::Tensor> openness;
    for (const NetworkView& view : batch) {
      const GeometryMaps& maps = view.frame->geometry;
      const std::int64_t rows = maps.position.rows();
      const torch::Tensor visible =
          matrix(view.frame->visibility.data(), view.frame->visibility.size(), 1, device);
      openness.push_back(pictured(visible - mean_visibility, shadow_rows, shadow_side));
      geometry.push_back(
          torch::cat({pictured(matrix(maps.normal.data(), rows, 3, device), texel_rows, side),
                      enlarged(pictured(visible, shadow_rows, shadow_side))},
                     1));
      const auto towards = view_directions(maps, view.center);
      directions.push_back(pictured(matrix(towards.data(), rows, 3, device), texel_rows, side));
    }
    torch::Tensor share = torch::ones({count, 3, side, side}, torch::device(device));
    torch::Tensor features = torch::cat(geometry, 0);
    if (options.view_independent) {
      const Branch branch = unet("independent", features);
      share = share + branch.output;
      features = branch.features;
    }
    if (options.view_dependent) {
      share =
          share + unet("dependent", torch::cat({torch::cat(directions, 0), features}, 1)).output;
    }
    if (options.shadow) {
      torch::Tensor x = torch::cat(openness, 0);
      x = activated(convolved("shadow.first", x, 1, false));
      x = activated(convolved("shadow.middle", x, 1, false));
      share = share * enlarged(torch::sigmoid(convolved("shadow.last", x, 1, false)));
    }
    return (share * parameters.at("texture.mean"))
        .reshape({count, 3, side * side})
        .index_select(2, texel_source)
        .reshape({count, 3, side, side});
  }

  torch::Tensor enlarged(const torch::Tensor& x) const {
    return nf::interpolate(
        x, nf::InterpolateFuncOptions()
               .size(std::vector<std::int64_t>{options.resolution, options.resolution})
               .mode(torch::kBilinear)
               .align_corners(false));
  }

  /// [3,P] of one texture [3,R,R] at the view's pixels, as sample_texture; gain applied.
  torch::Tensor sampled(const torch::Tensor& texture, const NetworkView& view) const {
    const auto count = static_cast<std::int64_t>(view.pixels->u.size());
    const torch::Tensor u = matrix(view.pixels->u.data(), count, 1, device);
    const torch::Tensor v = matrix(view.pixels->v.data(), count, 1, device);
    const torch::Tensor grid = torch::cat({2 * u - 1, 1 - 2 * v}, 1).reshape({1, 1, count, 2});
    const torch::Tensor colors = nf::grid_sample(texture.unsqueeze(0), grid,
                                                 nf::GridSampleFuncOptions()
                                                     .mode(torch::kBilinear)
                                                     .padding_mode(torch::kBorder)
                                                     .align_corners(false))
                                     .reshape({3, count});
    if (view.camera_idx < 0) {
      return colors;
    }
    const torch::Tensor& logs = parameters.at("gain.log");
    const torch::Tensor gain = (logs[view.camera_idx] - logs.mean(0)).exp();
    return colors * gain.unsqueeze(1);
  }

  torch::Tensor batch_loss(const std::vector<NetworkView>& batch) const {
    ATELIER_CHECK(!batch.empty(), "a batch has a view");
    const torch::Tensor drawn = textures(batch);
    torch::Tensor sum = torch::zeros({}, torch::TensorOptions().device(device));
    std::int64_t numbers = 0;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto count = static_cast<std::int64_t>(batch[i].pixels->u.size());
      ATELIER_CHECK(batch[i].pixels->colors.size() == 3 * batch[i].pixels->u.size(),
                    "a loss needs colours");
      const torch::Tensor shown = sampled(drawn[static_cast<std::int64_t>(i)], batch[i]);
      const torch::Tensor wanted = matrix(batch[i].pixels->colors.data(), count, 3, device).t();
      sum = sum + (srgb_of(shown) - srgb_of(wanted)).pow(2).sum();
      numbers += 3 * count;
    }
    return sum / static_cast<double>(std::max<std::int64_t>(numbers, 1));
  }

  /// The same with gradients in the parameters.
  NetworkLoss differentiated(const std::vector<NetworkView>& batch) {
    for (auto& [name, parameter] : parameters) {
      parameter.mutable_grad() = torch::Tensor();
    }
    const torch::Tensor loss = batch_loss(batch);
    loss.backward();
    return loss_of(loss);
  }

  static NetworkLoss loss_of(const torch::Tensor& loss) {
    const auto value = loss.item<double>();
    return {value, -10 * std::log10(std::max(value, 1e-12))};
  }
};

AppearanceNetwork::AppearanceNetwork(const AppearanceModel& model, Device device)
    : state_(std::make_unique<State>()) {
  if (device == Device::Cuda && !torch::cuda::is_available()) {
    throw EnvironmentError("CUDA", "libtorch finds no device; use the device \"cpu\"");
  }
  State& state = *state_;
  state.options = model.options;
  state.device = device == Device::Cuda ? torch::kCUDA : torch::kCPU;
  state.shadow_side = shadow_resolution_of(model.options.resolution);
  for (const ParameterShape& shape :
       network_parameters(model.options, static_cast<int>(model.camera_ids.size()))) {
    torch::Tensor parameter = on_device(model.parameters.at(shape.name), state.device);
    state.first[shape.name] = torch::zeros_like(parameter);
    state.second[shape.name] = torch::zeros_like(parameter);
    state.parameters[shape.name] = parameter.requires_grad_(true);
  }
  const TexelMap texels =
      texel_map(model.faces, model.uvs, model.uv_faces, model.options.resolution);
  const TexelMap shadow = texel_map(model.faces, model.uvs, model.uv_faces, state.shadow_side);
  state.texel_rows = rows_of_texels(texels).to(state.device);
  state.shadow_rows = rows_of_texels(shadow).to(state.device);
  state.texel_source =
      torch::tensor(std::vector<std::int64_t>(texels.source.begin(), texels.source.end()),
                    torch::kInt64)
          .to(state.device);
  state.mean_visibility =
      matrix(model.mean_visibility.data(), model.mean_visibility.size(), 1, state.device);
}

AppearanceNetwork::~AppearanceNetwork() = default;
AppearanceNetwork::AppearanceNetwork(AppearanceNetwork&&) noexcept = default;
AppearanceNetwork& AppearanceNetwork::operator=(AppearanceNetwork&&) noexcept = default;

Image AppearanceNetwork::texture(const NetworkView& view) const {
  const torch::NoGradGuard no_gradients;
  const Tensor rows = off_device(state_->textures({view})[0].permute({1, 2, 0}));
  const auto values = values_of<float>(rows);
  Image image(state_->options.resolution, state_->options.resolution, 3);
  std::copy(values.begin(), values.end(), image.data.begin());
  return image;
}

std::vector<float> AppearanceNetwork::colors(const NetworkView& view) const {
  const torch::NoGradGuard no_gradients;
  const Tensor rows = off_device(state_->sampled(state_->textures({view})[0], view).t());
  const auto values = values_of<float>(rows);
  return {values.begin(), values.end()};
}

NetworkLoss AppearanceNetwork::loss(const std::vector<NetworkView>& batch) const {
  const torch::NoGradGuard no_gradients;
  return State::loss_of(state_->batch_loss(batch));
}

std::map<std::string, Tensor> AppearanceNetwork::loss_gradient(
    const std::vector<NetworkView>& batch) const {
  state_->differentiated(batch);
  std::map<std::string, Tensor> gradient;
  for (const auto& [name, parameter] : state_->parameters) {
    gradient[name] =
        off_device(parameter.grad().defined() ? parameter.grad() : torch::zeros_like(parameter));
  }
  return gradient;
}

NetworkLoss AppearanceNetwork::step(const std::vector<NetworkView>& batch,
                                    const AdamStep& options) {
  State& state = *state_;
  const NetworkLoss loss = state.differentiated(batch);
  if (!std::isfinite(loss.value)) {
    return loss;
  }
  const torch::NoGradGuard no_gradients;
  ++state.steps;
  const auto t = static_cast<double>(state.steps);
  const double correction1 = 1 - std::pow(options.beta1, t);
  const double correction2 = 1 - std::pow(options.beta2, t);
  for (auto& [name, parameter] : state.parameters) {
    const torch::Tensor gradient = parameter.grad();
    if (!gradient.defined()) {
      continue;
    }
    torch::Tensor& m = state.first.at(name);
    torch::Tensor& v = state.second.at(name);
    m.mul_(options.beta1).add_(gradient, 1 - options.beta1);
    v.mul_(options.beta2).addcmul_(gradient, gradient, 1 - options.beta2);
    if (name != "texture.mean" && name != "gain.log") {
      parameter.mul_(1 - options.learning_rate * options.weight_decay);
    }
    const torch::Tensor scale = (v / correction2).sqrt_().add_(options.epsilon);
    parameter.addcdiv_(m, scale, -options.learning_rate / correction1);
  }
  return loss;
}

std::map<std::string, Tensor> AppearanceNetwork::parameters() const {
  std::map<std::string, Tensor> all;
  for (const auto& [name, parameter] : state_->parameters) {
    all[name] = off_device(parameter);
  }
  return all;
}

std::map<std::string, Tensor> AppearanceNetwork::moments() const {
  std::map<std::string, Tensor> all;
  for (const auto& [name, moment] : state_->first) {
    all["m." + name] = off_device(moment);
    all["v." + name] = off_device(state_->second.at(name));
  }
  return all;
}

std::int64_t AppearanceNetwork::steps() const {
  return state_->steps;
}

void AppearanceNetwork::resume(const std::map<std::string, Tensor>& moments, std::int64_t steps) {
  for (auto& [name, moment] : state_->first) {
    const auto m = moments.find("m." + name);
    const auto v = moments.find("v." + name);
    ATELIER_CHECK(m != moments.end() && v != moments.end() &&
                      m->second.shape == moment.sizes().vec() &&
                      v->second.shape == moment.sizes().vec(),
                  "moments of " + name + " are missing or of another shape");
    moment = on_device(m->second, state_->device);
    state_->second.at(name) = on_device(v->second, state_->device);
  }
  state_->steps = steps;
}

}  // namespace atelier
