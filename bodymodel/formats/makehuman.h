#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/formats/makehuman_target.h"
#include "core/finding.h"
#include "core/limits.h"

namespace atelier {

/// The files of a MakeHuman or MPFB2 body, as their distributions lay them out.
struct MakeHumanFiles {
  std::filesystem::path base;     ///< base.obj (hm08): body, helper geometry and joint cubes
  std::filesystem::path rig;      ///< default.mhskel or an MPFB2 rig.*.json
  std::filesystem::path weights;  ///< default_weights.mhw or weights.*.json of that rig
  std::filesystem::path macros;   ///< folder "macrodetails"; "": the bare base mesh
  std::vector<std::filesystem::path> targets;  ///< .target files that become shape parameters
};

struct MakeHumanOptions {
  MakeHumanMacros macros;
  int max_slots = 8;  ///< influences kept per vertex
};

/// A MakeHuman body. Helper vertices are kept beside the model, since clothes hang on them.
struct MakeHumanBody {
  BodyModel model;                 ///< the body alone; one shape parameter in [0,1] per target
  Points base;                     ///< [B,3] all base vertices at these macros, metres, same frame
  SkinWeights base_skin;           ///< [B] weights of all base vertices
  std::vector<int> base_vertices;  ///< [V] base vertex of each model vertex
  std::vector<Finding> findings;   ///< repaired weights, macro targets that are not there
};

/// Reads a body: macro targets are blended into the template, which is turned into metres with its
/// lowest vertex at y = 0. MakeHuman's macro sliders are not linear, so they are options of
/// reading; `targets` are linear and become shape parameters. Weights that do not sum to 1
/// (MakeHuman's sum to 0.95 to 1.06) are scaled with a finding. Throws DataError for what its parts
/// refuse, or if the base mesh has no group "body".
MakeHumanBody read_makehuman(const MakeHumanFiles& files, const MakeHumanOptions& options = {},
                             const Limits& limits = {});

}  // namespace atelier
