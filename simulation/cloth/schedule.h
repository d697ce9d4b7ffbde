#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"

namespace atelier {

/// The order in which constraints are projected, made once per cloth and used by every device.
///
/// Gauss-Seidel over a graph colouring needs one barrier per colour, and on a GPU the barriers, not
/// the arithmetic, are what a small cloth pays for. So colours live inside patches: a patch is a
/// set of constraints whose particles no other patch of the same phase touches. Patches of a phase
/// run at once, each in the fast memory of one core or block, with only its own cheap barriers
/// between its colours; phases follow each other. Phase 0 holds what lies inside a partition of
/// the particles, the next phases what crosses its borders. Our construction; every constraint is
/// in exactly one place, so one sweep is one exact Gauss-Seidel iteration.
struct Schedule {
  /// A run of constraints. Those of kind 0 come first, then 1, 2. The first `paired` of kind 0 each
  /// share their first two particles with the constraint of kind 1 at the same place, which follows
  /// it (a hinge and the spring along its edge: one visit of their particles instead of two); no
  /// others share a particle.
  struct Colour {
    int begin[4];  ///< kind k is `order[begin[k]] ... order[begin[k + 1] - 1]`
    int paired;
  };
  struct Patch {
    int vertex_begin, vertex_end;  ///< into `vertices`
    int colour_begin, colour_end;  ///< into `colours`
  };
  struct Phase {
    int patch_begin, patch_end;  ///< into `patches`
  };

  std::vector<Phase> phases;
  std::vector<Patch> patches;
  std::vector<Colour> colours;
  std::vector<int> vertices;  ///< particles of each patch; in phase 0 every particle exactly once
  std::vector<int> order;     ///< constraint of each place
  int max_patch_vertices = 0;
  int max_colours = 0;  ///< of any patch
};

/// A constraint as the schedule sees it: its particles (-1 for unused places at the end) and its
/// kind (0, 1 or 2), which only groups constraints of one kind together.
struct ConstraintParticles {
  std::array<int, 4> particle;
  int kind;
};

/// How many phase-0 patches a cloth gets.
struct ScheduleOptions {
  /// Patches of phase 0; 0: about 640 particles each, in waves of 132 when large, for one scene on
  /// all of a device. In a sweep with a block for each scene fewer patches leave fewer threads
  /// idle: 1250 particles each are a fifth faster.
  int patches = 0;
  int max_patch_vertices = 1400;  ///< largest patch, so that it fits in on-chip memory, 64 to 65535
};

/// Builds the schedule. `positions` [V,3] are only used to cut the particles into compact patches.
/// Throws LogicError if a particle index is out of range. Cost: O((V + C) log V).
Schedule make_schedule(const Points& positions, const std::vector<ConstraintParticles>& constraints,
                       const ScheduleOptions& options = {});

}  // namespace atelier
