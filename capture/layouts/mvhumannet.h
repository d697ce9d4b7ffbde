#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "capture/layouts/layout.h"

namespace atelier {

/// MVHumanNet and MVHumanNet++ (GAP-LAB-CUHK-SZ): camera_extrinsics.json, camera_intrinsics.json,
/// `images/<camera>/`, `fmask/<camera>/`, `openpose/<camera>/` (or annots/). Extrinsics are called
/// by an image (`1_CC32871A004.png`), camera from world; K is of the full size, images are half
/// of it. Translations become metres by the number in camera_scale.pkl: a Python pickle, which is
/// read if it is nothing but one number, and asked for (--metres-per-unit) otherwise.
std::string recognize_mvhumannet(const std::filesystem::path& path);
Dataset read_mvhumannet(const std::filesystem::path& path, const DatasetOptions& options,
                        const Limits& limits);
std::vector<std::string> write_mvhumannet(const LayoutSource& source,
                                          const std::filesystem::path& out);

/// The cameras, in the layout's world, of no size. Throws DataError for JSON that is neither.
std::vector<Camera> parse_mvhumannet_cameras(std::string_view intrinsics,
                                             std::string_view extrinsics,
                                             const std::string& file = "",
                                             const Limits& limits = {});

/// The number in a pickle of one Python float (protocol 2 to 5), without running anything; nothing
/// if there is anything else in it.
std::optional<double> pickled_number(std::span<const std::byte> bytes);

}  // namespace atelier
