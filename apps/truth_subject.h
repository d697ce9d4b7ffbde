#pragma once

#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_APPEARANCE)

#include <filesystem>
#include <memory>

#include "appearance/prepare.h"
#include "capture/truth_archive.h"

namespace atelier {

/// A synthetic capture's truth as what stands before the cameras: the body, the layers (hair,
/// shoes), then the garments.
struct TruthSubject {
  std::shared_ptr<const CaptureTruth> truth;
  DressedSubject subject;
  std::vector<Mesh> templates;    ///< of each surface, with texture coordinates where it has some
  std::size_t first_garment = 0;  ///< of its surfaces
};

/// Frames are read when they are asked for. Throws DataError for a capture without truth.
TruthSubject truth_subject(const std::filesystem::path& capture);

}  // namespace atelier

#endif
