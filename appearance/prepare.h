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

/// Everything before the cameras, over time: body, garments, hair, each over one topology.
struct DressedSubject {
  std::vector<std::string> names;  ///< of the surfaces
  std::vector<Triangles> faces;    ///< of each
  /// Vertices of each surface in a frame; no rows: it is not worn there.
  std::function<std::vector<Points>(int frame_id)> load;
  /// SurfaceFrame::face of its first surface in a frame; empty: nobody knows.
  std::function<std::vector<float>(int frame_id)> face = {};
};

/// One surface of it that a network is to draw.
struct DrawnSurface {
  std::size_t which = 0;     ///< of DressedSubject
  PackedAtlas atlas;         ///< without overlaps
  int label = -1;            ///< of its pixels in label images; -1: any
  bool hidden = false;       ///< by what is no surface of the subject: of another label, which then
                             ///< contradicts nothing, unlike the background
  bool trusted_only = true;  ///< leave out pixels near silhouettes and depth jumps
  int fewest_pixels = 100;   ///< of all images, that have to show it
};

/// A camera's image of one frame.
struct TakenPicture {
  ByteImage colors;  ///< sRGB bytes of 3 channels; empty: none was taken
  ByteImage labels;  ///< what each pixel shows, or empty: nobody says
};
using ReadPicture = std::function<TakenPicture(std::size_t camera_idx, int frame_id)>;

/// Which cameras look in which frames, and what they took. Refers to what others own.
struct TakenPictures {
  const std::vector<Camera>& cameras;
  const std::vector<int>& frame_ids;
  ReadPicture read = {};  ///< none: there are no colours, only what a network is asked for
};

/// Agreement of label images with the pixels of one camera in which the geometry shows the surface.
struct LabelAgreement {
  std::size_t judged = 0;  ///< pixels that have a label
  std::size_t agreed = 0;  ///< of them, those that it gives to the surface
};

/// The surface in every frame, with its light transfer, the pixels that each camera sees of it
/// and their colours: what a network learns from. Pixels that a label image gives to something
/// else, or next to which it has something else (at outlines it is a pixel off), are left out.
///
/// Throws DataError where an image has another size than its camera, where the surface is not in
/// a frame, where fewer than `fewest_pixels` of all images show it, and where label images say
/// of more than half of its pixels that something else is there: images and geometry are then not
/// of one capture.
/// @param agreement  [C] if it is not null
AppearanceData prepare_appearance(const DressedSubject& subject, const DrawnSurface& surface,
                                  const TakenPictures& pictures,
                                  const PrepareAppearanceOptions& options = {},
                                  Device device = Device::Cpu,
                                  std::vector<LabelAgreement>* agreement = nullptr);

}  // namespace atelier
