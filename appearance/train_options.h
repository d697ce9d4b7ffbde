#pragma once

#include "appearance/appearance_model.h"
#include "appearance/code_losses.h"
#include "core/device.h"

namespace atelier {

/// How much is trained.
enum class TrainSetting {
  Auto,      ///< Small on the CPU, Standard on a GPU
  Small,     ///< 256 x 256, 8 channels, 1e-3, 300 iterations: a minute and a half on two cores
  Standard,  ///< 512 x 512, 16 channels, 5e-4, 20,000 iterations: minutes on a GPU
  Full,      ///< 1024 x 1024, 32 channels, 1e-4, 100,000 iterations: a quarter of an hour on a GPU
};

/// Conditioning of a body's network; a garment's has none.
struct BodyCodeOptions {
  bool pose = false;      ///< the turns of the body's parts
  int latent = 0;         ///< length of the latent code; 0: none; below 0: as the setting
  bool geometry = false;  ///< they also move the surface
  CodeLosses losses = {};
};

/// Most processes that a machine trains a network with.
inline constexpr int kMostProcesses = 64;

struct TrainOptions {
  TrainSetting setting = TrainSetting::Auto;
  int resolution = 0;        ///< texels a side, a power of 2 from 16 to 2048; 0: as the setting
  int channels = 0;          ///< of the first level, up to 128; 0: as the setting
  double learning_rate = 0;  ///< at its highest, up to 1; 0: as the setting
  int iterations = 0;        ///< up to 10,000,000; 0: as the setting
  int shading = 0;           ///< NetworkOptions::shading, 1..16; 0: as the setting
  int batch = 2;             ///< views an iteration, 1..64
  double weight_decay = -1;  ///< of the convolutions (AdamW), up to 1; below 0: as the setting
  bool view_independent = true;
  bool view_dependent = true;
  bool shadow = true;
  int transfer_degree = 1;  ///< NetworkOptions::transfer_degree, 0..2
  bool pixel_bias = false;
  double smoothness = 0;  ///< pixels as which the likeness of neighbouring texels counts in the
                          ///< mean texture that training begins with (static_texture), 0..1000
  bool half = false;      ///< convolutions in bfloat16: half the memory, slower (H100)
  /// Iterations from save to save, up to 1,000,000; 0: 100, or as many more as keep saving below a
  /// twentieth of the time. Does not change the result.
  int checkpoint_every = 0;
  /// That take a step each at once, on a GPU each, 1..kMostProcesses: of a training that takes a
  /// P-th of the time, the updates are fewer by as much.
  int processes = 1;
  std::int64_t seed = 0;
  BodyCodeOptions code = {};  ///< of a body
};
OptionTable describe(TrainOptions& options);
/// The same with the code's, as `code.*`: of a body.
OptionTable describe_with_code(TrainOptions& options);

/// The same with the setting's numbers in place of what was left to it, and the device's setting in
/// place of Auto.
TrainOptions resolved(const TrainOptions& options, Device device = Device::Cpu);

/// "", or what no network can have of resolved options, each in its range, on that device.
std::string training_problem(const TrainOptions& options, Device device);

/// The architecture that they describe.
/// @param parts  of the body whose pose is told, J of BodyParts; 0: of a garment
NetworkOptions network_options(const TrainOptions& options, int parts = 0);

/// The options as text that two runs of the same training have in common.
std::string training_text(const TrainOptions& options);

/// The learning rate at an iteration from 0: it rises over the first steps (a twentieth of all, at
/// most 200: Adam's first steps move every weight by all of it in one direction), then falls along
/// a cosine to a tenth.
double learning_rate_at(const TrainOptions& options, int iteration);

/// Share of the divergence's weight at an iteration from 0: it rises from the first quarter to the
/// third, since codes that are held to the prior before a decoder hears them never say anything
/// (Bowman et al. 2016).
double divergence_share_at(const TrainOptions& options, int iteration);

/// The view that comes `step`-th: every epoch has each of `count` views once, in an order that seed
/// and epoch alone decide, so that a resumed training goes on as if it had never stopped.
int training_view(std::int64_t seed, int count, std::int64_t step);

}  // namespace atelier
