#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/options.h"
#include "core/render/scene.h"

namespace atelier {

/// Where the light of the environment, with its occlusion, is gathered.
enum class Ambient {
  PerPixel,   ///< at every sample: exact, for stills and coarse meshes
  PerVertex,  ///< once per vertex in `prepare`, interpolated: free of noise and shared by all
              ///< cameras of one instant; for meshes whose triangles are a few pixels large
  None,       ///< no environment light: area lights alone
};

struct RenderOptions {
  int samples = 8;           ///< per pixel, in [1, 1024]; edges and textures; 4 for previews
  int shadow_samples = 1;    ///< rays to each area light per sample, in [1, 256]
  int penumbra_samples = 4;  ///< further ones where a pixel's rays disagree, in [0, 256]
  int ambient_samples = 8;   ///< environment rays per sample (PerPixel only), in [1, 1024]
  bool alpha = false;     ///< a fourth channel with the coverage; colour is then premultiplied and
                          ///< without background (a seamless ground gives its shadow)
  std::int64_t seed = 0;  ///< of the random numbers; each gives another noise pattern
};

OptionTable describe(RenderOptions& options);

struct PrepareOptions {
  Ambient ambient = Ambient::PerPixel;  ///< not in describe: the caller knows its meshes
  int vertex_samples = 128;  ///< environment rays per vertex and side (PerVertex only), [1, 65536]
  double ground_reach = 0;   ///< m, half side of the square round the meshes' middle in which the
                             ///< ground's occlusion is resolved (PerVertex only); 0: all they shade
  /// rays to each area light from every point of a grid on a seamless ground, where shadows are
  /// soft: they are then shared by all cameras and free of noise, [0, 1024]; 0: every image asks
  /// from its own pixels
  int ground_shadow_rays = 0;
  double ground_shadow_reach = 6;  ///< m, half side of that grid round the meshes' middle, [1, 50]
  std::int64_t seed = 0;           ///< of the random numbers
};

OptionTable describe(PrepareOptions& options);

/// A scene prepared for rays: checked, its tree built, its textures filtered and, with
/// Ambient::PerVertex, its environment light gathered. Cheap to copy; safe to render from many
/// threads at once. The scene may be changed or dropped afterwards.
class PreparedScene {
 public:
  struct Data;  ///< private to core/render
  explicit PreparedScene(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  const Data& data() const { return *data_; }

 private:
  std::shared_ptr<const Data> data_;
};

/// Textures filtered once for all scenes that wear them: the instants of one performance. Cheap to
/// copy.
class PreparedTextures {
 public:
  struct Data;  ///< private to core/render
  PreparedTextures() = default;
  explicit PreparedTextures(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  const Data* data() const { return data_.get(); }  ///< null: none

 private:
  std::shared_ptr<const Data> data_;
};

/// Filters the textures of `looks` and keeps them. LogicError for one without pixels or with other
/// than 3 channels.
PreparedTextures prepare_textures(const std::vector<Look>& looks);

/// Textures that `textures` has are not filtered again; a texture is known by its address.
///
/// Throws DataError for a scene that check_scene refuses, LogicError for options out of range,
/// EnvironmentError if Embree cannot start. O(n log n) in the triangles, plus
/// O(vertices x vertex_samples) rays for Ambient::PerVertex.
PreparedScene prepare(const Scene& scene, const PrepareOptions& options = {},
                      const PreparedTextures& textures = {});

/// Linear RGB [height, width, 3] (RGBA with `alpha`) of the scene as the camera sees it, through
/// its lens distortion; `Camera::gain` is not applied (that is the sensor's doing).
///
/// Box-filtered samples, Owen-scrambled Sobol points per pixel (Burley, "Practical hash-based Owen
/// scrambling", JCGT 2020). Direct light: rectangles in closed form (Lambert's polygon formula)
/// times the visible share of sampled points, extra points where a pixel lies in a penumbra;
/// environment by cosine and, for images, importance sampling; gloss is GGX with height-correlated
/// Smith shadowing (Heitz 2014), of the environment by a prefiltered lobe; sheen after Estevez and
/// Kulla 2017. No light bounces between meshes; the ground throws light back once. Values are not
/// clamped. The same bytes on any number of threads.
///
/// Throws DataError for a camera that check_camera refuses, LogicError for options out of range.
/// Cost: width x height x samples x (1 + lights x shadow_samples + ambient_samples) rays.
Image render(const PreparedScene& scene, const Camera& camera, const RenderOptions& options = {});

/// Prepares and renders once.
Image render(const Scene& scene, const Camera& camera, const RenderOptions& options = {});

}  // namespace atelier
