#include "appearance/train_options.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "appearance/side_problem.h"
#include "core/error.h"
#include "core/random.h"

namespace atelier {

OptionTable describe(TrainOptions& options) {
  OptionTable table;
  table.add("setting", options.setting,
            {{"auto", TrainSetting::Auto},
             {"small", TrainSetting::Small},
             {"standard", TrainSetting::Standard},
             {"full", TrainSetting::Full}},
            "Size of the networks and length of training: small takes a minute on a CPU, standard "
            "minutes on a GPU; auto: standard on a GPU, else small");
  table.add("resolution", options.resolution, 0, 2048, "",
            "Side of the texture in texels, a power of 2 from 16; 0: as the setting has it");
  table.add("channels", options.channels, 0, 128, "",
            "Channels of the first level of the networks; 0: as the setting has it");
  table.add("learning_rate", options.learning_rate, 0, 1, "",
            "Highest learning rate, which decays to a tenth; 0: as the setting has it");
  table.add("iterations", options.iterations, 0, 10'000'000, "",
            "Number of training steps; 0: as the setting has it");
  table.add("shading", options.shading, 0, 16, "",
            "Texels of the texture along one texel of the branches, a power of 2; 0: as the "
            "setting has it");
  table.add("batch", options.batch, 1, 64, "",
            "Number of views in a training step; fewer take less memory");
  table.add("weight_decay", options.weight_decay, -1, 1, "",
            "Weight decay of the convolutions; below 0: as the setting has it");
  table.add("view_independent", options.view_independent,
            "Branch that does not depend on the camera; without both branches a mean texture is "
            "all there is");
  table.add("view_dependent", options.view_dependent,
            "Branch that depends on the camera; off for comparison");
  table.add("shadow", options.shadow, "Shadow network; off for comparison");
  table.add("transfer_degree", options.transfer_degree, 0, kLargestTransferDegree, "",
            "Degree of the spherical harmonics of the light transfer; 0: ambient visibility alone");
  table.add("pixel_bias", options.pixel_bias, "Bias for each texel instead of each channel");
  table.add("smoothness", options.smoothness, 0, 1000, "px",
            "Number of pixels as which the likeness of neighbouring texels counts in the mean "
            "texture that training begins with; 0: none");
  table.add("half", options.half,
            "Convolutions in bfloat16, which take half the memory; not faster where measured");
  table
      .add("checkpoint_every", options.checkpoint_every, 0, 1'000'000, "",
           "Training steps between checkpoints; 0: 100, or as many as keep saving below a "
           "twentieth of the time")
      .not_keyed();
  table
      .add("processes", options.processes, 1, kMostProcesses, "",
           "Number of processes on this machine that train together, on a GPU each: each takes "
           "steps of its own, and all are of one update")
      .not_keyed();
  table.add("seed", options.seed, 0, 1e15, "",
            "Seed of the initial weights and of the order of views");
  return table;
}

OptionTable describe_with_code(TrainOptions& options) {
  constexpr double kMost = 1e6;
  OptionTable code;
  code.add("pose", options.code.pose,
           "Conditioning of texture and geometry on the turns of the body's parts");
  code.add("latent", options.code.latent, -1, kMaxLatent, "",
           "Length of the latent code of what else differs between frames; 0: no variational "
           "autoencoder; below 0: as the setting has it");
  code.add("geometry", options.code.geometry, "Geometry that depends on pose and latent code");
  code.add("divergence", options.code.losses.divergence, 0, kMost, "",
           "Weight of the latent codes' divergence from the standard normal distribution, in nats");
  code.add("geometry_weight", options.code.losses.geometry, 0, kMost, "",
           "Weight of squared distances from the registered surfaces, in units of 5 mm");
  code.add("bending_weight", options.code.losses.bending, 0, kMost, "",
           "Weight of the squared difference of these distances along edges");
  OptionTable table = describe(options);
  table.add("code", code);
  return table;
}

TrainOptions resolved(const TrainOptions& options, Device device) {
  struct Numbers {
    int resolution, channels, shading, iterations, latent;
    double learning_rate, weight_decay;
  };
  TrainOptions result = options;
  if (options.setting == TrainSetting::Auto) {
    result.setting = device == Device::Cuda ? TrainSetting::Standard : TrainSetting::Small;
  }
  const Numbers numbers =
      result.setting == TrainSetting::Small      ? Numbers{256, 8, 2, 300, 32, 1e-3, 0.01}
      : result.setting == TrainSetting::Standard ? Numbers{512, 16, 2, 20'000, 256, 5e-4, 0.3}
                                                 : Numbers{1024, 32, 4, 100'000, 1024, 1e-4, 0.3};
  result.resolution = options.resolution > 0 ? options.resolution : numbers.resolution;
  result.shading = options.shading > 0 ? options.shading : numbers.shading;
  result.channels = options.channels > 0 ? options.channels : numbers.channels;
  result.code.latent = options.code.latent >= 0 ? options.code.latent : numbers.latent;
  result.iterations = options.iterations > 0 ? options.iterations : numbers.iterations;
  result.learning_rate = options.learning_rate > 0 ? options.learning_rate : numbers.learning_rate;
  result.weight_decay = options.weight_decay >= 0 ? options.weight_decay : numbers.weight_decay;
  return result;
}

std::string training_problem(const TrainOptions& options, Device device) {
  if (options.half && device == Device::Cpu) {
    return "--half works on a GPU alone; use --device cuda, or leave it out";
  }
  if (std::string problem = resolution_problem("--resolution", options.resolution);
      !problem.empty()) {
    return problem;
  }
  if (std::string problem = shading_problem("--shading", options.shading); !problem.empty()) {
    return problem;
  }
  constexpr int kFewest = 8;  // texels a side of a branch, whose coarsest level has a quarter
  if (options.resolution < kFewest * options.shading) {
    return "--resolution " + std::to_string(options.resolution) + " with --shading " +
           std::to_string(options.shading) + " leaves branches of " +
           std::to_string(options.resolution / options.shading) +
           " texels a side; 8 are the fewest";
  }
  if (options.code.geometry && !options.code.pose && options.code.latent == 0) {
    return "--code.geometry depends on pose and latent code, and both are off";
  }
  if (options.pixel_bias && !options.view_independent && !options.view_dependent) {
    return "--pixel-bias is of the branches, and none is trained";
  }
  return "";
}

NetworkOptions network_options(const TrainOptions& options, int parts) {
  const TrainOptions known = resolved(options);
  NetworkOptions network;
  network.resolution = known.resolution;
  network.channels = known.channels;
  network.view_independent = known.view_independent;
  network.view_dependent = known.view_dependent;
  network.shadow = known.shadow;
  network.shading = known.shading;
  network.transfer_degree = known.transfer_degree;
  network.pixel_bias = known.pixel_bias;
  network.pose_parts = known.code.pose ? parts : 0;
  network.latent = known.code.latent;
  network.geometry = known.code.geometry;
  return network;
}

std::string training_text(const TrainOptions& options) {
  TrainOptions known = resolved(options);
  const bool coded = known.code.pose || known.code.latent > 0;
  return canonical_json(coded ? describe_with_code(known) : describe(known));
}

double learning_rate_at(const TrainOptions& options, int iteration) {
  const TrainOptions known = resolved(options);
  constexpr double kLast = 0.1;
  const double share = std::min(1.0, static_cast<double>(iteration) / known.iterations);
  const double fall = (1 + std::cos(std::numbers::pi * share)) / 2;
  constexpr double kLongestRise = 200;
  const double rise = std::clamp(known.iterations / 20.0, 1.0, kLongestRise);
  return known.learning_rate * std::min(1.0, (iteration + 1) / rise) * (kLast + (1 - kLast) * fall);
}

double divergence_share_at(const TrainOptions& options, int iteration) {
  constexpr double kFrom = 0.25;
  const double done = static_cast<double>(iteration) / resolved(options).iterations;
  return std::clamp(2 * (done - kFrom), 0.0, 1.0);
}

int training_view(std::int64_t seed, int count, std::int64_t step) {
  ATELIER_CHECK(count > 0 && step >= 0, "there is a view to choose");
  Random random{static_cast<std::uint64_t>(seed), static_cast<std::uint64_t>(1 + step / count)};
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1], order[uniform_index(random, i)]);
  }
  return order[static_cast<std::size_t>(step % count)];
}

}  // namespace atelier
