#include "appearance/network/network.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include <torch/torch.h>

#include "appearance/network/body_code.h"
#include "appearance/network/code_frames.h"
#include "appearance/network/device_memory.h"
#include "appearance/network/layers.h"
#include "appearance/network/peer_tensors.h"
#include "appearance/network/recording.h"
#include "appearance/psnr.h"
#include "core/error.h"
#include "core/random.h"

namespace atelier {
namespace {

namespace nf = torch::nn::functional;

torch::Tensor srgb_of(const torch::Tensor& linear) {
  constexpr double kKnee = 0.0031308;
  const torch::Tensor curve = 1.055 * linear.clamp_min(kKnee).pow(1 / 2.4) - 0.055;
  return torch::where(linear <= kKnee, 12.92 * linear, curve);
}

torch::Tensor unit_rows(const torch::Tensor& rows) {
  constexpr double kLeast = 1e-8;
  return rows / rows.norm(2, 1, true).clamp_min(kLeast);
}

}  // namespace

struct AppearanceNetwork::State {
  /// A surface in one frame, at its vertices (tangents: at its texture coordinates).
  struct Frame {
    torch::Tensor position, normal, tangent, transfer;
  };
  /// A training step's data of one view.
  struct Example {
    ViewInputs inputs;
    torch::Tensor camera;   // [1] its index
    torch::Tensor frame;    // [1] its index
    torch::Tensor grid;     // [1,1,P,2] as grid_sample wants it
    torch::Tensor colors;   // [3,P] bytes
    torch::Tensor counted;  // [P] 1, or 0 where nothing is behind a place
  };
  /// Values that change from step to step, where the device finds them.
  struct Rates {
    torch::Tensor step, decay, spread;  // [] each: see update
    torch::Tensor divergence;           // [] share of its weight
    torch::Tensor part;                 // [] share of a step's pixels that this process has
  };

  Layers layers;
  torch::Device device = torch::kCPU;
  std::vector<ParameterShape> shapes;
  std::vector<std::int64_t> counts;     // numbers of each parameter
  torch::Tensor values;                 // [N] of all of them, one behind the other
  torch::Tensor first, second, decays;  // [N] AdamW's moments; 1: decays
  std::int64_t steps = 0;
  std::vector<torch::Tensor> new_losses;
  torch::Tensor corners, uv_corners;  // [3T] vertices, texture coordinates of each texel's face
  torch::Tensor weights;              // [T,3,1] barycentric
  torch::Tensor texel_rows;           // [R*R] row of each texel, T: none
  torch::Tensor mean_transfer;        // [V,9]
  AppearanceModel described;          // without its parameters
  CodeFrames code;
  CodeLosses code_losses;
  std::vector<Example> examples;  // a view each
  Rates rates;
  Peers* peers = nullptr;           // with whom steps are taken
  Recording recording;              // of a step, on `places`; with peers of its gradient alone
  std::vector<Example> places;      // as many as a batch has, each with room for the largest view
  AdamStep recorded;                // with these constants
  torch::Tensor recorded_loss;      // [2]
  torch::Tensor recorded_gradient;  // [N], with peers
  torch::Tensor noise;              // [B,L] of a step's latent codes, at one place in memory
  Parts fixed;                      // parts_of for drawing, until the next step
  torch::Tensor shown;              // of texture_on_device

  const Parts& parts_for_drawing() {
    if (fixed.empty()) {
      fixed = parts_of(values, shapes);
    }
    return fixed;
  }

  /// [T,C] of rows at the corners of each texel's face.
  torch::Tensor at_texels(const torch::Tensor& rows, const torch::Tensor& of_corners) const {
    return (rows.index_select(0, of_corners).reshape({-1, 3, rows.size(1)}) * weights).sum(1);
  }

  /// [1,C,R,R] of rows [T,C].
  torch::Tensor pictured(const torch::Tensor& rows) const {
    const torch::Tensor padded = nf::pad(rows, nf::PadFuncOptions({0, 0, 0, 1}));
    return padded.index_select(0, texel_rows)
        .t()
        .reshape({1, rows.size(1), layers.options.resolution, layers.options.resolution});
  }

