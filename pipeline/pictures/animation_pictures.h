#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/camera.h"
#include "core/options.h"
#include "core/render/render.h"
#include "core/render/scene.h"
#include "core/render/studio.h"

namespace atelier {

/// Views round the subject, which are no camera of a capture.
inline constexpr std::array<std::string_view, 5> kAnimationViews = {"front", "side", "back",
                                                                    "three-quarter", "orbit"};

/// Where a motion is seen from, and before what.
struct AnimationViewOptions {
  /// "front", "side", "back", "three-quarter", "orbit" (once round over the motion), or the name
  /// of one of the capture's cameras.
  std::string camera = "three-quarter";
  std::string background = "studio";  ///< "studio", "white", "black", "transparent"
  std::string drawn_by = "auto";  ///< "networks", "plain"; "auto": networks where there are some
  PictureOptions picture{.width = 480, .height = 640, .samples = 6, .framing = {}};
};
OptionTable describe(AnimationViewOptions& options);

/// kAnimationViews as texts.
std::vector<std::string> animation_views();

/// How images of a motion are taken: one light and floor for all of them, so that nothing
/// flickers.
struct AnimationView {
  std::vector<Camera> cameras;  ///< [F] one for each image
  Scene studio;                 ///< without meshes
  bool alpha = false;
};

/// Throws DataError for a camera that is no view of ours and none of the capture's: what
/// animation_view would refuse, before there is anything to look at.
void require_view(const AnimationViewOptions& options, const std::vector<Camera>& captured);

/// @param points  [P,3] m, where the subject is over all frames
/// @param facing  azimuth to which the subject looks, which "front" is in front of
/// @param captured  the capture's cameras, for one by its name
/// Throws DataError for a name that is none of them.
AnimationView animation_view(const Points& points, double facing, int frames,
                             const std::vector<Camera>& captured,
                             const AnimationViewOptions& options);

/// Corners of the boxes round the points of each frame: enough for animation_view.
Points box_corners(const Points& points);

/// One image, tone mapped: linear RGB, or RGBA with premultiplied colour.
Image animation_picture(const AnimationView& view, int frame, std::vector<RenderMesh> meshes,
                        const AnimationViewOptions& options);

/// The skin of a body whose texture is known.
Look textured_skin_look(std::shared_ptr<const Image> texture);

/// A body's skin, and cloth in one of a few colours that tell garments apart.
Look skin_look();
Look cloth_look(std::size_t garment);

}  // namespace atelier
