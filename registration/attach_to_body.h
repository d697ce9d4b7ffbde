#pragma once

#include <vector>

#include "core/garment.h"

namespace atelier {

/// Each vertex as a point that rides on a triangle of the body: its foot on the triangle's plane
/// and its height over it, so that on the same body it is exactly where it was. The triangle is, of
/// those round the nearest point of the body, the one over which the vertex stands least aslant.
/// Throws LogicError as build_tree; DataError for a body without faces.
std::vector<Attachment> attach_to_body(const Points& vertices, const Points& body,
                                       const Triangles& body_faces);

/// Where the attached points are on a body that has moved, [A,3] m, in the order of `attachments`.
/// Throws LogicError for a triangle that the body does not have.
Points body_driven(const std::vector<Attachment>& attachments, const Points& body,
                   const Triangles& body_faces);

}  // namespace atelier
