#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/options.h"
#include "registration/flattening/flatten_panel.h"

namespace atelier {

/// Options of the seam search, with the bound that ends it.
struct FindSeamsOptions {
  double stretch = 0.03;       ///< bound on the stretch of 99% of the area, 0.001 to 1
  int cuts = 400;              ///< maximum number of added seams and darts, 0 to 1000
  bool front_and_back = true;  ///< begin with a front and a back (front_and_back.h)
  double front_back_cost = 1;  ///< relative cost of seams in front and at the back
  /// Horizontal unit vector that the front faces; zero: inferred from the shape (facing_of).
  Eigen::Vector3d facing = Eigen::Vector3d::Zero();
  bool join = true;  ///< remove seams that turn out not to be needed
  /// Cut as woven cloth is: along a field of directions (cross_field.h) and where sleeves are set
  /// in (limb_rings.h), until 99% of the area is stretched by less than `thread_stretch` along warp
  /// and weft each and by less than `bias_stretch` in between, in panels of few corners.
  bool woven = false;
  double thread_stretch = 0.05;  ///< bound where `woven`, 0.001 to 1
  double bias_stretch = 0.1;     ///< the same in every direction, where threads shear; 0.001 to 1
  int corners = 8;               ///< of a panel where `woven`, as far as there is a way; 4 to 100
};
OptionTable describe(FindSeamsOptions& options);

/// Result of the seam search.
struct FoundSeams {
  std::vector<char> cut;    ///< [E] 1 for edges of the mesh's topology to cut
  std::vector<char> sides;  ///< [E] of these, the initial ones between front and back
  std::vector<char> rings;  ///< [E] of these, where sleeves are set in, which stay
  bool reached = false;     ///< the stretch is within the bound and no panel overlaps itself
  int added = 0;            ///< seams and darts beyond those needed for disk topology
  int joined = 0;           ///< seams removed again
};

/// The bound on the stretch that counts: along threads where `woven`, of which other directions
/// count by their share of `bias_stretch`.
inline double stretch_bound(const FindSeamsOptions& options) {
  return options.woven ? options.thread_stretch : options.stretch;
}

/// What that bounds, of a stretch along threads and one in any direction.
inline double counted_strain(const FindSeamsOptions& options, double thread, double any) {
  return options.woven ? std::max(thread, any * options.thread_stretch / options.bias_stretch)
                       : any;
}

/// Called after each cut with one line: the cut, and the share of the area above the bound.
using SeamWatch = std::function<void(const std::string&)>;

/// Finds seams and darts for a surface, in addition to those in `given` (one flag for each edge).
///
/// Begins with a front and a back, if `front_and_back`. Panels that are not disks are cut open
/// along shortest paths (cut_to_disks.h); paths in front and at the back cost more than those at
/// the sides, under the arms and over the shoulders. Then, while more than 1% of the area is
/// stretched beyond the bound or a panel overlaps itself, the panel with the largest such area is
/// cut. Candidates are paths from its most stretched vertices to its boundary (darts) and across it
/// (seams), which prefer stretched and curved regions; each is tried, and the one that lowers the
/// stretched area most for its length is taken. At last, seams that the search added are removed
/// while the bound holds, the one that adds least stretch for its length first; seams between front
/// and back only where less than a quarter of the area is joined, such as in a sleeve. Our choice,
/// after Sheffer and Hart, "Seamster", 2002 (cuts through distorted regions) and Li et al.,
/// "OptCuts", 2018 (cut and merge against a bound).
///
/// With `from`, seams found earlier on the same triangles (vertices may have moved since), the
/// search continues from those.
///
/// Throws DataError as check_flattenable; LogicError for another number of flags. Panels are
/// flattened with stiffening_of(stretch); with another stiffening the same seams may miss the
/// bound. About ten panels are flattened for each cut.
FoundSeams find_seams(const Mesh& mesh, const std::vector<char>& given,
                      const FindSeamsOptions& options = {}, const SeamWatch& watch = {},
                      const FoundSeams& from = {});

}  // namespace atelier
