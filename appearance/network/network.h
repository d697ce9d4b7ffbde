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

/// The squared differences of a batch, in sRGB as images hold it.
struct NetworkLoss {
  double value = 0;  ///< mean over pixels and channels; not finite: the network broke
  double psnr = 0;   ///< dB, of the same
};

/// AdamW (Loshchilov and Hutter, "Decoupled weight decay regularization", 2019).
struct AdamStep {
  double learning_rate = 1e-3;
  double weight_decay = 0.01;  ///< of convolutions; the mean texture and gains do not decay
  double beta1 = 0.9;
  double beta2 = 0.999;
  double epsilon = 1e-8;
};

/// An appearance model on a device, ready to draw and to learn (libtorch behind it).
class AppearanceNetwork {
 public:
  /// @param half  convolutions in bfloat16: half the memory, not faster where it was measured
  /// Throws EnvironmentError where the device is not there.
  AppearanceNetwork(const AppearanceModel& model, Device device, bool half = false);
  ~AppearanceNetwork();
  AppearanceNetwork(AppearanceNetwork&&) noexcept;
  AppearanceNetwork& operator=(AppearanceNetwork&&) noexcept;

  /// The texture [R,R,3] of a surface seen from a point (metres), in linear light, before the
  /// camera's gain.
  Image texture(const SurfaceFrame& frame, const Eigen::Vector3d& center) const;
  /// Colours [3P] of its places in linear light, without gain, not clamped.
  std::vector<float> colors(const SurfaceFrame& frame, const Eigen::Vector3d& center,
                            const TexturePixels& places) const;

  /// The same texture [3,R,R] in the device's memory, until it is asked for again, of a surface
  /// that lies there. Waits for nothing.
  const float* texture_on_device(const SurfaceArrays& surface, const Eigen::Vector3d& center);

  /// Takes views with colours and what the network's branches are given of each to the device,
  /// once (60 bytes a texel of the branches and 15 a place, a view); what follows names views of
  /// it.
  void learn_from(const AppearanceData& data);
  /// Loss of views, and its derivatives by each parameter.
  NetworkLoss loss(const std::vector<int>& views) const;
  std::map<std::string, Tensor> loss_gradient(const std::vector<int>& views) const;

  /// One step of AdamW. The device may still be at work when it returns. A GPU records the first
  /// step (recording.h) and repeats it while batches have the same length.
  void step(const std::vector<int>& views, const AdamStep& options);
  /// Losses of the steps since the last call, before each; waits for the device. After one that is
  /// not finite parameters may be no numbers.
  std::vector<NetworkLoss> losses();

  /// Parameters as they are now; the optimiser's moments ("m.<name>", "v.<name>") and how many
  /// steps were taken.
  std::map<std::string, Tensor> parameters() const;
  std::map<std::string, Tensor> moments() const;
  std::int64_t steps() const;
  /// Goes on where another left off. Throws LogicError for moments of other parameters.
  void resume(const std::map<std::string, Tensor>& moments, std::int64_t steps);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace atelier