  /// Squares of texels averaged, to so many a side.
  static torch::Tensor coarser(const torch::Tensor& x, std::int64_t side) {
    const std::int64_t ratio = x.size(3) / side;
    return ratio > 1 ? torch::avg_pool2d(x, {ratio, ratio}) : x;
  }
  ViewInputs inputs_of(const Frame& frame, const torch::Tensor& center) const {
    const std::int64_t terms = transfer_terms(layers.options.transfer_degree);
    const auto transfer = [&](const torch::Tensor& rows, std::int64_t begin) {
      return rows.slice(1, begin, begin + terms);
    };
    const torch::Tensor at =
        at_texels(torch::cat({frame.position, frame.normal, transfer(frame.transfer, 0),
                              transfer(frame.transfer, kTransferTerms), transfer(mean_transfer, 0)},
                             1),
                  corners);
    const auto columns = [&](std::int64_t begin, std::int64_t end) {
      return at.slice(1, begin, end);
    };
    const torch::Tensor to = unit_rows(center - columns(0, 3));
    const torch::Tensor normal = unit_rows(columns(3, 6));
    const torch::Tensor height = (to * normal).sum(1, true);
    const torch::Tensor inside = height < 0;
    const torch::Tensor facing = torch::where(inside, -normal, normal);
    const torch::Tensor along = at_texels(frame.tangent, uv_corners);
    const torch::Tensor tangent = unit_rows(along - (along * facing).sum(1, true) * facing);
    const torch::Tensor across = torch::cross(facing, tangent, 1);
    constexpr std::int64_t kOutside = 6;
    const torch::Tensor visible =
        torch::where(inside, transfer(at, kOutside + terms), transfer(at, kOutside));
    const torch::Tensor direction =
        torch::cat({(to * tangent).sum(1, true), (to * across).sum(1, true), height.abs()}, 1);
    const int side = branch_resolution_of(layers.options);
    return {coarser(pictured(torch::cat({facing, visible}, 1)), side),
            coarser(pictured(direction), side),
            coarser(pictured(visible - transfer(at, kOutside + 2 * terms)),
                    shadow_resolution_of(layers.options.resolution))};
  }

  /// [3,P] of one texture [3,R,R] at the places of a grid, as sample_texture.
  static torch::Tensor sampled(const torch::Tensor& texture, const torch::Tensor& grid) {
    return nf::grid_sample(texture.unsqueeze(0), grid,
                           nf::GridSampleFuncOptions()
                               .mode(torch::kBilinear)
                               .padding_mode(torch::kBorder)
                               .align_corners(false))
        .reshape({3, -1});
  }

  /// [1,3]. Filled there: a copy to a GPU would wait for all that it is at.
  torch::Tensor center_of(const Eigen::Vector3d& center) const {
    torch::Tensor place = torch::empty({1, 3}, torch::device(device));
    for (Index i = 0; i < 3; ++i) {
      place.select(1, i).fill_(center[i]);
    }
    return place;
  }

  Frame on_device_of(const SurfaceFrame& frame) const {
    ATELIER_CHECK(frame.position.rows() == mean_transfer.size(0) &&
                      frame.transfer.rows() == frame.position.rows() &&
                      frame.normal.rows() == frame.position.rows(),
                  "the frame has another number of vertices than the network's surface");
    const auto rows = [&](const auto& matrix) {
      return on_device(matrix.data(), {matrix.rows(), matrix.cols()}, device);
    };
    return {rows(frame.position), rows(frame.normal), rows(frame.tangent), rows(frame.transfer)};
  }

  /// [1,3J] of a surface; without columns where the network is not told its pose.
  torch::Tensor pose_of(const FloatRows& position, const std::vector<float>& face = {}) const {
    const std::vector<float> numbers =
        described.parts ? pose_code(*described.parts, position, face) : std::vector<float>();
    return pose_row(numbers);
  }
  torch::Tensor pose_row(const std::vector<float>& numbers) const {
    ATELIER_CHECK(static_cast<int>(numbers.size()) == 3 * layers.options.pose_parts,
                  "the code of a pose has three numbers for each part");
    return on_device(numbers.data(), {1, static_cast<std::int64_t>(numbers.size())}, device);
  }
  /// The features of a pose and a latent code of zeros; undefined without a code.
  torch::Tensor features_of(const torch::Tensor& pose) {
    return has_code(layers.options) ? code_features(layers, parts_for_drawing(), pose, {})
                                    : torch::Tensor();
  }

