#pragma once

#include <functional>
#include <string>
#include <vector>

#include "appearance/appearance_data.h"
#include "appearance/joined_surfaces.h"
#include "appearance/occlusion.h"
#include "appearance/packed_atlas.h"
#include "appearance/visible_pixels.h"
#include "core/camera.h"

namespace atelier {

struct PrepareAppearanceOptions {
  OcclusionOptions occlusion;
  VisibleOptions visible;
};
OptionTable describe(PrepareAppearanceOptions& options);

/// The recorded subject over time as surfaces, each of one topology: body, garments, hair.
struct DressedSubject {
  std::vector<std::string> names;  ///< of the surfaces
  std::vector<Triangles> faces;    ///< of each
  /// Vertices of each surface in a frame; no rows: it is not worn in it.
  std::function<std::vector<Points>(int frame_id)> load;
  /// SurfaceFrame::face of its first surface in a frame; empty: unknown.
  std::function<std::vector<float>(int frame_id)> face = {};
};

/// The surface of a subject that a network is trained for.
struct DrawnSurface {
  std::size_t which = 0;     ///< of DressedSubject
  PackedAtlas atlas;         ///< without overlaps
  int label = -1;            ///< class of its pixels in label images; -1: any
  bool hidden = false;       ///< objects that are no surface of the subject may occlude it: pixels
                             ///< of another class are then no contradiction, background pixels are
  bool trusted_only = true;  ///< leave out pixels near silhouettes and depth jumps
  int fewest_pixels = 100;   ///< minimum number of pixels of all images that show it
};

/// A camera's image of one frame.
struct TakenPicture {
  ByteImage colors;  ///< sRGB bytes of 3 channels; empty: none was taken
  ByteImage labels;  ///< class of each pixel, or empty: unknown
};
using ReadPicture = std::function<TakenPicture(std::size_t camera_idx, int frame_id)>;

/// Cameras, frames and their images. Refers to data that others own.
struct TakenPictures {
  const std::vector<Camera>& cameras;
  const std::vector<int>& frame_ids;
  ReadPicture read = {};  ///< empty: no colours, only the inputs of a network
};

/// Agreement of label images with the pixels of one camera in which the geometry shows the surface.
struct LabelAgreement {
  std::size_t judged = 0;  ///< pixels that have a label
  std::size_t agreed = 0;  ///< of them, those with the class of the surface
};

/// Training data of a network: the surface in every frame with its light transfer, and the pixels
/// of each camera in which it is visible, with their colours. Pixels of another class in the label
/// image, and their neighbours (outlines of labels are a pixel off), are left out.
///
/// Throws DataError where an image differs in size from its camera, where the surface is missing
/// in a frame, where fewer than `fewest_pixels` of all images show it, and where label images
/// contradict more than half of its pixels: images and geometry are then of different captures.
/// @param agreement  [C] if it is not null
AppearanceData prepare_appearance(const DressedSubject& subject, const DrawnSurface& surface,
                                  const TakenPictures& pictures,
                                  const PrepareAppearanceOptions& options = {},
                                  Device device = Device::Cpu,
                                  std::vector<LabelAgreement>* agreement = nullptr);

}  // namespace atelier
