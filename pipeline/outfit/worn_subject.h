#pragma once

#include <filesystem>
#include <memory>

#include "appearance/prepare.h"
#include "core/io/ground_truth_archive.h"

namespace atelier {

/// The recorded subject: the body, other layers (hair, shoes) where they are known, then garments.
struct WornSubject {
  DressedSubject subject;
  std::vector<Mesh> templates;    ///< of each surface, with texture coordinates if it has any
  std::vector<int> labels;        ///< of each in label images; -1: none
  std::size_t first_garment = 0;  ///< of its surfaces
};

/// The surfaces of a frame of the ground truth, as worn_in_truth has them.
std::vector<Points> surfaces_of(const GroundTruthFrame& frame, const GroundTruth& truth);

/// The ground truth of a synthetic capture. Frames are read on demand. Garments have the names of
/// the ground truth.
WornSubject worn_in_truth(const std::filesystem::path& capture,
                          const std::shared_ptr<const GroundTruth>& truth);

/// The registered garments and the bodies of a workspace: results of `register` and `body`.
/// Garments have the names of their labels, and no vertices in frames in which they are not
/// registered. Throws DataError where there is no garment, or a garment without texture
/// coordinates.
WornSubject worn_in_workspace(const std::filesystem::path& registered,
                              const std::filesystem::path& bodies);

}  // namespace atelier
