#pragma once

#include <memory>
#include <vector>

#include "appearance/appearance_model.h"
#include "appearance/painted_scene.h"

namespace atelier {

/// One surface of a scene: a garment, the body, hair.
struct PaintedLayer {
  Triangles faces;                               ///< of its vertices
  std::shared_ptr<const AppearanceModel> model;  ///< its appearance, same faces; null: `color`
  Eigen::Vector3f color{0.45F, 0.45F, 0.45F};    ///< linear RGB, times its ambient visibility
};

/// Rendering times of one image, in milliseconds.
struct PaintTimes {
  double look = 0;      ///< vertices to the device, tree, rasterisation
  double surfaces = 0;  ///< normals, tangents, light transfer
  double networks = 0;
  double picture = 0;  ///< colours of pixels, and their copy to the host
};

/// Renders clothed people: garments and body by their networks, composed by depth. Created once for
/// many images: networks and static data stay on their device, and the tree for occlusion is refit
/// to the vertices of each frame.
class Painter {
 public:
  /// Light transfer is computed with the options that the models were trained with. Throws
  /// DataError for a model with other faces than its layer and where models or options contradict
  /// each other in these options (drawn_occlusion), EnvironmentError if the device is not
  /// available, LogicError for options out of range.
  Painter(std::vector<PaintedLayer> layers, const PaintOptions& options, Device device);
  ~Painter();
  Painter(Painter&&) noexcept;
  Painter& operator=(Painter&&) noexcept;

  /// The image [H,W,4] of a camera in linear light, with its lens distortion and without its gain.
  /// Without `alpha` the fourth channel is 1; with it the colour is premultiplied and the
  /// background left out. Throws LogicError unless `vertices` has an entry for each layer, of the
  /// size that its faces need.
  /// @param vertices  of each layer, metres; no rows: it is not worn
  /// @param times     if given, receives the time of each part, with the device synchronised
  Image paint(const std::vector<Points>& vertices, const Camera& camera,
              PaintTimes* times = nullptr);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace atelier