  /// [3,R,R]
  torch::Tensor texture_of_view(const Frame& frame, const Eigen::Vector3d& center,
                                const torch::Tensor& pose) {
    return textures_of(layers, parts_for_drawing(), {inputs_of(frame, center_of(center))},
                       features_of(pose))[0];
  }

  std::vector<Example> batch_of(const std::vector<int>& batch) const {
    ATELIER_CHECK(!batch.empty(), "a batch has a view");
    std::vector<Example> all;
    for (const int i : batch) {
      ATELIER_CHECK(i >= 0 && i < static_cast<int>(examples.size()), "a view that was not given");
      all.push_back(examples[static_cast<std::size_t>(i)]);
    }
    return all;
  }

  /// [2] the loss, and of it the mean squared difference in sRGB.
  /// @param noise  [B,L] of the latent codes; undefined: their mean
  torch::Tensor batch_loss(const std::vector<Example>& batch, const torch::Tensor& noise) const {
    std::vector<ViewInputs> inputs;
    std::vector<torch::Tensor> frame;
    for (const Example& one : batch) {
      inputs.push_back(one.inputs);
      frame.push_back(one.frame);
    }
    const Parts p = parts_of(values, shapes);
    torch::Tensor features;
    torch::Tensor beside = torch::zeros({}, torch::device(device));
    if (has_code(layers.options)) {
      const torch::Tensor frames = torch::cat(frame, 0);
      torch::Tensor latent;
      if (layers.options.latent > 0) {
        const LatentCode told = encoded_latent(layers, p, code.encoded.index_select(0, frames));
        latent = noise.defined() ? told.mean + told.log_deviation.exp() * noise : told.mean;
        const torch::Tensor divergence = code_losses.divergence * divergence_of(told);
        beside = beside + (noise.defined() ? rates.divergence * divergence : divergence);
      }
      features = code_features(layers, p, code.pose.index_select(0, frames), latent);
      if (layers.options.geometry) {
        beside =
            beside + offset_loss(code, code_losses, surface_offsets(layers, p, features), frames);
      }
    }
    const torch::Tensor& logs = p.at("gain.log");
    const torch::Tensor gains = (logs - logs.mean(0, true)).exp();
    const torch::Tensor drawn = textures_of(layers, p, inputs, features);
    torch::Tensor sum = torch::zeros({}, torch::device(device));
    torch::Tensor places = torch::zeros({}, torch::device(device).dtype(torch::kFloat64));
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const Example& one = batch[i];
      const torch::Tensor shown = sampled(drawn[static_cast<std::int64_t>(i)], one.grid) *
                                  gains.index_select(0, one.camera).t();
      const torch::Tensor off = srgb_of(shown) - one.colors.to(torch::kFloat32) / 255;
      sum = sum + (off.pow(2) * one.counted).sum();
      places = places + one.counted.sum(torch::kFloat64);
    }
    constexpr int kChannels = 3;
    const torch::Tensor mean = sum / (kChannels * places.clamp_min(1)).to(torch::kFloat32);
    return torch::stack({mean + beside, mean});
  }
  torch::Tensor gradient_of(const torch::Tensor& losses) const {
    return torch::autograd::grad({losses[0]}, {values})[0];
  }
  /// What this process has of the gradient of a step that is taken with others: pixels count alike,
  /// whoever has them, and so do the codes of the views, as many in each process.
  torch::Tensor own_gradient_of(const torch::Tensor& losses) const {
    const torch::Tensor beside = losses[0] - losses[1];
    return torch::autograd::grad({rates.part * losses[1] + beside / peers->size()}, {values})[0];
  }

