#pragma once

#include <string_view>

#include "capture/layouts/layout.h"

namespace atelier {

/// ActorsHQ (synthesiaresearch/humanrf, actorshq/dataset): calibration.csv, rgbs/CamXXX/,
/// masks/CamXXX/ in a folder 1x/, 2x/ or 4x/. Intrinsics are shares of the size and have no
/// distortion (k1 to k3 are optional columns); the rotation vector and the translation take the
/// camera into the world. World: metres.
std::string recognize_actorshq(const std::filesystem::path& path);
Dataset read_actorshq(const std::filesystem::path& path, const DatasetOptions& options,
                      const Limits& limits);
std::vector<std::string> write_actorshq(const LayoutSource& source,
                                        const std::filesystem::path& out);

/// The cameras, in the layout's world. Throws DataError, with the line, for other columns, missing
/// values, sizes that are none.
std::vector<Camera> parse_actorshq_cameras(std::string_view text, const std::string& file = "",
                                           const Limits& limits = {});

}  // namespace atelier
