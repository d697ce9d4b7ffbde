#pragma once

#include <memory>
#include <vector>

#include "appearance/appearance_model.h"
#include "appearance/painted_scene.h"

namespace atelier {

/// A surface of an image: a garment, the body, hair.
struct PaintedLayer {
  Triangles faces;                               ///< of its vertices
  std::shared_ptr<const AppearanceModel> model;  ///< that draws it, of these faces; null: `color`
  Eigen::Vector3f color{0.45F, 0.45F, 0.45F};    ///< linear RGB, times its ambient visibility
};

/// Milliseconds of what an image is made of.
struct PaintTimes {
  double look = 0;      ///< vertices to the device, tree, raster
  double surfaces = 0;  ///< normals, tangents, light transfer
  double networks = 0;
  double picture = 0;  ///< pixels, and back
};

/// Draws dressed people: whatever is nearest to the camera shows, garments and body by their
/// networks. Made once for many images: networks and what does not move stay on their device, and
/// the tree for occlusion follows the vertices from frame to frame.
class Painter {
 public:
  /// Light transfer is measured as the models learnt. Throws DataError for a model of other faces
  /// than its layer's and where models or options contradict each other in that (drawn_occlusion),
  /// EnvironmentError where the device is not there, LogicError for options out of range.
  Painter(std::vector<PaintedLayer> layers, const PaintOptions& options, Device device);
  ~Painter();
  Painter(Painter&&) noexcept;
  Painter& operator=(Painter&&) noexcept;

  /// The image [H,W,4] in linear light that a camera takes, through its lens, its gain not
  /// applied. Without `alpha` the fourth channel is 1; with it the colour is premultiplied and the
  /// background left out.
  /// @param vertices  of each layer, metres; no rows: it is not worn
  /// @param times     takes the time of each part, for which the device is waited for between them
  /// Throws LogicError unless there are as many as layers, each of the size that its faces need.
  Image paint(const std::vector<Points>& vertices, const Camera& camera,
              PaintTimes* times = nullptr);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace atelier
