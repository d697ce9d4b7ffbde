#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "appearance/appearance_data.h"
#include "appearance/appearance_model.h"
#include "appearance/shown_surfaces.h"
#include "core/device.h"

namespace atelier {

/// The loss of a batch: the mean squared difference in sRGB.
struct NetworkLoss {
  double value = 0;  ///< mean over pixels and channels; not finite: the training diverged
  double psnr = 0;   ///< dB, of the same differences
};

/// AdamW (Loshchilov and Hutter, "Decoupled weight decay regularization", 2019).
struct AdamStep {
  double learning_rate = 1e-3;
  double weight_decay = 0.01;  ///< of convolutions; the mean texture and gains do not decay
  double beta1 = 0.9;
  double beta2 = 0.999;
  double epsilon = 1e-8;
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
  const float* texture_on_device(const SurfaceArrays& surface, const Eigen::Vector3d& center);

  /// Copies training data to the device, once: the colours of all views and the inputs of the
  /// branches (per view, 60 bytes a texel of the branches and 15 a pixel). The functions below
  /// refer to views by their index in it.
  void learn_from(const AppearanceData& data);
  /// Loss of views, and its derivatives by each parameter.
  NetworkLoss loss(const std::vector<int>& views) const;
  std::map<std::string, Tensor> loss_gradient(const std::vector<int>& views) const;

  /// One step of AdamW, asynchronous on a GPU, which records the first step (recording.h) and
  /// repeats it while batches have the same length.
  void step(const std::vector<int>& views, const AdamStep& options);
  /// Losses of the steps since the last call, each evaluated before its step; waits for the device.
  /// After a loss that is not finite, parameters may not be finite either.
  std::vector<NetworkLoss> losses();

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
