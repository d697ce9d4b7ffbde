#include "appearance/network/painter.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "appearance/network/network.h"
#include "appearance/shown_surfaces.h"
#include "core/error.h"

namespace atelier {

namespace {

Camera finer(const Camera& camera, int times) {
  Camera fine = camera;
  fine.width *= times;
  fine.height *= times;
  for (double* number : {&fine.fx, &fine.fy, &fine.cx, &fine.cy}) {
    *number *= times;
  }
  return fine;
}

/// All of which is background.
Image empty_picture(const Camera& camera, const PaintOptions& options) {
  Image picture(camera.width, camera.height, 4);
  for (std::size_t i = 0; i < picture.data.size() && !options.alpha; ++i) {
    picture.data[i] = i % 4 < 3 ? static_cast<float>(options.background[i % 4]) : 1.0F;
  }
  return picture;
}

/// Milliseconds of the parts of an image, where somebody asks.
class PaintClock {
 public:
  explicit PaintClock(PaintTimes* times) : times_(times) {}
  void add(double PaintTimes::*part, const ShownSurfaces& surfaces) {
    if (times_ == nullptr) {
      return;
    }
    surfaces.wait();
    const auto now = std::chrono::steady_clock::now();
    times_->*part += std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
  }

 private:
  PaintTimes* times_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace

struct Painter::State {
  std::vector<PaintedLayer> layers;
  std::vector<std::optional<AppearanceNetwork>> networks;
  PaintOptions options;
  Device device = Device::Cpu;
  std::unique_ptr<ShownSurfaces> shown;
  std::vector<Index> sizes;        // vertices of each layer in `shown`
  std::vector<std::size_t> shows;  // the layers that it has

  /// `shown` of what is worn; the last one where that is the same.
  void dress(const std::vector<Points>& vertices) {
    std::vector<Index> now;
    for (const Points& of_layer : vertices) {
      now.push_back(of_layer.rows());
    }
    if (shown && sizes == now) {
      return;
    }
    std::vector<ShownSurface> surfaces;
    std::vector<std::size_t> worn;
    for (std::size_t i = 0; i < layers.size(); ++i) {
      if (now[i] > 0) {
        const AppearanceModel* model = layers[i].model.get();
        if (model != nullptr && now[i] != model->mean_transfer.rows()) {
          throw DataError("", "surface of " + model->name, std::to_string(now[i]) + " vertices",
                          std::to_string(model->mean_transfer.rows()) + ", as its network has");
        }
        surfaces.push_back({now[i], layers[i].faces, model != nullptr ? model->uvs : Points2(),
                            model != nullptr ? model->uv_faces : Triangles()});
        worn.push_back(i);
      }
    }
    shown = make_shown_surfaces(std::move(surfaces), options, device);
    shows = std::move(worn);
    sizes = std::move(now);
  }
};

Painter::Painter(std::vector<PaintedLayer> layers, const PaintOptions& options, Device device)
    : state_(std::make_unique<State>()) {
  ATELIER_CHECK(options.samples >= 1 && options.samples <= 8 && options.background.size() == 3,
                "options of painting are out of range");
  std::vector<LearntOcclusion> learnt;
  for (const PaintedLayer& layer : layers) {
    if (layer.model && !equal_arrays(layer.model->faces, layer.faces)) {
      throw DataError(
          "", "network of " + layer.model->name,
          std::to_string(layer.model->faces.rows()) + " faces",
          "those of the surface that it is to draw, " + std::to_string(layer.faces.rows()));
    }
    auto& network = state_->networks.emplace_back();
    if (layer.model) {
      network.emplace(*layer.model, device);
      learnt.push_back({layer.model->name, layer.model->occlusion});
    }
  }
  state_->layers = std::move(layers);
  state_->options = options;
  state_->options.occlusion = drawn_occlusion(options.occlusion, learnt);
  state_->device = device;
}

Painter::~Painter() = default;
Painter::Painter(Painter&&) noexcept = default;
Painter& Painter::operator=(Painter&&) noexcept = default;

Image Painter::paint(const std::vector<Points>& vertices, const Camera& camera, PaintTimes* times) {
  State& state = *state_;
  ATELIER_CHECK(vertices.size() == state.layers.size(), "an image has vertices of every layer");
  check_camera(camera);
  state.dress(vertices);
  if (state.shows.empty()) {
    return empty_picture(camera, state.options);
  }
  ShownSurfaces& shown = *state.shown;
  PaintClock clock(times);
  Index count = 0;
  for (const Index size : state.sizes) {
    count += size;
  }
  Points all(count, 3);
  Index first = 0;
  for (const std::size_t i : state.shows) {
    all.middleRows(first, vertices[i].rows()) = vertices[i];
    first += vertices[i].rows();
  }
  const std::vector<bool> seen = shown.look(all, finer(camera, state.options.samples));
  clock.add(&PaintTimes::look, shown);
  std::vector<SurfaceArrays> arrays(seen.size());
  for (std::size_t s = 0; s < seen.size(); ++s) {
    if (seen[s]) {
      arrays[s] = shown.surface(s);
    }
  }
  clock.add(&PaintTimes::surfaces, shown);
  std::vector<SurfaceLook> looks(seen.size());
  for (std::size_t s = 0; s < seen.size(); ++s) {
    const PaintedLayer& layer = state.layers[state.shows[s]];
    std::copy(layer.color.begin(), layer.color.end(), looks[s].color.begin());
    if (seen[s] && layer.model) {
      looks[s].resolution = layer.model->options.resolution;
      const std::optional<BodyParts>& parts = layer.model->parts;
      const std::vector<float> pose =
          parts ? pose_code(*parts, vertices[state.shows[s]].cast<float>()) : std::vector<float>();
      looks[s].texture =
          state.networks[state.shows[s]]->texture_on_device(arrays[s], camera_center(camera), pose);
    }
  }
  clock.add(&PaintTimes::networks, shown);
  Image picture = shown.picture(looks);
  clock.add(&PaintTimes::picture, shown);
  return picture;
}

}  // namespace atelier
