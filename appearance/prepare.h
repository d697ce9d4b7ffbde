#pragma once

#include <functional>
#include <string>
#include <vector>

#include "appearance/appearance_data.h"
#include "appearance/occlusion.h"
#include "appearance/packed_atlas.h"
#include "appearance/visible_pixels.h"

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
};

/// One surface of it that a network is to draw.
struct DrawnSurface {
  std::size_t which = 0;       ///< of DressedSubject
  PackedAtlas atlas;           ///< without overlaps
  int resolution = 256;        ///< texels a side
  int shadow_resolution = 64;  ///< texels a side of the visibility
  bool trusted_only = true;    ///< leave out pixels near silhouettes and depth jumps
};

/// The picture of a camera in a frame, sRGB bytes of 3 channels; empty: none was taken.
using ReadPicture = std::function<ByteImage(std::size_t camera_idx, int frame_id)>;

/// Maps, visibility, visible pixels and their colours of every frame and camera: what a network
/// learns from. Without `read` there are no colours: what a network is asked for.
///
/// Throws DataError where a picture has another size than its camera, where the surface is not in
/// a frame, and where fewer than a hundred pixels of all pictures show it.
AppearanceData prepare_appearance(const DressedSubject& subject, const DrawnSurface& surface,
                                  const std::vector<Camera>& cameras,
                                  const std::vector<int>& frame_ids, const ReadPicture& read = {},
                                  const PrepareAppearanceOptions& options = {},
                                  Device device = Device::Cpu);

}  // namespace atelier