  void set_rates(const AdamStep& by) {
    if (!rates.step.defined()) {
      const auto number = [&] { return torch::zeros({}, torch::device(device)); };
      rates = {number(), number(), number(), number(), number()};
    }
    const auto t = static_cast<double>(steps);
    rates.step.fill_(by.learning_rate / (1 - std::pow(by.beta1, t)));
    rates.decay.fill_(by.learning_rate * by.weight_decay);
    rates.spread.fill_(1 - std::pow(by.beta2, t));
    rates.divergence.fill_(by.divergence);
  }
  /// The views that this process has of a step's, and what share of the pixels they hold.
  std::vector<int> own_of(const std::vector<int>& views) {
    if (peers == nullptr) {
      return views;
    }
    const auto processes = static_cast<std::size_t>(peers->size());
    ATELIER_CHECK(views.size() % processes == 0, "each process has as many views of a step");
    const std::size_t count = views.size() / processes;
    const auto from = views.begin() + static_cast<std::ptrdiff_t>(count) * peers->rank();
    std::vector<int> own(from, from + static_cast<std::ptrdiff_t>(count));
    const auto pixels = [&](const std::vector<int>& of) {
      std::int64_t sum = 0;
      for (const int view : of) {
        sum += examples.at(static_cast<std::size_t>(view)).counted.size(0);
      }
      return static_cast<double>(sum);
    };
    rates.part.fill_(pixels(own) / std::max(1.0, pixels(views)));
    return own;
  }
  /// New noise for this process's views, which seed and step alone decide.
  void set_noise(std::size_t count, std::uint64_t seed) {
    if (layers.options.latent == 0) {
      return;
    }
    const std::vector<std::int64_t> shape = {static_cast<std::int64_t>(count),
                                             layers.options.latent};
    Random random{seed, static_cast<std::uint64_t>(steps)};
    const std::size_t own = count * static_cast<std::size_t>(layers.options.latent);
    const std::size_t before = peers != nullptr ? own * static_cast<std::size_t>(peers->rank()) : 0;
    std::vector<float> numbers(before + own);
    for (float& number : numbers) {
      number = static_cast<float>(normal(random));
    }
    const torch::Tensor drawn = on_device(numbers.data() + before, shape, device);
    if (noise.defined() && noise.sizes() == drawn.sizes()) {
      noise.copy_(drawn);
    } else {
      noise = drawn;
    }
  }
  /// The losses before, and a step of AdamW.
  torch::Tensor update(const std::vector<Example>& batch, const AdamStep& by) {
    const torch::Tensor loss = batch_loss(batch, noise);
    if (peers == nullptr) {
      descend(gradient_of(loss), by);
    } else {
      torch::Tensor gradient = own_gradient_of(loss);
      sum_over(*peers, gradient);
      descend(gradient, by);
    }
    return loss.detach();
  }
  void descend(const torch::Tensor& gradient, const AdamStep& by) {
    const torch::NoGradGuard no_gradients;
    first.mul_(by.beta1).add_(gradient, 1 - by.beta1);
    second.mul_(by.beta2).addcmul_(gradient, gradient, 1 - by.beta2);
    values.mul_(1 - rates.decay * decays);
    values.sub_(first / (second / rates.spread).sqrt_().add_(by.epsilon) * rates.step);
  }

