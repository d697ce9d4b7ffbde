#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

constexpr std::size_t kRestFrames = 5;               ///< of fewer nothing is known
constexpr const char* kRestFile = "rest.obj";        ///< what such a surface is called on disk
constexpr const char* kFormerRestFile = "taut.obj";  ///< in results of the release before

struct RestSurfaceOptions {
  double quantile = 0.8;  ///< of an edge's lengths over the frames, in [0, 1]
  double reach = 0.035;   ///< m, over which what lengths lack is averaged
};

/// The vertices of a garment's rest surface: its surface without the area that folds take, nearly
/// as it was cut. Scans smooth away folds of a few centimetres, where edges are then too short; but
/// folds move, and every part is smooth in some frames. The length of each edge is therefore a
/// quantile of its lengths over the frames (noise and weight lengthen it in some). The missing
/// lengths are averaged over `reach`, since single edges are noisy and no panel lies flat with
/// noise, as a tensor, since a fold takes of the length across it alone; and this for each frame.
/// The frame that lacks least is where it begins, a pose in which little is folded, as knees and
/// elbows are in others: vertices move from there to where edges have these lengths, together
/// rather than in new folds: the squares of what edges lack and of the graph laplacian of how
/// vertices moved are least (25 rounds of Sorkine and Alexa, "As-rigid-as-possible surface
/// modeling", 2007, an edge at a time). The result is turned about +Y and moved to where `mesh` is.
/// Our choice.
///
/// `frames` are the vertices of each frame, [V,3] metres. Of fewer than kRestFrames the mesh's own
/// come back, as where a factorisation fails. Triangles that are crushed in a frame, to less than a
/// tenth of their longest side, say nothing in it. Throws LogicError for frames of another size,
/// numbers that are not finite and options out of range. Two sparse Cholesky factorisations, and a
/// solve for each frame.
Points rest_surface(const Mesh& mesh, const std::vector<Points>& frames,
                    const RestSurfaceOptions& options = {});

}  // namespace atelier
