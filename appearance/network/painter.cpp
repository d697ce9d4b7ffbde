#include "appearance/network/painter.h"

#include <algorithm>
#include <optional>

#include "appearance/joined_surfaces.h"
#include "appearance/network/network.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/raster.h"

namespace atelier {

namespace {

/// Where a layer is seen: pixels of the fine picture and what they show.
struct Seen {
  std::vector<int> pixel;
  std::vector<int> face;  ///< of the layer
  TexturePixels places;   ///< where it has a texture
};

Seen seen_of(const Raster& raster, int first_face, int end_face, const AppearanceModel* model) {
  Seen seen;
  for (std::size_t i = 0; i < raster.face.data.size(); ++i) {
    if (raster.face.data[i] >= first_face && raster.face.data[i] < end_face) {
      seen.pixel.push_back(static_cast<int>(i));
      seen.face.push_back(raster.face.data[i] - first_face);
    }
  }
  if (model == nullptr) {
    return seen;
  }
  seen.places.u.resize(seen.pixel.size());
  seen.places.v.resize(seen.pixel.size());
  constexpr Index kGrain = 8192;
  parallel_for(static_cast<Index>(seen.pixel.size()), kGrain, [&](Index begin, Index end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      Eigen::Vector2d uv(0, 0);
      for (std::size_t k = 0; k < 3; ++k) {
        const auto pixel = static_cast<std::size_t>(seen.pixel[i]);
        uv += static_cast<double>(raster.barycentric.data[3 * pixel + k]) *
              model->uvs.row(model->uv_faces(seen.face[i], static_cast<Index>(k))).transpose();
      }
      seen.places.u[i] = std::clamp(static_cast<float>(uv.x()), 0.0F, 1.0F);
      seen.places.v[i] = std::clamp(static_cast<float>(uv.y()), 0.0F, 1.0F);
    }
  });
  return seen;
}

/// One colour, as bright as the surface sees of the sky.
std::vector<float> plain_colors(const Seen& seen, const Raster& raster, const PaintedLayer& layer,
                                const SurfaceFrame& frame) {
  std::vector<float> colors(3 * seen.pixel.size());
  for (std::size_t i = 0; i < seen.pixel.size(); ++i) {
    float open = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      open += raster.barycentric.data[3 * static_cast<std::size_t>(seen.pixel[i]) + k] *
              frame.visibility(layer.faces(seen.face[i], static_cast<Index>(k)), 0);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      colors[3 * i + c] = open * layer.color[static_cast<Index>(c)];
    }
  }
  return colors;
}

Camera finer(const Camera& camera, int times) {
  Camera fine = camera;
  fine.width *= times;
  fine.height *= times;
  for (double* number : {&fine.fx, &fine.fy, &fine.cx, &fine.cy}) {
    *number *= times;
  }
  return fine;
}

/// Squares of `times` x `times` averaged; what is not covered shows the background.
Image averaged(const Image& fine, int times, const PaintOptions& options) {
  Image picture(fine.width / times, fine.height / times, 4);
  const float share = 1.0F / static_cast<float>(times * times);
  constexpr Index kRows = 16;
  parallel_for(picture.height, kRows, [&](Index begin, Index end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < picture.width; ++x) {
        float* sum = &picture.at(x, y);
        for (int i = 0; i < times * times; ++i) {
          const float* one = &fine.at(x * times + i % times, y * times + i / times);
          for (int c = 0; c < 4; ++c) {
            sum[c] += share * one[c];
          }
        }
        if (!options.alpha) {
          for (std::size_t c = 0; c < 3; ++c) {
            sum[c] += (1 - sum[3]) * static_cast<float>(options.background[c]);
          }
          sum[3] = 1;
        }
      }
    }
  });
  return picture;
}

}  // namespace

struct Painter::State {
  std::vector<PaintedLayer> layers;
  std::vector<std::optional<AppearanceNetwork>> networks;
  PaintOptions options;
  Device device = Device::Cpu;
  std::optional<TriangleTree> tree;
  std::vector<bool> worn;  // in the tree

  /// The tree over what is worn; follows the last one where that is the same.
  void follow(const JoinedSurfaces& all, const std::vector<bool>& now_worn) {
    if (tree && worn == now_worn) {
      tree = refit_tree(std::move(*tree), all.vertices);
    } else {
      tree = build_tree(all.vertices, all.faces);
      worn = now_worn;
    }
  }
};

Painter::Painter(std::vector<PaintedLayer> layers, const PaintOptions& options, Device device)
    : state_(std::make_unique<State>()) {
  ATELIER_CHECK(options.samples >= 1 && options.samples <= 8 && options.background.size() == 3,
                "options of painting are out of range");
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
    }
  }
  state_->layers = std::move(layers);
  state_->options = options;
  state_->device = device;
}

Painter::~Painter() = default;
Painter::Painter(Painter&&) noexcept = default;
Painter& Painter::operator=(Painter&&) noexcept = default;

Image Painter::paint(const std::vector<Points>& vertices, const Camera& camera) {
  State& state = *state_;
  ATELIER_CHECK(vertices.size() == state.layers.size(), "a picture has vertices of every layer");
  check_camera(camera);
  std::vector<Surface> surfaces;
  std::vector<std::size_t> of_layer;
  std::vector<bool> worn;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    worn.push_back(vertices[i].rows() > 0);
    if (worn.back()) {
      surfaces.push_back({&vertices[i], &state.layers[i].faces});
      of_layer.push_back(i);
    }
  }
  const JoinedSurfaces all = joined_surfaces(surfaces);
  const Camera fine_camera = finer(camera, state.options.samples);
  Image fine(fine_camera.width, fine_camera.height, 4);
  if (!surfaces.empty()) {
    state.follow(all, worn);
    const Raster raster = rasterize(all.vertices, all.faces, fine_camera, {}, state.device);
    for (std::size_t s = 0; s < surfaces.size(); ++s) {
      const PaintedLayer& layer = state.layers[of_layer[s]];
      const AppearanceModel* model = layer.model.get();
      const Seen seen = seen_of(raster, all.first_face[s], all.first_face[s + 1], model);
      if (seen.pixel.empty()) {
        continue;
      }
      const Points2 no_uvs = Points2::Zero(1, 2);
      const Triangles no_uv_faces = Triangles::Zero(layer.faces.rows(), 3);
      SurfaceFrame frame =
          surface_frame(*surfaces[s].vertices, layer.faces, model != nullptr ? model->uvs : no_uvs,
                        model != nullptr ? model->uv_faces : no_uv_faces);
      frame.visibility =
          ambient_visibility(frame, *state.tree, state.options.occlusion, state.device);
      const std::vector<float> colors =
          model != nullptr
              ? state.networks[of_layer[s]]->colors(frame, camera_center(camera), seen.places)
              : plain_colors(seen, raster, layer, frame);
      for (std::size_t i = 0; i < seen.pixel.size(); ++i) {
        float* pixel = &fine.data[4 * static_cast<std::size_t>(seen.pixel[i])];
        for (std::size_t c = 0; c < 3; ++c) {
          pixel[c] = std::clamp(colors[3 * i + c], 0.0F, 1.0F);
        }
        pixel[3] = 1;
      }
    }
  }
  return averaged(fine, state.options.samples, state.options);
}

}  // namespace atelier