  /// Room for a batch of any views, at the same place in memory in every step.
  void make_places(std::size_t count) {
    std::int64_t most = 0;
    for (const Example& one : examples) {
      most = std::max(most, one.counted.size(0));
    }
    const Example& like = examples.front();
    places.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const ViewInputs inputs = {torch::zeros_like(like.inputs.geometry),
                                 torch::zeros_like(like.inputs.direction),
                                 torch::zeros_like(like.inputs.openness)};
      places.push_back({inputs, torch::zeros_like(like.camera), torch::zeros_like(like.frame),
                        torch::zeros({1, 1, most, 2}, like.grid.options()),
                        torch::zeros({3, most}, like.colors.options()),
                        torch::zeros({most}, like.counted.options())});
    }
  }
  void fill_places(const std::vector<Example>& batch) {
    const torch::NoGradGuard no_gradients;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const Example& from = batch[i];
      const Example& to = places[i];
      const std::int64_t count = from.counted.size(0);
      to.inputs.geometry.copy_(from.inputs.geometry);
      to.inputs.direction.copy_(from.inputs.direction);
      to.inputs.openness.copy_(from.inputs.openness);
      to.camera.copy_(from.camera);
      to.frame.copy_(from.frame);
      to.grid.slice(2, 0, count).copy_(from.grid);
      to.colors.slice(1, 0, count).copy_(from.colors);
      to.counted.slice(0, 0, count).fill_(1);
      to.counted.slice(0, count).fill_(0);
    }
  }
  /// update, recorded at the first step and repeated.
  torch::Tensor repeated_update(const std::vector<Example>& batch, const AdamStep& by) {
    const bool same = !recording.empty() && places.size() == batch.size() &&
                      recorded.beta1 == by.beta1 && recorded.beta2 == by.beta2 &&
                      recorded.epsilon == by.epsilon;
    if (!same) {
      make_places(batch.size());
      fill_places(batch);
      recorded = by;
      if (peers == nullptr) {
        recording.record([&] { gradient_of(batch_loss(places, noise)); },
                         [&] { recorded_loss = update(places, by); });
      } else {
        recording.record([&] { own_gradient_of(batch_loss(places, noise)); },
                         [&] {
                           const torch::Tensor loss = batch_loss(places, noise);
                           recorded_gradient = own_gradient_of(loss);
                           recorded_loss = loss.detach();
                         });
      }
    }
    fill_places(batch);
    recording.repeat();
    if (peers != nullptr) {
      sum_over(*peers, recorded_gradient);
      descend(recorded_gradient, by);
    }
    return recorded_loss.clone();
  }

  /// A value for each number of all parameters, from one for each parameter.
  torch::Tensor joined(const std::map<std::string, Tensor>& of, const std::string& prefix) const {
    std::vector<torch::Tensor> all;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const auto found = of.find(prefix + shapes[i].name);
      ATELIER_CHECK(found != of.end() && found->second.shape == shapes[i].shape,
                    prefix + shapes[i].name + " is missing or of another shape");
      all.push_back(on_device(values_of<float>(found->second).data(), {counts[i]}, device));
    }
    return torch::cat(all, 0);
  }

  void split(const torch::Tensor& of, const std::string& prefix,
             std::map<std::string, Tensor>& all) const {
    const torch::Tensor host = of.detach().to(torch::kCPU);
    const std::vector<torch::Tensor> split = host.split_with_sizes(counts);
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      all[prefix + shapes[i].name] = off_device(split[i].reshape(shapes[i].shape));
    }
  }
};

AppearanceNetwork::AppearanceNetwork(const AppearanceModel& model, Device device, bool half)
    : state_(std::make_unique<State>()) {
  if (device == Device::Cuda && !torch::cuda::is_available()) {
    throw EnvironmentError("CUDA", "libtorch finds no device; use --device cpu");
  }
  State& state = *state_;
  state.layers.options = model.options;
  state.layers.half = half;
  state.described = model;
  state.described.parameters.clear();
  state.device = device == Device::Cuda ? torch::kCUDA : torch::kCPU;
  state.shapes = network_parameters(model.options, static_cast<int>(model.camera_ids.size()));
  std::vector<torch::Tensor> decays;
  for (const ParameterShape& shape : state.shapes) {
    const std::int64_t count = element_count(model.parameters.at(shape.name));
    state.counts.push_back(count);
    const bool fixed = shape.name == "texture.mean" || shape.name == "gain.log";
    decays.push_back(torch::full({count}, fixed ? 0.0 : 1.0, torch::device(state.device)));
  }
  state.values = state.joined(model.parameters, "").requires_grad_(true);
  state.decays = torch::cat(decays, 0);
  state.first = torch::zeros_like(state.decays);
  state.second = torch::zeros_like(state.decays);
  constexpr int kReach = 8;  // coarse texels take what lies beside their chart
  const TexelMap map =
      texel_map(model.faces, model.uvs, model.uv_faces, model.options.resolution, kReach);
  const auto count = static_cast<std::int64_t>(map.covered.size());
  std::vector<std::int64_t> corners;
  std::vector<std::int64_t> uv_corners;
  std::vector<float> weights;
  std::vector<std::int64_t> own(map.source.size(), count);
  for (std::size_t i = 0; i < map.covered.size(); ++i) {
    const auto texel = static_cast<std::size_t>(map.covered[i]);
    own[texel] = static_cast<std::int64_t>(i);
    for (Index k = 0; k < 3; ++k) {
      corners.push_back(model.faces(map.face.data[texel], k));
      uv_corners.push_back(model.uv_faces(map.face.data[texel], k));
      weights.push_back(map.barycentric.data[3 * texel + static_cast<std::size_t>(k)]);
    }
  }
  std::vector<std::int64_t> rows;
  rows.reserve(map.source.size());
  for (const int source : map.source) {
    rows.push_back(own[static_cast<std::size_t>(source)]);
  }
  state.corners = rows_on_device(corners, state.device);
  state.uv_corners = rows_on_device(uv_corners, state.device);
  state.weights = on_device(weights.data(), {count, 3, 1}, state.device);
  state.texel_rows = rows_on_device(rows, state.device);
  state.layers.texel_source =
      rows_on_device(std::vector<std::int64_t>(map.source.begin(), map.source.end()), state.device);
  state.mean_transfer = on_device(model.mean_transfer.data(),
                                  {model.mean_transfer.rows(), kTransferTerms}, state.device);
  if (has_code(model.options)) {
    place_code(state.layers, model, state.device);
  }
}

