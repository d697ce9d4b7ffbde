#pragma once

#include <filesystem>

#include "bodymodel/formats/marker_fit.h"
#include "bodymodel/motion_clip.h"
#include "core/limits.h"

namespace atelier {

/// Reads a motion of any format, told by extension and content: .bvh; .npz of ours or of AMASS;
/// .glb, .gltf and .fbx (first animation); .trc and .c3d, by fitting a person to their markers
/// (marker_fit.h, `markers`); .amc, whose skeleton is `asf` or the .asf beside it that its name
/// begins with
/// ("11_01.amc": "11.asf") or that is alone. Throws DataError for another extension, or an .amc
/// whose skeleton is not found.
///
/// npz and glTF say their unit and axes; `options` still change them where they are set, and legs
/// that no person has (0.15 to 1.5 m) are taken for another unit, with a finding ("motion-unit").
MotionClip read_motion_file(const std::filesystem::path& path, const MotionOptions& options = {},
                            const std::filesystem::path& asf = {},
                            const MarkerFitOptions& markers = {}, const Limits& limits = {});

/// Writes .bvh, .npz (ours), .glb or .gltf (skeleton and animation). Throws LogicError for another
/// extension.
void write_motion_file(const std::filesystem::path& path, const MotionClip& clip);

}  // namespace atelier
