#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/formats/makehuman.h"
#include "core/finding.h"
#include "core/limits.h"

namespace atelier {

struct BodyFileOptions {
  MakeHumanOptions makehuman;     ///< sliders of a MakeHuman body
  std::filesystem::path rig;      ///< of a MakeHuman body; "": default.mhskel beside base.obj
  std::filesystem::path weights;  ///< "": default_weights.mhw beside base.obj
  std::vector<std::filesystem::path> targets;  ///< of a MakeHuman body: .target files that become
                                               ///< shape parameters
  double metres_per_unit = 1;  ///< of a glTF, FBX or SMPL-family file that says another unit than
                               ///< it has: 0.01 where it is in centimetres
};

/// A body and what its reader had to say.
struct BodyFile {
  BodyModel model;
  std::vector<Finding> findings;
};

/// Reads a body model of any format, or makes one: "default", "female" and "male" are the default
/// human's presets; .npz of ours or of the SMPL family; .glb, .gltf and .fbx with a skin;
/// MakeHuman's base.obj, or a folder that holds it, with its rig, weights and, in ../targets, macro
/// targets. Throws DataError for what is none of these, and for a body whose size cannot be in
/// metres (body_size.h), with the metres_per_unit that would do.
BodyFile read_body_file(const std::filesystem::path& path, const BodyFileOptions& options = {},
                        const Limits& limits = {});

}  // namespace atelier