AppearanceNetwork::~AppearanceNetwork() = default;
AppearanceNetwork::AppearanceNetwork(AppearanceNetwork&&) noexcept = default;
AppearanceNetwork& AppearanceNetwork::operator=(AppearanceNetwork&&) noexcept = default;

Image AppearanceNetwork::texture(const SurfaceFrame& frame, const Eigen::Vector3d& center) const {
  const torch::NoGradGuard no_gradients;
  const Tensor rows = off_device(state_
                                     ->texture_of_view(state_->on_device_of(frame), center,
                                                       state_->pose_of(frame.position, frame.face))
                                     .permute({1, 2, 0}));
  const auto values = values_of<float>(rows);
  Image image(state_->layers.options.resolution, state_->layers.options.resolution, 3);
  std::copy(values.begin(), values.end(), image.data.begin());
  return image;
}

std::vector<float> AppearanceNetwork::colors(const SurfaceFrame& frame,
                                             const Eigen::Vector3d& center,
                                             const TexturePixels& places) const {
  const torch::NoGradGuard no_gradients;
  const torch::Tensor texture = state_->texture_of_view(
      state_->on_device_of(frame), center, state_->pose_of(frame.position, frame.face));
  const Tensor rows =
      off_device(State::sampled(texture, sampling_grid(places.u, places.v, state_->device)).t());
  const auto values = values_of<float>(rows);
  return {values.begin(), values.end()};
}

const float* AppearanceNetwork::texture_on_device(const SurfaceArrays& surface,
                                                  const Eigen::Vector3d& center,
                                                  const std::vector<float>& pose) {
  State& state = *state_;
  ATELIER_CHECK(surface.vertices == state.mean_transfer.size(0),
                "the surface has another number of vertices than the network's");
  const torch::NoGradGuard no_gradients;
  const auto rows = [&](const float* values, Index count, std::int64_t columns) {
    return torch::from_blob(const_cast<float*>(values), {count, columns},
                            torch::device(state.device).dtype(torch::kFloat32));
  };
  const State::Frame frame = {rows(surface.position, surface.vertices, 3),
                              rows(surface.normal, surface.vertices, 3),
                              rows(surface.tangent, surface.coordinates, 3),
                              rows(surface.transfer, surface.vertices, 2 * kTransferTerms)};
  state.shown = state.texture_of_view(frame, center, state.pose_row(pose)).contiguous();
  return state.shown.data_ptr<float>();
}

Points AppearanceNetwork::offsets(const FloatRows& position) const {
  State& state = *state_;
  if (!state.layers.options.geometry) {
    return Points::Zero(position.rows(), 3);
  }
  const torch::NoGradGuard no_gradients;
  const Tensor rows = off_device(surface_offsets(state.layers, state.parts_for_drawing(),
                                                 state.features_of(state.pose_of(position)))[0]);
  return Eigen::Map<const FloatRows>(values_of<float>(rows).data(), position.rows(), 3)
      .cast<double>();
}

void AppearanceNetwork::learn_from(const AppearanceData& data, const CodeLosses& losses) {
  const torch::NoGradGuard no_gradients;
  State& state = *state_;
  state.examples.clear();
  state.recording = {};
  state.code_losses = losses;
  if (has_code(state.layers.options)) {
    state.code = code_frames(state.described, data, state.device);
  }
  std::vector<State::Frame> frames;
  for (const SurfaceFrame& frame : data.frames) {
    frames.push_back(state.on_device_of(frame));
  }
  for (const AppearanceView& view : data.views) {
    ATELIER_CHECK(view.colors.size() == 3 * view.u.size(), "a loss needs colours");
    const auto count = static_cast<std::int64_t>(view.u.size());
    State::Example one;
    one.inputs = state.inputs_of(frames[static_cast<std::size_t>(view.frame_idx)],
                                 state.center_of(data.centers.row(view.camera_idx)));
    one.camera = rows_on_device({view.camera_idx}, state.device);
    one.frame = rows_on_device({view.frame_idx}, state.device);
    one.grid = sampling_grid(view.u, view.v, state.device);
    one.colors = on_device(view.colors.data(), {count, 3}, state.device).t().contiguous();
    one.counted = torch::ones({count}, torch::device(state.device));
    state.examples.push_back(std::move(one));
  }
}

