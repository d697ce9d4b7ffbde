#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/options.h"
#include "registration/flattening/flatten_panel.h"

namespace atelier {

/// When a surface is cut enough.
struct FindSeamsOptions {
  double stretch = 0.03;  ///< stretch that 99 hundredths of the area shall keep below, 0.001 to 1
  int cuts = 400;         ///< seams and darts added at most, 0 to 1000
  bool front_and_back = true;  ///< begin with a front and a back (front_and_back.h)
  double front_back_cost =
      1;  ///< how much dearer seams are in front and at the back than at the sides
  /// Where the front looks, horizontal, of length 1; zero: as far as the shape says (facing_of).
  Eigen::Vector3d facing = Eigen::Vector3d::Zero();
  bool join = true;  ///< seams that turn out not to be needed are sewn again
};
OptionTable describe(FindSeamsOptions& options);

/// Where to cut.
struct FoundSeams {
  std::vector<char> cut;    ///< [E] edges of the mesh's topology
  std::vector<char> sides;  ///< [E] those between front and back that it began with
  bool reached = false;     ///< the stretch is within bounds and no panel lies over itself
  int added = 0;            ///< seams and darts beyond those that make disks
  int joined = 0;           ///< seams sewn again
};

/// Says that a cut was added: what, and the share of the area that is stretched too far.
using SeamWatch = std::function<void(const std::string&)>;

/// Seams and darts for a surface, beginning with those in `given` (one flag for each edge).
///
/// Begins with a front and a back, if asked to. Panels that are no disks are opened along the
/// shortest ways (cut_to_disks.h), dearer in front and at the back than at the sides, under the
/// arms and over the shoulders. Then, while more than a hundredth of the area is stretched too far
/// or a panel lies over itself, the panel that has most of it is cut: of ways from its most
/// stretched places to its boundary (darts) and right through it (seams), along what is stretched
/// and curved, each is tried and the one taken that lowers the stretched area most for its length.
/// At last found seams are sewn again while the bounds hold, the one first that adds least stretch
/// for its length; those between front and back only where less than a quarter of the area comes
/// together, as in a sleeve. Our choice, after Sheffer and Hart, "Seamster", 2002 (cuts through
/// distorted places) and Li et al., "OptCuts", 2018 (cut and merge against a bound).
///
/// With `from`, seams found before on the same triangles (of vertices that have moved since), it
/// goes on from those instead of beginning anew.
///
/// Throws DataError as check_flattenable; LogicError for another number of flags. Panels
/// stiffen at stiffening_of(stretch): laid flat with another one, the same seams may miss the
/// bound. Some ten panels are laid flat for each cut.
FoundSeams find_seams(const Mesh& mesh, const std::vector<char>& given,
                      const FindSeamsOptions& options = {}, const SeamWatch& watch = {},
                      const FoundSeams& from = {});

}  // namespace atelier
