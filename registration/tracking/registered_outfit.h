#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/garment.h"
#include "core/label.h"
#include "core/sequence.h"
#include "registration/tracking/holding.h"

namespace atelier {

/// A garment of the workspace: its template, and where `register` found it in every frame.
struct RegisteredGarmentSequence {
  std::string name;  ///< its label's
  Label label = Label::Unknown;
  Garment garment;         ///< the template; every vertex moves with the body by an attachment
  int template_frame = 0;  ///< in whose pose the template is
  Sequence registered;
  std::vector<HeldRing> holding;  ///< what holds it, where it was read
};

/// Reads them from the results of `template` and `register`. Throws DataError where the two do not
/// belong together (another topology, no such frame).
std::vector<RegisteredGarmentSequence> read_registered_outfit(
    const std::filesystem::path& template_result, const std::filesystem::path& register_result);

/// The mesh of a registered frame, by its own number. Throws DataError if there is none.
Mesh registered_mesh(const RegisteredGarmentSequence& garment, int frame_id);

/// Frames that every garment is registered in, increasing.
std::vector<int> common_frames(const std::vector<RegisteredGarmentSequence>& outfit);

}  // namespace atelier
