#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh.h"
#include "core/tree.h"

namespace atelier {

/// Where a body wears a garment, by what scans of many frames show.
struct GarmentCover {
  Eigen::VectorXd share;  ///< [V] of the body: 1 covered, 0 bare
  Eigen::VectorXd gap;    ///< [V] m from the body to the cloth along the normal
};

/// Observed cover of each vertex of the body.
struct GarmentVotes {
  Eigen::VectorXd covered;  ///< [V] frames in which the garment lies over the vertex
  Eigen::VectorXd bare;     ///< [V] frames in which it is seen to be bare or under something else
  Eigen::VectorXd gap;      ///< [V] sum of the gaps, m
};

/// The cover of each vertex of a body in one scan: a ray from a little under the skin outwards (at
/// most 0.4 m, up to where it meets the body again) finds what lies over it.
GarmentVotes garment_votes(const Mesh& scan, std::uint8_t label, const Points& body,
                           const Triangles& body_faces);

/// Adds votes of another frame. Throws LogicError if the bodies differ in size.
void add_votes(GarmentVotes& sum, const GarmentVotes& frame);

/// Votes as shares and gaps; what no frame has seen takes those of its neighbourhood (harmonic over
/// the body's edges), but for what is farther than `reach` metres along the surface from all that
/// was seen, which counts as bare: of it nothing is known. `body` is any frame's.
GarmentCover garment_cover(const GarmentVotes& votes, const Points& body,
                           const Triangles& body_faces, double reach = 0.15);

}  // namespace atelier
