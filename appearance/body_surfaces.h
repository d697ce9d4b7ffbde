#pragma once

#include <string>
#include <vector>

#include "appearance/surface_frame.h"
#include "core/archive.h"

namespace atelier {

/// Archive of schema "atelier.body_surfaces", version 1 (docs/reference/formats.md): a row of three
/// for each vertex of a body in each of some frames, [N] of [V,3] metres, places or offsets; and
/// back. Reading throws DataError unless there are frames of one size, finite and within 1e6 m.
Archive archive_of_surfaces(const std::vector<FloatRows>& surfaces);
std::vector<FloatRows> surfaces_of(const Archive& archive, const std::string& file = "");

inline constexpr const char* kSurfacesSchema = "atelier.body_surfaces";

}  // namespace atelier
