#pragma once

#include <vector>

#include "core/image.h"
#include "core/mesh.h"
#include "core/store/stage.h"
#include "registration/tracking/holding.h"

namespace atelier {

/// The file of `register` that shows what holds the garments.
inline constexpr const char* kHoldingPicture = "holding.png";

/// Reports the rings that hold a garment (find_holding), a line each; warns if there is none.
std::vector<HeldRing> tell_holding(StageRun& run, const FollowedGarment& garment);

/// A garment in a frame of its take.
struct ShownGarment {
  Mesh mesh;
  std::vector<HeldRing> rings;
};

/// The garments on the body of that frame from the front and from behind: bands red, what rests on
/// the body blue. Linear RGB.
Image holding_picture(const std::vector<ShownGarment>& garments, const Mesh& body);

}  // namespace atelier
