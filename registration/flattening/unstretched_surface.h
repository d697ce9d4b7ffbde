#pragma once

#include "core/mesh.h"
#include "registration/flattening/flat_pattern.h"

namespace atelier {

/// The vertices of a captured surface where its flat pattern, which does not stretch, would hang:
/// what the surface is in doubt by is settled by what cloth can be. [V,3] m.
///
/// Minimises, over the area: the squares of what principal stretches (curved over flat) lie outside
/// 1 +- 0.3 `stretch`; of the way by which vertices are farther than `give` metres from
/// `mesh.vertices`, where half of `give` costs what a stretch by `stretch` does; and of the
/// laplacian of how they moved, so that they move together rather than crumple (a wave of 12 cm and
/// height `give` costs what `stretch` does). Thirty rounds of local projections and one global
/// solve (Bouaziz et al., "Projective dynamics: fusing constraint projections for fast
/// simulation", 2014), beginning at `start`. So most vertices stay within `give`; a pull by
/// a stretch of many times the bound takes some up to twice as far. Each panel is taken as large as
/// the surface is under it: cloth that is ironed out and followed by its pattern, round by round,
/// would shrink.
///
/// `pattern` is one of the same triangles. Throws LogicError unless it is, `start` has a row for
/// each vertex, and `stretch` and `give` are positive. A sparse Cholesky factorisation.
Points unstretched_surface(const Mesh& mesh, const FlatPattern& pattern, double stretch,
                           double tolerance, const Points& start);

}  // namespace atelier
