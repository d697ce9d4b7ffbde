#include "appearance/blank_model.h"

#include <cmath>
#include <utility>

#include "core/error.h"

namespace atelier {

Tensor planes_of(const Image& image) {
  const auto size = static_cast<std::size_t>(image.width);
  std::vector<float> planes(image.data.size());
  for (std::size_t i = 0; i < size * size; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      planes[c * size * size + i] = image.data[3 * i + c];
    }
  }
  return tensor_of(planes, {3, image.height, image.width});
}

AppearanceModel blank_model(const AppearanceData& data, const NetworkOptions& options) {
  if (data.views.empty() || data.frames.empty()) {
    throw DataError("", "appearance data", "no view", "images of the surface to learn from");
  }
  AppearanceModel model;
  model.name = data.name;
  model.options = options;
  model.faces = data.faces;
  model.uvs = data.uvs;
  model.uv_faces = data.uv_faces;
  model.camera_ids = data.camera_ids;
  model.occlusion = data.occlusion;
  model.mean_transfer = MeanTransfer::Zero(data.frames[0].transfer.rows(), kTransferTerms);
  for (const SurfaceFrame& frame : data.frames) {
    model.mean_transfer +=
        frame.transfer.leftCols<kTransferTerms>() / static_cast<float>(data.frames.size());
  }
  return model;
}

void put_static_texture(AppearanceModel& model, StaticTexture fixed) {
  Image mean = fixed.texture;
  if (model.options.shadow) {
    const float open = 1 / (1 + std::exp(-kOpenShadow));
    for (float& value : mean.data) {
      value /= open;
    }
  }
  model.parameters["texture.mean"] = planes_of(mean);
  std::vector<float> logs;
  logs.reserve(fixed.gain.size());
  for (const float gain : fixed.gain) {
    logs.push_back(std::log(gain));
  }
  model.parameters["gain.log"] =
      tensor_of(logs, {static_cast<std::int64_t>(fixed.gain.size() / 3), 3});
  model.static_texture = std::move(fixed.texture);
  model.static_gain = std::move(fixed.gain);
}

}  // namespace atelier
