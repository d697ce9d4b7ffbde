#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "core/finding.h"
#include "core/limits.h"

namespace atelier {

class Npz;

struct SmplOptions {
  int betas = 10;       ///< shape directions taken, the first ones; at most what the file has
  int expressions = 0;  ///< SMPL-X: expression directions taken, as parameters "expression_0", ...
  double metres_per_unit = 1;  ///< of the file's lengths; 0.01 for centimetres
};

/// A body of the family, and what had to be repaired.
struct SmplBody {
  BodyModel model;
  std::vector<Finding> findings;  ///< "skin-weights-sum", "skin-weights-negative"
};

/// Reads SMPL, SMPL-H, SMPL-X (Loper et al. 2015, Romero et al. 2017, Pavlakos et al. 2019) and
/// STAR (Osman et al. 2020) from an npz that the user supplies; which one it is follows from the
/// number of joints and pose directions, and is the model's name, with the gender behind it where
/// the file or its folder is named by one ("smplx_female"). Arrays: v_template [V,3], f [F,3],
/// weights [V,J], J_regressor [J,V], kintree_table [2,J], shapedirs [V,3,S], posedirs [V,3,P] or
/// [P,3V]; vt and ft where there are. Metres, Y up. Pickles are not read: converting them needs
/// their own programs.
///
/// Throws DataError, naming array, found and expected shape, for missing arrays, wrong shapes,
/// numbers that are not finite or beyond `limits.mesh_coordinate`, indices out of range, a tree
/// with a cycle or two roots, a vertex that no joint moves, and a template that is not in metres
/// (0.3 to 3 m tall). Weights that do not sum to 1 are scaled, negative ones set to 0, with a
/// finding.
SmplBody read_smpl(const Npz& npz, const SmplOptions& options = {}, const Limits& limits = {});
SmplBody read_smpl(const std::filesystem::path& path, const SmplOptions& options = {},
                   const Limits& limits = {});

/// Joint names of the family by their number: 24 (SMPL, STAR), 52 (SMPL-H) or 55 (SMPL-X). Throws
/// LogicError for another number.
std::vector<std::string> smpl_joint_names(Index joints);

/// Parents of those joints.
std::vector<int> smpl_parents(Index joints);

}  // namespace atelier
