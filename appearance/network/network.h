#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "appearance/appearance_data.h"
#include "appearance/appearance_model.h"
#include "appearance/code_losses.h"
#include "appearance/shown_surfaces.h"
#include "core/device.h"

namespace atelier {

class Peers;

/// The loss of a batch: the mean squared difference in sRGB, over pixels and channels, and for a
/// network with a code what CodeLosses weighs.
struct NetworkLoss {
  double value = 0;  ///< not finite: the training diverged
  double psnr = 0;   ///< dB, of the differences in sRGB alone
};

/// AdamW (Loshchilov and Hutter, "Decoupled weight decay regularization", 2019).
struct AdamStep {
  double learning_rate = 1e-3;
  double weight_decay = 0.01;  ///< of convolutions; the mean texture and gains do not decay
  double beta1 = 0.9;
  double beta2 = 0.999;
  double epsilon = 1e-8;
  std::uint64_t seed = 0;  ///< of the noise of latent codes, with the number of the step
  double divergence = 1;   ///< share of CodeLosses::divergence
};

/// An appearance model on a device, for rendering and training (implemented with libtorch).
class AppearanceNetwork {
 public:
  /// @param half  convolutions in bfloat16: half the memory, not faster where it was measured
  /// Throws EnvironmentError if the device is not available.
  AppearanceNetwork(const AppearanceModel& model, Device device, bool half = false);
  ~AppearanceNetwork();
  AppearanceNetwork(AppearanceNetwork&&) noexcept;
  AppearanceNetwork& operator=(AppearanceNetwork&&) noexcept;

  /// The texture [R,R,3] of a surface seen from a point (metres), in linear light, before the
  /// camera's gain.
  Image texture(const SurfaceFrame& frame, const Eigen::Vector3d& center) const;
  /// Colours [3P] at points of that texture in linear light, without gain, not clamped.
  std::vector<float> colors(const SurfaceFrame& frame, const Eigen::Vector3d& center,
                            const TexturePixels& places) const;

  /// The same texture [3,R,R] for a surface in the device's memory, itself in device memory and
  /// valid until the next call. Does not synchronise.
  /// @param pose  pose_code of the surface, where the network is conditioned on it
  const float* texture_on_device(const SurfaceArrays& surface, const Eigen::Vector3d& center,
                                 const std::vector<float>& pose = {});

  /// By what pose moves the mean surface, [V,3] m in the surface's own axes; 0 where the network
  /// has no geometry. With a latent code of zeros.
  /// @param position  [V,3] m, the surface that tells the pose
  Points offsets(const FloatRows& position) const;

  /// Copies training data to the device, once: the colours of all views and the inputs of the
  /// branches (per view, 60 bytes a texel of the branches and 15 a pixel). The functions below
  /// refer to views by their index in it.
  void learn_from(const AppearanceData& data, const CodeLosses& losses = {});
  /// Loss of views, and its derivatives by each parameter.
  NetworkLoss loss(const std::vector<int>& views) const;
  std::map<std::string, Tensor> loss_gradient(const std::vector<int>& views) const;

  /// From now on each step is taken together with other processes, each on its part of the views;
  /// all have the first one's parameters. Before the first step.
  /// @param peers  outlives this network
  void join(Peers& peers);
  /// One step of AdamW, asynchronous on a GPU, which records the first step (recording.h) and
  /// repeats it while batches have the same length.
  /// @param views  of all processes, as many for each, by their ranks
  void step(const std::vector<int>& views, const AdamStep& options);
  /// Losses of the steps since the last call, each evaluated before its step, of each process one,
  /// by their ranks; waits for the device. After a loss that is not finite, parameters may not be
  /// finite either.
  std::vector<NetworkLoss> losses();

  /// Shifts the latent codes so that their mean over the training frames is 0, where drawing has
  /// it; what the network gives for each frame stays as it is. Nothing without a latent code.
  void center_codes();

  /// Current parameters, the optimiser's moments ("m.<name>", "v.<name>") and the number of steps
  /// taken.
  std::map<std::string, Tensor> parameters() const;
  std::map<std::string, Tensor> moments() const;
  std::int64_t steps() const;
  /// Restores the optimiser's state. Throws LogicError for moments of other parameters.
  void resume(const std::map<std::string, Tensor>& moments, std::int64_t steps);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace atelier
