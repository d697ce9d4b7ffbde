#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "appearance/appearance_data.h"
#include "appearance/appearance_model.h"
#include "core/device.h"

namespace atelier {

/// What a network is asked for: the surface in one frame, seen from one place.
struct NetworkView {
  const FrameMaps* frame = nullptr;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< metres, of the camera
  int camera_idx = -1;                               ///< whose gain applies; -1: none (1)
  const TexturePixels* pixels = nullptr;  ///< where it is looked at; with colours: what is there
};

/// The squared differences of a batch, in sRGB as pictures hold it.
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
  /// Throws EnvironmentError where the device is not there.
  AppearanceNetwork(const AppearanceModel& model, Device device);
  ~AppearanceNetwork();
  AppearanceNetwork(AppearanceNetwork&&) noexcept;
  AppearanceNetwork& operator=(AppearanceNetwork&&) noexcept;

  /// The texture [R,R,3] in linear light, before the camera's gain.
  Image texture(const NetworkView& view) const;
  /// Colours [3P] of the view's pixels in linear light, gain applied, not clamped.
  std::vector<float> colors(const NetworkView& view) const;

  /// Loss of views with colours, and its derivatives by each parameter.
  NetworkLoss loss(const std::vector<NetworkView>& batch) const;
  std::map<std::string, Tensor> loss_gradient(const std::vector<NetworkView>& batch) const;

  /// One step of AdamW. A loss that is not finite changes nothing.
  NetworkLoss step(const std::vector<NetworkView>& batch, const AdamStep& options);

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
