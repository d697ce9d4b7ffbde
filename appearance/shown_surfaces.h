#pragma once

#include <array>
#include <memory>
#include <vector>

#include "appearance/painted_scene.h"
#include "core/device.h"
#include "core/image.h"

namespace atelier {

/// A surface that images show.
struct ShownSurface {
  Index vertices = 0;  ///< V
  Triangles faces;     ///< [F,3] of its vertices
  Points2 uvs;         ///< [T,2]; no rows: it has no texture
  Triangles uv_faces;  ///< [F,3] into uvs
};

/// A surface in one frame, as SurfaceFrame, in the memory of the device that draws.
struct SurfaceArrays {
  const float* position = nullptr;  ///< [V,3] metres, world
  const float* normal = nullptr;    ///< [V,3] unit or 0
  const float* tangent = nullptr;   ///< [T,3] unit or 0
  const float* transfer = nullptr;  ///< [V,2*9] light transfer of the outside and of the inside
  Index vertices = 0;               ///< V
  Index coordinates = 0;            ///< T
};

/// Appearance of a surface in an image.
struct SurfaceLook {
  const float* texture = nullptr;  ///< [3,R,R] linear RGB, in the device's memory; null: `color`
  int resolution = 0;              ///< R
  std::array<float, 3>
      color{};  ///< linear RGB, times the ambient visibility of the side that shows
};

/// Surfaces before a camera, on a device: all of an image but the networks. For surfaces that are
/// worn together; what does not change from image to image stays on the device, and the tree
/// for occlusion follows the vertices. An image is `look`, `surface` of those that it sees,
/// `picture`. Both devices agree but for rounding and for rays that graze an edge.
class ShownSurfaces {
 public:
  virtual ~ShownSurfaces() = default;

  /// Looks through a camera. True for each surface that it sees.
  /// @param vertices  of all surfaces, one behind the other, metres
  /// Throws LogicError for another number of vertices or coordinates that are not finite, and as
  /// `rasterize` does.
  virtual std::vector<bool> look(const Points& vertices, const Camera& camera) = 0;

  /// A surface as it was looked at, with its light transfer; valid until the next look.
  virtual SurfaceArrays surface(std::size_t which) = 0;

  /// The image [H,W,4] in linear light, of one look for each surface; squares of `samples` pixels
  /// of the camera are one of the image's. Colours are clamped to [0,1].
  virtual Image picture(const std::vector<SurfaceLook>& looks) = 0;

  /// Waits until the device has finished all its work, for measurements of time.
  virtual void wait() const = 0;
};

/// Options of the light transfer that are not set have their defaults (drawn_occlusion). Throws
/// LogicError unless faces name what is there and options are in range, EnvironmentError where the
/// device is not there.
std::unique_ptr<ShownSurfaces> make_shown_surfaces(std::vector<ShownSurface> surfaces,
                                                   const PaintOptions& options, Device device);

}  // namespace atelier