NetworkLoss AppearanceNetwork::loss(const std::vector<int>& views) const {
  const torch::NoGradGuard no_gradients;
  const torch::Tensor losses =
      state_->batch_loss(state_->batch_of(views), {}).to(torch::kCPU, torch::kFloat64);
  return {losses[0].item<double>(), psnr_of(losses[1].item<double>())};
}

std::map<std::string, Tensor> AppearanceNetwork::loss_gradient(
    const std::vector<int>& views) const {
  const torch::Tensor slope = state_->gradient_of(state_->batch_loss(state_->batch_of(views), {}));
  std::map<std::string, Tensor> gradient;
  state_->split(slope, "", gradient);
  return gradient;
}

void AppearanceNetwork::join(Peers& peers) {
  State& state = *state_;
  const torch::NoGradGuard no_gradients;
  if (peers.rank() > 0) {
    state.values.zero_();
    state.first.zero_();
    state.second.zero_();
  }
  for (torch::Tensor* of_first : {&state.values, &state.first, &state.second}) {
    torch::Tensor numbers = of_first->detach();
    sum_over(peers, numbers);
  }
  state.peers = &peers;
  state.recording = {};
}

void AppearanceNetwork::step(const std::vector<int>& views, const AdamStep& options) {
  State& state = *state_;
  state.fixed.clear();
  ++state.steps;
  state.set_rates(options);
  const std::vector<int> own = state.own_of(views);
  state.set_noise(own.size(), options.seed);
  const std::vector<State::Example> batch = state.batch_of(own);
  const bool repeats = state.device.is_cuda() && Recording::possible();
  state.new_losses.push_back(repeats ? state.repeated_update(batch, options)
                                     : state.update(batch, options));
}

std::vector<NetworkLoss> AppearanceNetwork::losses() {
  std::vector<NetworkLoss> all;
  if (!state_->new_losses.empty()) {
    torch::Tensor own = torch::stack(state_->new_losses);
    if (state_->peers != nullptr) {
      own = gathered(*state_->peers, own).transpose(0, 1).reshape({-1, 2});
    }
    const torch::Tensor values = own.to(torch::kCPU, torch::kFloat64);
    for (std::int64_t i = 0; i < values.size(0); ++i) {
      all.push_back({values[i][0].item<double>(), psnr_of(values[i][1].item<double>())});
    }
    state_->new_losses.clear();
  }
  return all;
}

void AppearanceNetwork::center_codes() {
  State& state = *state_;
  if (state.layers.options.latent == 0) {
    return;
  }
  const torch::NoGradGuard no_gradients;
  state.fixed.clear();
  const Parts p = parts_of(state.values, state.shapes);
  const torch::Tensor mean = encoded_latent(state.layers, p, state.code.encoded).mean.mean(0);
  // Parameters lie in `values`, so that these are the numbers themselves.
  torch::Tensor encoder = p.at("encoder.mean.b");
  torch::Tensor decoder = p.at("latent.first.b");
  encoder.sub_(mean);
  decoder.add_(torch::mv(p.at("latent.first.w").flatten(1), mean));
}

std::map<std::string, Tensor> AppearanceNetwork::parameters() const {
  std::map<std::string, Tensor> all;
  state_->split(state_->values, "", all);
  return all;
}

std::map<std::string, Tensor> AppearanceNetwork::moments() const {
  std::map<std::string, Tensor> all;
  state_->split(state_->first, "m.", all);
  state_->split(state_->second, "v.", all);
  return all;
}

std::int64_t AppearanceNetwork::steps() const {
  return state_->steps;
}

void AppearanceNetwork::resume(const std::map<std::string, Tensor>& moments, std::int64_t steps) {
  state_->first = state_->joined(moments, "m.");
  state_->second = state_->joined(moments, "v.");
  state_->recording = {};
  state_->steps = steps;
}

}  // namespace atelier
